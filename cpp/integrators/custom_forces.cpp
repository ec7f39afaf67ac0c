// Custom forces among the equations: see forces/custom_forces.hpp.

#include <algorithm>

#include "common/check.hpp"
#include "integrators/equations.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void Equations::set_custom(const MatrixX3& forces, const MatrixX3& moments) {
  for (int i = 0; i < model_.node_count; ++i) {
    const int dof = model_.node_dof[at(i)];
    const Vector3 f = forces.row(i);
    if (model_.planar())
      custom_force.segment<2>(dof) << f.dot(model_.plane->first), f.dot(model_.plane->second);
    else
      custom_force.segment<3>(dof) = f;
  }
  for (std::size_t i = 0; i < loads_.node_moments.size(); ++i)
    loads_.node_moments[i] = moments.row(static_cast<Eigen::Index>(i));
}

void Equations::ask_custom(const VectorX& z, bool derivatives) {
  VectorX v = z - state_->q;
  v *= h_ != 0.0 ? 1.0 / h_ : 0.0;
  CustomForces now = respond(z, v, derivatives);
  set_custom(now.forces, now.moments);
  if (!derivatives) return;
  custom_ = std::move(now);
  couple_custom();
}

/// Calls add(row, column, value) for dF/dz, with v = (z - q0) / h: a row is 3 node + axis, from 3 nodes on of a moment.
template <class Add>
void Equations::for_each_custom_derivative(const Add& add) const {
  const auto visit = [&](const SparseMatrix& matrix, double factor) {
    for (int column = 0; column < matrix.outerSize(); ++column)
      for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry)
        if (entry.value() != 0.0) add(static_cast<int>(entry.row()), column, factor * entry.value());
  };
  visit(custom_.by_position, 1.0);
  if (h_ != 0.0) visit(custom_.by_velocity, 1.0 / h_);
}

/// Whole nodes are coupled, so that what supports hold can be projected out.
void Equations::couple_custom() {
  const int nodes = model_.node_count;
  std::vector<std::pair<int, int>> coupled;  // node, or nodes + node of a moment; and the node that it depends on
  for_each_custom_derivative([&](int row, int column, double) { coupled.emplace_back(row / 3, column / 3); });
  std::sort(coupled.begin(), coupled.end());
  coupled.erase(std::unique(coupled.begin(), coupled.end()), coupled.end());
  std::vector<std::vector<int>> groups;
  const auto add_group = [&](const int* dofs, int count, int node) {
    groups.emplace_back(dofs, dofs + count);
    for (int i = 0; i < model_.dimension; ++i) groups.back().push_back(model_.node_dof[at(node)] + i);
  };
  for (const auto& [row, column] : coupled) {
    if (row < nodes) {
      int dofs[3];
      for (int i = 0; i < model_.dimension; ++i) dofs[i] = model_.node_dof[at(row)] + i;
      add_group(dofs, model_.dimension, column);
      continue;
    }
    if (moment_pieces_.empty()) {
      moment_pieces_.resize(at(nodes));
      for (std::size_t k = 0; k < loads_.pieces.size(); ++k)
        if (loads_.pieces[k].load < 0) moment_pieces_[at(loads_.pieces[k].node)].push_back(k);
    }
    for (std::size_t k : moment_pieces_[at(row - nodes)])
      add_group(assembler_.loads[k].dofs(0), assembler_.loads[k].width(), column);
  }
  const int before = assembler_.generation();
  assembler_.couple_groups(groups);
  if (contact_ && assembler_.generation() != before) ordered_ = contact_rows_.keys();
}

void Equations::add_custom_matrix(const VectorX& z) {
  LinearSolver& solver = assembler_.solver();
  const std::span<double> values = solver.values();
  const int nodes = model_.node_count, size = model_.dimension;
  Matrix3 axes = Matrix3::Identity();  // rows: those of the unknowns
  if (model_.planar()) axes << model_.plane->first.transpose(), model_.plane->second.transpose(), Vector3::Zero();
  const auto add_row = [&](int row, int column, double value) {
    const int first = model_.node_dof[at(column / 3)];
    for (int j = 0; j < size; ++j)
      if (const double share = axes(j, column % 3); share != 0.0)
        values[static_cast<std::size_t>(solver.offset(row, first + j))] += share * value;
  };
  Local local;
  for_each_custom_derivative([&](int row, int column, double value) {
    if (row < 3 * nodes) {
      for (int i = 0; i < size; ++i)
        if (const double share = axes(i, row % 3); share != 0.0)
          add_row(model_.node_dof[at(row / 3)] + i, column, -share * value);
      return;
    }
    const int node = row / 3 - nodes;
    Vector3& moment = loads_.node_moments[at(node)];
    const Vector3 whole = moment;
    moment = Vector3::Unit(row % 3);  // what a moment does is linear in it
    for (std::size_t k : moment_pieces_[at(node)]) {
      load_local(model_, *state_, z, middle_, loads_, loads_.pieces[k], local);
      const ElementTable& table = assembler_.loads[k];
      for (int i = 0; i < table.width(); ++i)
        if (table.dofs(0)[i] >= 0) add_row(table.dofs(0)[i], column, value * local.gradient[i]);
    }
    moment = whole;
  });
}

}  // namespace withe
