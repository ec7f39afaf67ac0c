#include "elasticity/elements.hpp"

#include <algorithm>

#include "elasticity/half_stencil.hpp"
#include "elasticity/put_local.hpp"

namespace withe {
namespace {

BendTwistStrain<double> strain_row(const Columns3& m, Eigen::Index i) { return {m(i, 0), m(i, 1), m(i, 2)}; }
BendTwistStrain<double> natural_of(const TurnCoefficients& k) { return {k.natural.x, k.natural.y, k.natural.z}; }
BendTwistStiffness<double> stiffness_of(const TurnCoefficients& k) {
  return {k.stiffness.x, k.stiffness.y, k.stiffness.z};
}

/// Rows (kappa1, kappa2, tau) become strains; in a plane the other columns are zero.
void measure_rows(const BendMeasure& measure, Columns3& rows) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = measured(measure, rows.row(i));
}

BendTwistEnergy energy_of_row(const BendMeasure& measure, const Columns3& strain, const Columns3& natural,
                              const Columns3& stiffness, Eigen::Index i) {
  const double factor = bend_factor(measure, strain(i, 0) * strain(i, 0) + strain(i, 1) * strain(i, 1)).value;
  double energy[3];
  for (int k = 0; k < 3; ++k) {
    const double off = factor * strain(i, k) - natural(i, k);
    energy[k] = 0.5 * (stiffness(i, k) * (off * off));
  }
  return {energy[0] + energy[1], energy[2]};
}

/// Derivatives with respect to edges and thetas.
BendTwistDerivatives<double> bend_twist(const BendMeasure& measure, const EdgeFrame<double>& f0,
                                        const EdgeFrame<double>& f1, const BendTwistStrain<double>& strain,
                                        const BendTwistStrain<double>& natural,
                                        const BendTwistStiffness<double>& stiffness, bool with_hessian) {
  BendTwistDerivatives<double> d;
  if (with_hessian) {
    bend_twist_hessian(measure, f0, f1, strain, natural, stiffness, d);
    apply_transport(f0, f1, d);
  } else {
    bend_twist_gradient(measure, f0, f1, strain, natural, stiffness, d);
    apply_transport_gradient(f0, f1, d);
  }
  return d;
}

void put(Local& out, int at, const Vec3d& v) {
  out.gradient[at] = v.x;
  out.gradient[at + 1] = v.y;
  out.gradient[at + 2] = v.z;
}

void bend_planar_local(const TurnCoefficients& k, const Configuration& c, const BendStencil& s, Eigen::Index i,
                       bool with_hessian, Local& out) {
  const PlanarBend<double> p = planar_bend(k.measure, c.bend_strain(i, 0), k.natural.x, k.stiffness.x);
  const PlanarEdge<double> edge[2] = {planar_edge(c.edge[static_cast<std::size_t>(s.edge[0])], s.sign[0]),
                                      planar_edge(c.edge[static_cast<std::size_t>(s.edge[1])], s.sign[1])};
  PlanarForces<double> f;
  planar_bend_forces<true>(p, edge, f);
  out.energy = p.energy;
  put_planar_bend(f, with_hessian, out);
}

/// The attached end is an edge of unit length, whose angle is the frame's.
void half_planar_local(const TurnCoefficients& k, const Configuration& c, const FrameStencil& s, Eigen::Index i,
                       bool with_hessian, Local& out) {
  const PlanarBend<double> p = planar_bend(k.measure, c.half_strain(i, 0), k.natural.x, k.stiffness.x);
  const int a = s.frame_first ? 0 : 1, b = 1 - a;  // slots of the frame and of the edge
  PlanarEdge<double> edge[2];
  edge[a] = planar_edge(c.attached[static_cast<std::size_t>(i)]);
  edge[b] = planar_edge(c.edge[static_cast<std::size_t>(s.edge)]);
  PlanarForces<double> f;
  planar_bend_forces<true>(p, edge, f);
  const Vec2<double> turn = turned(edge[a].tangent), coupling = f.by[b][a] * turn;
  out.energy = p.energy;
  put_planar_half({f.force[b], dot(turn, f.force[a]), f.by[b][b], coupling, coupling, p.curvature}, with_hessian, out);
}

/// The energy k (s - s0)^2 / 2 of unit stiffness and of a natural strain of s - 1 has the gradient of the strain s.
template <class Evaluate>
void set_gradients(const BendMeasure& measure, const Vector3& strain, int width, const Evaluate& evaluate,
                   StrainGradients& out) {
  Local local;
  for (int s = 0; s < out.count; ++s) {
    out.strain[s] = strain(s);
    TurnCoefficients unit{measure, {}, {}};
    (s == 0 ? unit.stiffness.x : s == 1 ? unit.stiffness.y : unit.stiffness.z) = 1.0;
    (s == 0 ? unit.natural.x : s == 1 ? unit.natural.y : unit.natural.z) = strain(s) - 1.0;
    evaluate(unit, local);
    std::copy_n(local.gradient, width, out.gradient[s]);
  }
}

}  // namespace

