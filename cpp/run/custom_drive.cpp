#include "run/custom_drive.hpp"

#include <string>
#include <utility>

#include "common/check.hpp"
#include "model/edge_vectors.hpp"

namespace withe {
namespace {

void check_custom_forces(const Model& model, const CustomForces& now) {
  const SceneDescription& description = model.description;
  const auto check = [&](const MatrixX3& table, const std::string& what) {
    require(table.rows() == model.node_count, what + " must have one row a node, " + std::to_string(model.node_count) +
                                                  ", got " + std::to_string(table.rows()));
    require(table.allFinite(), what + " must be finite");
  };
  check(now.forces, "custom force");
  if (description.custom_moments) check(now.moments, "custom moment");
  if (model.planar()) {
    const Vector3& n = model.plane->normal;
    const double off = description.custom_moments ? (now.moments - now.moments * n * n.transpose()).norm() : 0.0;
    require((now.forces * n).norm() <= 1e-8 * now.forces.norm() && off <= 1e-8 * now.moments.norm(),
            "a custom force leaves the plane of the scene: build the scene with "
            "planar=False");
  }
  const Eigen::Index columns = 3 * model.node_count, rows = (description.custom_moments ? 2 : 1) * columns;
  for (const SparseMatrix* m : {&now.by_position, &now.by_velocity})
    require(m->size() == 0 || (m->rows() == rows && m->cols() == columns), "derivatives of a custom force must have " +
                                                                               std::to_string(rows) + " rows and " +
                                                                               std::to_string(columns) + " columns");
}

}  // namespace

CustomForces CustomDrive::evaluate(double time, const VectorX& q, const VectorX& v, bool derivatives) const {
  MatrixX3 positions(model_->node_count, 3), velocities(model_->node_count, 3);
  for (int i = 0; i < model_->node_count; ++i) {
    positions.row(i) = node_position(*model_, q, i);
    velocities.row(i) = node_vector(*model_, v, i);
  }
  CustomForces now = (*function_)(time, positions, velocities, derivatives);
  check_custom_forces(*model_, now);
  return now;
}

void CustomDrive::note(const CustomForces& now) const {
  found_->custom_force = now.forces;
  if (model_->description.custom_moments) found_->custom_moments = now.moments;
}

Prescribed CustomDrive::at_rest() const {
  Prescribed out;
  put(out);
  return out;
}

void CustomDrive::put(Prescribed& out) const {
  if (model_->description.has_custom_force)
    out.custom = applied_forces(*model_, found_->custom_force, found_->custom_moments);
}

void CustomDrive::put_response(double time, Prescribed& out) const {
  out.respond = [self = *this, time](const VectorX& q, const VectorX& v, bool derivatives) {
    CustomForces now = self.evaluate(time, q, v, derivatives);
    self.note(now);
    return now;
  };
}

CustomResponse CustomDrive::response_at_rest(double time) const {
  if (!has_function()) return nullptr;
  return [self = *this, time](const VectorX& q, const VectorX& v, bool derivatives) {
    CustomForces now = self.evaluate(time, q, VectorX::Zero(v.size()), derivatives);
    now.by_velocity.resize(0, 0);
    return now;
  };
}

void CustomDrive::put_response_at_rest(double time, Prescribed& out) const {
  put(out);
  CustomResponse at_rest = response_at_rest(time);
  if (!at_rest) return;
  out.respond = [self = *this, at_rest = std::move(at_rest)](const VectorX& q, const VectorX& v, bool derivatives) {
    CustomForces now = at_rest(q, v, derivatives);
    self.note(now);
    return now;
  };
}

}  // namespace withe
