#pragma once
/// Data for derivatives of elastic forces: ordinary stencils for the kernels, and places of angles.

#include "elasticity/stencil_kernels.hpp"
#include "geometry/rotation.hpp"
#include "steps/elastic_forces.hpp"

namespace withe {

/// Places of angles among a stencil's unknowns, and their edges.
struct Angles {
  int count = 0, place[2] = {}, edge[2] = {};
};
inline Angles bend_angles(const Model& model, int b) {
  return model.planar() ? Angles{} : Angles{2, {3, 7}, {model.bend[at(b)].edge[0], model.bend[at(b)].edge[1]}};
}
inline Angles half_angles(const Model& model, int h) {
  return model.planar() ? Angles{} : Angles{1, {3, 0}, {model.half[at(h)].edge, 0}};
}

/// Matrix that maps a rotation of a half stencil's attached part, as a rotation vector in the axes of the drawn scene,
/// to the axes of a configuration with unknowns q. It includes the rotation of the frame and of its hinge.
inline Matrix3 attached_axes(const Model& model, const Configuration& c, const VectorX& q, int h) {
  if (model.planar()) return Matrix3::Identity();
  const FrameStencil& half = model.half[at(h)];
  return c.frame[at(half.frame)] * hinge_turn(model, q, half.hinge);
}

/// Strains f (kappa1, kappa2, tau) of all stencils.
inline Columns3 measured_strains(const BendMeasure& measure, const Configuration& c) {
  Columns3 out = c.bend_strain;
  for (Eigen::Index i = 0; i < out.rows(); ++i) out.row(i) = measured(measure, c.bend_strain.row(i));
  return out;
}

/// Null where no configuration has been found: that at the end of a step, under rules that do not need it.
inline const double* frames_of(const Configuration& c) { return c.edge.empty() ? nullptr : &c.edge.data()->tangent.x; }

/// The stencils that kernels take, in a configuration; no forces, no matrix.
inline StencilBatch kernel_batch(const Assembler& assembler, const BendMeasure& measure, const Configuration& c,
                                 const Columns3& natural, const Columns3& stiffness) {
  const RegularStencils& regular = assembler.regular;
  return {.count = static_cast<int>(regular.stencil.size()),
          .stencil = regular.stencil.data(),
          .first_unknown = regular.first_unknown.data(),
          .edges = regular.edges.data(),
          .owned = regular.owned.data(),
          .lines = nullptr,
          .lower = false,
          .by_rows = true,
          .measure = measure,
          .frames = frames_of(c),
          .strain = c.bend_strain.data(),
          .natural = natural.data(),
          .stiffness = stiffness.data(),
          .column = c.bend_strain.rows(),
          .force = nullptr,
          .geometric = nullptr,
          .modulus = nullptr,
          .residual = nullptr,
          .magnitude = nullptr,
          .values = nullptr,
          .velocity = nullptr,
          .edge_inertia = nullptr};
}

}  // namespace withe