void set_elastic(const Parameters& p, ElasticCoefficients& out) {
  out.measure = p.measure;
  out.stretch_stiffness = p.edge_stretch;
  out.bend_stiffness = p.bend_stiffness;
  out.half_stiffness = p.half_stiffness;
  out.joint_stiffness = p.joint_stiffness;
  out.joint_natural = p.joint_rest_angle;
  set_natural(p, out);
}

void set_natural(const Parameters& p, ElasticCoefficients& out) {
  out.stretch_natural = p.edge_natural_stretch.array() - 1.0;
  out.bend_natural = p.bend_natural;
  out.half_natural = p.half_natural;
}

void set_viscous(const Model& model, const Parameters& p, const Configuration& start, double h,
                 ElasticCoefficients& out) {
  out.measure = p.measure;
  out.stretch_stiffness = p.edge_stretch.cwiseProduct(p.edge_viscous_time) / h;
  out.stretch_natural = start.length.cwiseQuotient(model.edge_length).array() - 1.0;
  out.bend_stiffness = (p.bend_viscous_time / h).asDiagonal() * p.bend_stiffness;
  out.bend_natural = start.bend_strain;
  measure_rows(p.measure, out.bend_natural);
  out.half_stiffness = (p.half_viscous_time / h).asDiagonal() * p.half_stiffness;
  out.half_natural = start.half_strain;
  measure_rows(p.measure, out.half_natural);
}

void refer_viscous_to_ends(const Model& model, const Configuration& start, const Configuration& middle,
                           const Configuration& end, ElasticCoefficients& out) {
  for (int e = 0; e < model.edge_count; ++e)
    out.stretch_natural(e) = (middle.length(e) - 0.5 * (end.length(e) - start.length(e))) / model.edge_length(e) - 1.0;
  const auto refer = [&](const Columns3& s0, const Columns3& s, const Columns3& s1, Columns3& natural) {
    const auto at = [&](const Columns3& strain, Eigen::Index i) { return measured(out.measure, strain.row(i)).eval(); };
    for (Eigen::Index i = 0; i < natural.rows(); ++i) natural.row(i) = at(s, i) - 0.5 * (at(s1, i) - at(s0, i));
  };
  refer(start.bend_strain, middle.bend_strain, end.bend_strain, out.bend_natural);
  refer(start.half_strain, middle.half_strain, end.half_strain, out.half_natural);
}

