#include <algorithm>
#include <optional>
#include <utility>

#include <Eigen/SVD>

#include "gradients/state_vector.hpp"
#include "steps/carried_parts.hpp"
#include "steps/strain_parts.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

using Entries = std::vector<Eigen::Triplet<double>>;

SparseMatrix assembled(Eigen::Index rows, Eigen::Index columns, const Entries& entries) {
  SparseMatrix out(rows, columns);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

SparseMatrix matrix_of(const Assembler& assembler) {
  const SparsityPattern& pattern = assembler.pattern();
  const LinearSolver& solver = assembler.solver();
  Entries entries;
  entries.reserve(pattern.row_indices.size());
  for (int column = 0; column < pattern.size; ++column)
    for (int p = pattern.column_starts[at(column)]; p < pattern.column_starts[at(column + 1)]; ++p) {
      const int row = pattern.row_indices[at(p)];
      entries.emplace_back(row, column, solver.values()[static_cast<std::size_t>(solver.place(row, column))]);
    }
  return assembled(pattern.size, pattern.size, entries);
}

SparseMatrix matrix_of(const Model& model, const MassMatrix& mass) {
  Entries entries;
  for (int i = 0; i < model.dof_count; ++i) entries.emplace_back(i, i, mass.rows(i));
  for (int e = 0; e < model.edge_count; ++e)
    for (int i = 0; i < model.dimension; ++i) {
      const int a = model.tail_dof[at(e)] + i, b = model.head_dof[at(e)] + i;
      const double m = mass.coupling(e);
      entries.emplace_back(a, a, -m);
      entries.emplace_back(b, b, -m);
      entries.emplace_back(a, b, m);
      entries.emplace_back(b, a, m);
    }
  for (std::size_t b = 0; b < mass.bodies.size(); ++b) {
    const int dof = model.frame_dof[at(model.body_frame[b])];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) entries.emplace_back(dof + i, dof + j, mass.bodies[b](i, j));
  }
  return assembled(model.dof_count, model.dof_count, entries);
}

/// The basis of free motions without those that closed loops of joints bar, and without multipliers. `stiffness`: with
/// the columns of multipliers.
SparseMatrix without_loops(const Model& model, const SparseMatrix& stiffness, const SparseMatrix& free) {
  if (model.loops.empty()) return free;
  constexpr double kNegligible = 1e-9;  // singular value, over the greatest one
  std::vector<bool> is_multiplier(at(model.dof_count), false);
  for (const Loop& loop : model.loops) std::fill_n(is_multiplier.begin() + loop.dof, model.loop_size(), true);
  MatrixX slopes = MatrixX::Zero(model.dof_count, model.loop_size() * static_cast<Eigen::Index>(model.loops.size()));
  Eigen::Index count = 0;
  for (const Loop& loop : model.loops)
    for (int i = 0; i < model.loop_size(); ++i, ++count)
      for (SparseMatrix::InnerIterator entry(stiffness, loop.dof + i); entry; ++entry)
        if (!is_multiplier[at(entry.row())]) slopes(entry.row(), count) = entry.value();
  const MatrixX rates = free.transpose() * slopes;
  std::vector<Eigen::Index> coupled;
  Entries entries;
  Eigen::Index columns = 0;
  for (Eigen::Index k = 0; k < free.cols(); ++k) {
    SparseMatrix::InnerIterator first(free, k);
    if (first && is_multiplier[at(first.row())]) continue;
    if (rates.row(k).isZero(0.0))
      entries.emplace_back(k, columns++, 1.0);
    else
      coupled.push_back(k);
  }
  MatrixX bars(rates.cols(), static_cast<Eigen::Index>(coupled.size()));
  for (std::size_t k = 0; k < coupled.size(); ++k)
    bars.col(static_cast<Eigen::Index>(k)) = rates.row(coupled[k]).transpose();
  Eigen::JacobiSVD<MatrixX> svd(bars, Eigen::ComputeFullV);
  svd.setThreshold(kNegligible);
  for (Eigen::Index k = svd.rank(); k < bars.cols(); ++k, ++columns)
    for (std::size_t i = 0; i < coupled.size(); ++i)
      entries.emplace_back(coupled[i], columns, svd.matrixV()(static_cast<Eigen::Index>(i), k));
  return free * assembled(free.cols(), columns, entries);
}

/// The basis of free motions, in which parts that bodies carry follow them.
SparseMatrix with_carried(const StepProblem& problem, StepData& data, SparseMatrix basis) {
  const Model& model = problem.model;
  for (std::size_t i = 0; i < model.carried.size(); ++i) {
    const CarriedPart& part = model.carried[i];
    Carrying& carrying = data.carrying[i];
    if (!carrying.known) find_carrying(problem, data.z, i, carrying);
    Entries follow;
    for (int d = 0; d < part.own_size; ++d)
      for (std::size_t b = 0; b < part.body_dofs.size(); ++b)
        follow.emplace_back(part.own_dof + d, part.body_dofs[b], carrying.follow(d, static_cast<Eigen::Index>(b)));
    basis = (basis + assembled(model.dof_count, model.dof_count, follow) * basis).eval();
  }
  return basis;
}

}  // namespace

Linearisation World::linearise() const {
  Implementation& self = *implementation_;
  const Model& model = self.model;
  // Equations of its own: what is read out changes no matrix that is yet to serve.
  Equations system(model, self.systems.static_options());
  Prescribed prescribed = self.custom().at_rest();
  prescribed.respond = self.custom().response_at_rest(self.state.time);
  system.begin(self.state, self.parameters, StepRule::statics, 0.0, prescribed);
  StepData evaluation;
  system.evaluate(self.state.q, true, nullptr, evaluation);
  const SparseMatrix free = without_loops(model, matrix_of(system.assembler()), free_basis(model)),
                     basis = with_carried(system.problem(), evaluation, free), back = basis.transpose();
  const StrainParts parts(system, self.state, evaluation.configuration);
  const VectorX imbalance = evaluation.residual;  // forces on carried nodes are among those of their bodies
  system.elastic() = parts.without();
  system.evaluate(self.state.q, true, nullptr, evaluation);

  Linearisation out;
  out.geometric = free.transpose() * matrix_of(system.assembler()) * free;
  const auto strains = static_cast<Eigen::Index>(parts.stiffnesses().size());
  out.gradients = assembled(strains, model.dof_count, parts.gradients()) * basis;
  out.stiffnesses = Eigen::Map<const VectorX>(parts.stiffnesses().data(), strains);
  out.imbalance = free.transpose() * imbalance;
  out.mass = back * matrix_of(model, system.mass()) * basis;
  Entries moves;
  Matrix3 axes = Matrix3::Identity();
  if (model.planar()) axes << model.plane->first, model.plane->second, model.plane->normal;
  for (int node = 0; node < model.node_count; ++node)
    for (int i = 0; i < model.dimension; ++i)
      for (int k = 0; k < 3; ++k) moves.emplace_back(3 * node + k, model.node_dof[at(node)] + i, axes(k, i));
  out.displacement = assembled(3 * model.node_count, model.dof_count, moves) * basis;
  Entries turns;
  for (int e = 0; e < model.edge_count; ++e)
    for (int i = 0; i < model.dimension; ++i) {
      const int row = model.dimension * e + i;
      turns.emplace_back(row, model.head_dof[at(e)] + i, 1.0 / model.edge_length(e));
      turns.emplace_back(row, model.tail_dof[at(e)] + i, -1.0 / model.edge_length(e));
    }
  out.turn = assembled(model.dimension * model.edge_count, model.dof_count, turns) * basis;
  return out;
}

}  // namespace withe
