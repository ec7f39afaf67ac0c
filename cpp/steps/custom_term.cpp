#include "steps/custom_term.hpp"

#include <algorithm>
#include <stdexcept>

#include "model/edge_vectors.hpp"

namespace withe {
AppliedForces applied_forces(const Model& model, const MatrixX3& forces, const MatrixX3& moments) {
  AppliedForces out{VectorX::Zero(model.dof_count), {}};
  for (int i = 0; i < model.node_count; ++i) put_node_vector(model, i, forces.row(i), out.force);
  for (Eigen::Index i = 0; i < moments.rows(); ++i) out.moments.emplace_back(moments.row(i));
  return out;
}

AppliedForces given_forces(const StepProblem& problem) {
  const AppliedForces& given = problem.prescribed->custom;
  if (given.force.size() != 0) return given;
  return {VectorX::Zero(problem.model.dof_count),
          std::vector<Vector3>(at(problem.loads.node_moments), Vector3::Zero())};
}

void CustomTerm::find(const StepProblem& problem, StepData& data, Assembler& assembler, bool with_matrix) {
  const CustomResponse& respond = problem.prescribed->respond;
  if (!respond) {
    data.custom = given_forces(problem);
    return;
  }
  data.velocity = data.z - problem.start->q;
  data.velocity *= problem.resists() ? 1.0 / problem.interval : 0.0;
  CustomForces now = respond(data.z, data.velocity, with_matrix);
  data.custom = applied_forces(problem.model, now.forces, now.moments);
  if (!with_matrix) return;
  found_ = std::move(now);
  couple(problem, assembler);
}

void CustomTerm::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                     std::span<double> values) const {
  const int n = problem.model.dof_count;
  data.gradient.head(n) -= data.custom.force;
  data.row_magnitude.head(n) += data.custom.force.cwiseAbs();
  if (problem.prescribed->respond && !values.empty()) add_matrix(problem, data, assembler, values);
}

void CustomTerm::add_applied(const StepProblem&, const StepData& data, const Assembler&, VectorX& force) const {
  force += data.custom.force;
}

/// Calls add(row, column, value) for dF/dz, with v = (z - q0) / h: a row is 3 node + axis for a force, and 3 (nodes +
/// node) + axis for a moment.
template <class Add>
void CustomTerm::for_each_derivative(const StepProblem& problem, const Add& add) const {
  const auto visit = [&](const SparseMatrix& matrix, double factor) {
    for (int column = 0; column < matrix.outerSize(); ++column)
      for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry)
        if (entry.value() != 0.0) add(static_cast<int>(entry.row()), column, factor * entry.value());
  };
  visit(found_.by_position, 1.0);
  if (problem.resists()) visit(found_.by_velocity, 1.0 / problem.interval);
}

/// Couples whole nodes, so that supported directions can be projected out.
void CustomTerm::couple(const StepProblem& problem, Assembler& assembler) {
  const Model& model = problem.model;
  const std::vector<LoadPiece>& pieces = problem.loads.pieces;
  const int nodes = model.node_count;
  std::vector<std::pair<int, int>> coupled;  // node (for a moment: nodes + node), and the node on which it depends
  for_each_derivative(problem, [&](int row, int column, double) { coupled.emplace_back(row / 3, column / 3); });
  std::sort(coupled.begin(), coupled.end());
  coupled.erase(std::unique(coupled.begin(), coupled.end()), coupled.end());
  std::vector<std::vector<int>> groups;
  const auto add_group = [&](const int* dofs, int count, int node) {
    groups.emplace_back(dofs, dofs + count);
    for (int i = 0; i < model.dimension; ++i) groups.back().push_back(model.node_dof[at(node)] + i);
  };
  for (const auto& [row, column] : coupled) {
    if (row < nodes) {
      int dofs[3];
      for (int i = 0; i < model.dimension; ++i) dofs[i] = model.node_dof[at(row)] + i;
      add_group(dofs, model.dimension, column);
      continue;
    }
    if (moment_pieces_.empty()) {
      moment_pieces_.resize(at(nodes));
      for (std::size_t k = 0; k < pieces.size(); ++k)
        if (pieces[k].load < 0) moment_pieces_[at(pieces[k].node)].push_back(k);
    }
    for (std::size_t k : moment_pieces_[at(row - nodes)])
      add_group(loads_->tables()[k].dofs(0), loads_->tables()[k].width(), column);
  }
  assembler.couple_groups(groups);
}

void CustomTerm::add_matrix(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                            std::span<double> values) const {
  const Model& model = problem.model;
  const int nodes = model.node_count, size = model.dimension;
  Matrix3 axes = Matrix3::Identity();  // rows: axes of the unknowns
  if (model.planar()) axes << model.plane->first.transpose(), model.plane->second.transpose(), Vector3::Zero();
  const auto add_row = [&](int row, int column, double value) {
    const int first = model.node_dof[at(column / 3)];
    for (int j = 0; j < size; ++j)
      if (const double share = axes(j, column % 3); share != 0.0)
        values[static_cast<std::size_t>(assembler.place(row, first + j))] += share * value;
  };
  Local local;
  for_each_derivative(problem, [&](int row, int column, double value) {
    if (row < 3 * nodes) {
      for (int i = 0; i < size; ++i)
        if (const double share = axes(i, row % 3); share != 0.0)
          add_row(model.node_dof[at(row / 3)] + i, column, -share * value);
      return;
    }
    const int node = row / 3 - nodes;
    for (std::size_t k : moment_pieces_[at(node)]) {
      load_local(model, *problem.start, data.z, data.configuration, problem.loads.pieces[k], Vector3::Unit(row % 3),
                 local);  // the effect of a moment is linear in the moment
      const ElementTable& table = loads_->tables()[k];
      for (int i = 0; i < table.width(); ++i)
        if (table.dofs(0)[i] >= 0) add_row(table.dofs(0)[i], column, value * local.gradient[i]);
    }
  });
}

void CustomTerm::add_adjoint(const StepProblem&, const StepData&, const Assembler&, StepAdjoint&) const {
  throw std::invalid_argument("no gradient is available with custom forces");
}

}  // namespace withe
