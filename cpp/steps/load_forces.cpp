#include "steps/load_forces.hpp"

#include <algorithm>

#include "geometry/rotation.hpp"

namespace withe {
namespace {

/// Adds derivatives by the drawn edge of a load piece. `by`: derivative by the value of the piece. A load that follows
/// keeps its components along the drawn directors.
void add_drawn(const StepProblem& problem, const LoadPiece& piece, const Vector3& by, CoefficientAdjoint& out) {
  const Vector3 value = problem.parameters->loads.row(piece.load);
  if (piece.along) out.rest_length(piece.edge) += by.dot(value) / problem.model.edge_arc(piece.edge);
  const bool follows = piece.shape == LoadShape::follower || piece.follower;
  if (follows && piece.edge >= 0) out.edge_turn.row(piece.edge) += by.cross(value).transpose();
}

/// Adds derivatives by the rotation of the frame F of a joint, beyond its unknowns. The rows are -J(w)^T F M for a
/// moment M that follows the frame. For a moment that does not follow, on a part that turns about the axis a of a
/// hinge, the row is -(F a) . M.
void add_frame_turn(const StepProblem& problem, const StepData& data, const LoadPiece& piece, const double* rows,
                    StepAdjoint& adjoint) {
  const Matrix3& frame = data.configuration.frame[at(piece.frame)];
  const Vector3 value = piece.weight * problem.parameters->loads.row(piece.load);
  if (!piece.follower) {
    const Vector3 axis = frame * problem.model.hinges[at(piece.hinge)].axis;
    adjoint.middle_spin.row(piece.frame) -= rows[3] * axis.cross(value).transpose();
    return;
  }
  const Vector3 w = data.z.segment<3>(problem.model.frame_dof[at(piece.frame)]),
                own = hinge_turn(problem.model, data.z, piece.hinge) * value,
                spin = cayley_spin(w) * Eigen::Map<const Vector3>(rows);
  adjoint.middle_spin.row(piece.frame) -= (frame * own).cross(spin).transpose();
}

}  // namespace

LoadForces::LoadForces(const Model& model, const Loads& loads)
    : has_potential_(std::all_of(loads.pieces.begin(), loads.pieces.end(),
                                 [&](const LoadPiece& piece) { return withe::has_potential(model, piece); })) {
  for (const LoadPiece& piece : loads.pieces) {
    int dofs[kMaxLocal];
    const int n = load_dofs(model, piece, dofs);
    tables_.emplace_back(n, std::vector<int>(dofs, dofs + n));
  }
}

void LoadForces::declare(std::vector<ElementTable*>& tables) {
  for (ElementTable& table : tables_) tables.push_back(&table);
}

void LoadForces::add(const StepProblem& problem, StepData& data, const Assembler&, std::span<double> values) const {
  const Loads& loads = problem.loads;
  Local local;
  for (std::size_t k = 0; k < loads.pieces.size(); ++k) {
    const bool dead = loads.pieces[k].shape == LoadShape::dead_node;
    load_local(problem.model, *problem.start, data.z, data.configuration, loads.pieces[k],
               value_of(*problem.parameters, data.custom, loads.pieces[k]), local);
    tables_[k].add_gradient(0, local.gradient, 1.0, data.gradient, data.row_magnitude);
    if (!values.empty() && !dead) tables_[k].add_hessian(0, local.hessian, 1.0, values);
    const int* dofs = tables_[k].dofs(0);
    if (dead)
      for (int i = 0; i < problem.model.dimension; ++i) data.potential += local.gradient[i] * data.z(dofs[i]);
    else
      data.potential += local.energy;
  }
}

void LoadForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler&,
                             StepAdjoint& adjoint) const {
  const Loads& loads = problem.loads;
  Local local;
  double rows[kMaxLocal];
  for (std::size_t k = 0; k < loads.pieces.size(); ++k) {
    const LoadPiece& piece = loads.pieces[k];
    if (piece.load < 0) continue;
    const ElementTable& table = tables_[k];
    gather(table, 0, adjoint.rows, rows);
    Vector3 by = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      load_local(problem.model, *problem.start, data.z, data.configuration, piece, Vector3::Unit(axis), local);
      for (int i = 0; i < table.width(); ++i) by(axis) += rows[i] * local.gradient[i];
    }
    adjoint.coefficients.loads.row(piece.load) += by.transpose();
    add_drawn(problem, piece, by, adjoint.coefficients);
    if (piece.shape == LoadShape::frame_moment && (piece.follower || piece.hinge >= 0) && !problem.model.planar() &&
        problem.moves())
      add_frame_turn(problem, data, piece, rows, adjoint);
  }
}

void LoadForces::add_applied(const StepProblem& problem, const StepData& data, const Assembler&, VectorX& force) const {
  const Loads& loads = problem.loads;
  Local local;
  for (std::size_t k = 0; k < loads.pieces.size(); ++k) {
    load_local(problem.model, *problem.start, data.z, data.configuration, loads.pieces[k],
               value_of(*problem.parameters, data.custom, loads.pieces[k]), local);
    const ElementTable& table = tables_[k];
    const int* dofs = table.dofs(0);
    for (int i = 0; i < table.width(); ++i)
      if (dofs[i] >= 0) force[dofs[i]] -= local.gradient[i];
  }
}

}  // namespace withe
