#include <optional>
#include <utility>

#include "gradients/state_vector.hpp"
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
  return assembled(model.dof_count, model.dof_count, entries);
}

/// Splits the stiffness into sum k g g^T over the strains of all stencils, g their gradients, and what is left where
/// their stiffnesses are taken away but their forces are kept.
class StrainParts {
 public:
  StrainParts(const Equations& system, const State& state, const Configuration& configuration)
      : model_(system.model()), without_(system.elastic()) {
    const ElasticCoefficients& k = system.elastic();
    const Assembler& assembler = system.assembler();
    StrainGradients strains;
    for (int e = 0; e < model_.edge_count; ++e) {
      if (k.stretch_stiffness(e) == 0.0) continue;
      stretch_gradients(model_, configuration, e, strains);
      add_row(assembler.stretch, e, strains.gradient[0], k.stretch_stiffness(e) * model_.edge_length(e));
      take_away(strains.strain[0], without_.stretch_stiffness(e), without_.stretch_natural(e));
    }
    for (int b = 0; b < static_cast<int>(model_.bend.size()); ++b) {
      bend_gradients(model_, k.measure, configuration, b, strains);
      add_rows(assembler.bend, b, strains, k.bend_stiffness, without_.bend_stiffness, without_.bend_natural);
    }
    for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
      half_gradients(model_, state.q, k.measure, configuration, h, strains);
      add_rows(assembler.half, h, strains, k.half_stiffness, without_.half_stiffness, without_.half_natural);
    }
  }

  SparseMatrix gradients() const { return assembled(count(), model_.dof_count, entries_); }
  VectorX stiffnesses() const { return Eigen::Map<const VectorX>(stiffnesses_.data(), count()); }
  /// With stiffnesses next to nothing, and natural strains for which forces are what they were.
  const ElasticCoefficients& without() const { return without_; }

 private:
  Eigen::Index count() const { return static_cast<Eigen::Index>(stiffnesses_.size()); }

  static void take_away(double strain, double& stiffness, double& natural) {
    constexpr double kLittle = 0x1p-40;
    natural = strain - (strain - natural) / kLittle;
    stiffness *= kLittle;
  }

  void add_row(const ElementTable& table, int element, const double* gradient, double stiffness) {
    const int row = static_cast<int>(stiffnesses_.size());
    const int* dofs = table.dofs(element);
    for (int i = 0; i < table.width(); ++i)
      if (dofs[i] >= 0 && gradient[i] != 0.0) entries_.emplace_back(row, dofs[i], gradient[i]);
    stiffnesses_.push_back(stiffness);
  }

  void add_rows(const ElementTable& table, int stencil, const StrainGradients& strains, const Columns3& stiffness,
                Columns3& less, Columns3& shifted) {
    for (int s = 0; s < strains.count; ++s) {
      if (stiffness(stencil, s) != 0.0) add_row(table, stencil, strains.gradient[s], stiffness(stencil, s));
      take_away(strains.strain[s], less(stencil, s), shifted(stencil, s));
    }
  }

  const Model& model_;
  ElasticCoefficients without_;
  Entries entries_;
  std::vector<double> stiffnesses_;
};

}  // namespace

Linearisation World::linearise() const {
  Implementation& self = *implementation_;
  const Model& model = self.model;
  // Equations of its own: what is read out changes no matrix that is yet to serve.
  Options symmetric = self.options;
  symmetric.integrator = Integrator::statics;
  Equations system(model, equation_options(symmetric));
  self.update_custom_force(system);
  const MatrixX3 forces = self.custom_force, moments = self.custom_moments;
  self.solve_for_custom_at_rest(system, self.state.time);
  system.begin(self.state, self.parameters, StepRule::statics, 0.0);
  StepData evaluation;
  const SparseMatrix basis = free_basis(model), back = basis.transpose();
  std::optional<StrainParts> parts;
  try {
    system.evaluate(self.state.q, false, nullptr, evaluation);
    parts.emplace(system, self.state, evaluation.configuration);
    system.elastic() = parts->without();
    system.evaluate(self.state.q, true, nullptr, evaluation);
  } catch (...) {
    self.forget_custom(system, forces, moments);
    throw;
  }
  self.forget_custom(system, forces, moments);

  Linearisation out;
  out.geometric = back * matrix_of(system.assembler()) * basis;
  out.gradients = parts->gradients() * basis;
  out.stiffnesses = parts->stiffnesses();
  out.mass = back * matrix_of(model, system.mass()) * basis;
  Entries moves;
  Matrix3 axes = Matrix3::Identity();
  if (model.planar()) axes << model.plane->first, model.plane->second, model.plane->normal;
  for (int node = 0; node < model.node_count; ++node)
    for (int i = 0; i < model.dimension; ++i)
      for (int k = 0; k < 3; ++k) moves.emplace_back(3 * node + k, model.node_dof[at(node)] + i, axes(k, i));
  out.displacement = assembled(3 * model.node_count, model.dof_count, moves) * basis;
  return out;
}

}  // namespace withe
