// What rounding leaves of a residual, which no iteration removes: positions, angles and strains carry errors of a few
// eps, and stiffness, or inertia over a short step, turns them into forces.

#include <cmath>
#include <initializer_list>
#include <limits>

#include "integrators/equations.hpp"

namespace withe {
namespace {

constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();  // of a number that some operations lead to

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

/// What rounding leaves of inertia. What spins for long has turned by many radians. Sets the greatest coordinate, and
/// returns the greatest angle, one radian at least.
double Equations::set_inertial_floor(const VectorX& z, VectorX& floor) {
  const auto of_node = [&](int node) { return floor.segment(model_.node_dof[at(node)], model_.dimension).array(); };
  floor = z.cwiseAbs();
  reach_ = 0.0;
  for (int i = 0; i < model_.node_count; ++i) {
    reach_ = std::max(reach_, of_node(i).maxCoeff());
    of_node(i) = 0.0;
  }
  const double turned = std::max(1.0, floor.maxCoeff());
  floor.setConstant(turned);
  for (int i = 0; i < model_.node_count; ++i) of_node(i) = std::max(reach_, 1e-300);
  const double rounding = h_ != 0.0 ? kRounding / (h_ * h_) : 0.0;
  floor.array() *= rounding * mass_.rows.array();
  if (h_ == 0.0 || model_.planar()) return turned;
  for (int e = 0; e < model_.edge_count; ++e) {
    // add_spin_couple: `spin` of the torque, and no more than twice that of the couple.
    const Vec3d& spin = middle_.edge[at(e)].spin;
    const double couple = 3.0 * rounding * turned * parameters_->edge_inertia[e] * std::sqrt(dot(spin, spin));
    of_node(model_.edge_tail[at(e)]) += couple;
    of_node(model_.edge_head[at(e)]) += couple;
  }
  return turned;
}

/// Rounding of a strain is about eps (|x| / l + |theta|); its stiffness turns it into a force that no iteration
/// removes. Curvature, 2 tan(phi / 2), grows by 2 / (1 + cos phi) a radian, and so does its slope.
void Equations::set_floor(const VectorX& z, VectorX& floor) {
  const double turned = set_inertial_floor(z, floor);
  rounding_ = kRounding * (reach_ / model_.edge_length.minCoeff() + turned);
  axial_floor_.resize(model_.edge_count);
  for (int e = 0; e < model_.edge_count; ++e)
    axial_floor_(e) = kRounding * acting_->stretch_stiffness(e) * (reach_ / model_.edge_length(e) + 1.0);
  const auto moment_of = [&](double stiffness, double length, const Vec3d& before, const Vec3d& after) {
    const double grown = 2.0 / (1.0 + dot(before, after));
    return 2.0 * kRounding * stiffness * (reach_ / length + turned) * grown * grown;
  };
  const auto bend_add = [&](double moment, double length, std::initializer_list<int> nodes,
                            std::initializer_list<int> angles) {
    for (int node : nodes) floor.segment(model_.node_dof[at(node)], model_.dimension).array() += moment / length;
    if (!model_.planar())
      for (int edge : angles) floor(model_.edge_dof[at(edge)]) += moment;
  };
  for (std::size_t b = 0; b < model_.bend.size(); ++b) {
    const BendStencil& s = model_.bend[b];
    const auto i = static_cast<Eigen::Index>(b);
    const double length = std::min(model_.edge_length(s.edge[0]), model_.edge_length(s.edge[1]));
    const Vec3d before = static_cast<double>(s.sign[0] * s.sign[1]) * middle_.edge[at(s.edge[0])].tangent;
    const double stiffness = acting_->bend_stiffness.row(i).maxCoeff();
    bend_add(moment_of(stiffness, length, before, middle_.edge[at(s.edge[1])].tangent), length,
             {s.node[0], s.node[1], s.node[2]}, {s.edge[0], s.edge[1]});
  }
  for (std::size_t h = 0; h < model_.half.size(); ++h) {
    const FrameStencil& s = model_.half[h];
    const double length = model_.edge_length(s.edge);
    const double moment = moment_of(acting_->half_stiffness.row(static_cast<Eigen::Index>(h)).maxCoeff(), length,
                                    middle_.attached[h].tangent, middle_.edge[at(s.edge)].tangent);
    bend_add(moment, length, {model_.edge_tail[at(s.edge)], model_.edge_head[at(s.edge)]}, {s.edge});
    for (int i = 0; i < model_.frame_size(); ++i) floor(model_.frame_dof[at(s.frame)] + i) += moment;
    if (s.hinge >= 0) floor(model_.hinges[at(s.hinge)].dof) += moment;
  }
}

}  // namespace withe