void add_coefficients(const ElasticCoefficients& other, ElasticCoefficients& sum) {
  const auto combine = [](auto& k, auto& n, const auto& k2, const auto& n2) {
    for (Eigen::Index i = 0; i < k.size(); ++i) {
      const double total = k.data()[i] + k2.data()[i];
      if (total == 0.0) continue;
      n.data()[i] = (k.data()[i] * n.data()[i] + k2.data()[i] * n2.data()[i]) / total;
      k.data()[i] = total;
    }
  };
  combine(sum.stretch_stiffness, sum.stretch_natural, other.stretch_stiffness, other.stretch_natural);
  combine(sum.bend_stiffness, sum.bend_natural, other.bend_stiffness, other.bend_natural);
  combine(sum.half_stiffness, sum.half_natural, other.half_stiffness, other.half_natural);
}

double stretch_energy_of(const Model& model, const ElasticCoefficients& k, const Configuration& c, int edge) {
  const double rest = model.edge_length(edge), natural = 1.0 + k.stretch_natural(edge);
  const double strain = c.length(edge) / rest - natural;
  return 0.5 * k.stretch_stiffness(edge) * strain * strain * rest;
}

BendTwistEnergy bend_energy_of(const ElasticCoefficients& k, const Configuration& c, int stencil) {
  return energy_of_row(k.measure, c.bend_strain, k.bend_natural, k.bend_stiffness, stencil);
}

BendTwistEnergy half_energy_of(const ElasticCoefficients& k, const Configuration& c, int stencil) {
  return energy_of_row(k.measure, c.half_strain, k.half_natural, k.half_stiffness, stencil);
}

double natural_change_energy(const Model& model, const ElasticCoefficients& k, const Parameters& now,
                             const Configuration& c) {
  double energy = 0.0;
  const auto add = [&](double stiffness, double before, double after, double strain) {
    energy += stiffness * (after - before) * (0.5 * (before + after) - strain);
  };
  for (int i = 0; i < model.edge_count; ++i) {
    const double rest = model.edge_length(i), after = now.edge_natural_stretch(i) - 1.0;
    if (after != k.stretch_natural(i))
      add(k.stretch_stiffness(i) * rest, k.stretch_natural(i), after, c.length(i) / rest - 1.0);
  }
  const auto add_rows = [&](const auto& stiffness, const Columns3& before, const auto& after, const Columns3& strain) {
    for (Eigen::Index i = 0; i < strain.rows(); ++i) {
      if (before.row(i) == after.row(i)) continue;
      const Vector3 s = measured(k.measure, strain.row(i));
      for (int j = 0; j < 3; ++j) add(stiffness(i, j), before(i, j), after(i, j), s(j));
    }
  };
  add_rows(k.bend_stiffness, k.bend_natural, now.bend_natural, c.bend_strain);
  add_rows(k.half_stiffness, k.half_natural, now.half_natural, c.half_strain);
  return energy;
}

void stretch_local(const Model& model, const ElasticCoefficients& k, const Configuration& c, int edge,
                   bool with_hessian, const double* given_force, Local& out) {
  const EdgeFrame<double>& f = c.edge[static_cast<std::size_t>(edge)];
  const double EA = k.stretch_stiffness(edge), rest = model.edge_length(edge);
  const double force = axial_force(c.length(edge), rest, EA, k.stretch_natural(edge));
  out.energy = stretch_energy_of(model, k, c, edge);
  put_stretch(model.dimension, f.tangent, f.tangent, force, EA / rest,
              (given_force ? given_force[edge] : force) * f.inverse_length, with_hessian, out);
}

void bend_local(const Model& model, const TurnCoefficients& k, const Configuration& c, int stencil, bool with_hessian,
                Local& out) {
  const BendStencil& s = model.bend[static_cast<std::size_t>(stencil)];
  const auto i = static_cast<Eigen::Index>(stencil);
  if (model.planar()) return bend_planar_local(k, c, s, i, with_hessian, out);
  const EdgeFrame<double> f0 = oriented(c.edge[static_cast<std::size_t>(s.edge[0])], s.sign[0]);
  const EdgeFrame<double> f1 = oriented(c.edge[static_cast<std::size_t>(s.edge[1])], s.sign[1]);
  BendTwistDerivatives<double> d =
      bend_twist(k.measure, f0, f1, strain_row(c.bend_strain, i), natural_of(k), stiffness_of(k), with_hessian);
  out.energy = d.energy;
  // Edges against their rod: their angles count the other way.
  for (int j = 0; j < 2; ++j) {
    if (s.sign[j] > 0) continue;
    d.gradient_angle[j] = -d.gradient_angle[j];
    for (Vec3d* column : {&d.e_angle[0][j], &d.e_angle[1][j]}) *column = -*column;
    d.angle_angle[0][1] = -d.angle_angle[0][1];
  }
  put(out, 0, -d.gradient_e[0]);
  put(out, 4, d.gradient_e[0] - d.gradient_e[1]);
  put(out, 8, d.gradient_e[1]);
  out.gradient[3] = d.gradient_angle[0];
  out.gradient[7] = d.gradient_angle[1];
  if (with_hessian) put_bend_twist_matrix(d, out.hessian);
}

void half_local(const Model& model, const VectorX& q, const TurnCoefficients& k, const Configuration& c, int stencil,
                bool with_hessian, Local& out) {
  const FrameStencil& s = model.half[static_cast<std::size_t>(stencil)];
  const auto i = static_cast<Eigen::Index>(stencil);
  if (model.planar()) return half_planar_local(k, c, s, i, with_hessian, out);
  const EdgeFrame<double>& edge = c.edge[static_cast<std::size_t>(s.edge)];
  const EdgeFrame<double>& attached = c.attached[static_cast<std::size_t>(stencil)];
  const EdgeFrame<double>&f0 = s.frame_first ? attached : edge, &f1 = s.frame_first ? edge : attached;
  const BendTwistDerivatives<double> d =
      bend_twist(k.measure, f0, f1, strain_row(c.half_strain, i), natural_of(k), stiffness_of(k), with_hessian);
  AttachedEnd<double> end{s.frame_first ? 0 : 1,
                          attached.tangent,
                          to_vec3(q.segment<3>(model.frame_dof[static_cast<std::size_t>(s.frame)])),
                          {}};
  if (s.hinge >= 0)
    end.axis =
        to_vec3(c.frame[static_cast<std::size_t>(s.frame)] * model.hinges[static_cast<std::size_t>(s.hinge)].axis);
  out.energy = d.energy;
  put_half_gradient(d, end, out.gradient);
  if (with_hessian) put_half_matrix(d, end, out.hessian);
}

void stretch_gradients(const Model& model, const Configuration& c, int edge, StrainGradients& out) {
  const Vec3d& t = c.edge[static_cast<std::size_t>(edge)].tangent;
  const double inverse = 1.0 / model.edge_length(edge);
  out.count = 1;
  out.strain[0] = c.length(edge) * inverse - 1.0;
  for (int i = 0; i < model.dimension; ++i) {
    out.gradient[0][i] = -inverse * t[i];
    out.gradient[0][model.dimension + i] = inverse * t[i];
  }
}

void bend_gradients(const Model& model, const BendMeasure& measure, const Configuration& c, int stencil,
                    StrainGradients& out) {
  out.count = model.planar() ? 1 : 3;
  set_gradients(
      measure, measured(measure, c.bend_strain.row(stencil)), model.planar() ? 6 : 11,
      [&](const TurnCoefficients& k, Local& local) { bend_local(model, k, c, stencil, false, local); }, out);
}

void half_gradients(const Model& model, const VectorX& q, const BendMeasure& measure, const Configuration& c,
                    int stencil, StrainGradients& out) {
  out.count = model.planar() ? 1 : 3;
  set_gradients(
      measure, measured(measure, c.half_strain.row(stencil)), model.planar() ? 5 : 11,
      [&](const TurnCoefficients& k, Local& local) { half_local(model, q, k, c, stencil, false, local); }, out);
}

}  // namespace withe
