#include "elasticity/elements.hpp"

#include <algorithm>

#include "elasticity/bend_twist.hpp"
#include "elasticity/put_local.hpp"
#include "geometry/rotation.hpp"

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
Matrix3 dense(const Mat3<double>& a) {
  Matrix3 m;
  for (int i = 0; i < 3; ++i) m.row(i) << a.row[i].x, a.row[i].y, a.row[i].z;
  return m;
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

/// Second derivatives by the spin of the frame that is in slot `a` of a half stencil: with itself, with the vector of
/// the edge in the other slot, and with that one's angle. A spin eta moves the frame's unit tangent T by eta x T and
/// its directors by T . eta.
struct SpinHessian {
  Matrix3 spin, edge;
  Vector3 angle;
};
SpinHessian spin_hessian(const BendTwistDerivatives<double>& d, int a, const Vector3& T) {
  const int b = 1 - a;
  const Vector3 ge = to_eigen(d.gradient_e[a]);
  const Matrix3 X = cross_matrix(T);  // X^T-side of eta -> eta x T
  const Matrix3 Haa = dense(d.ee[a][a]);
  const Matrix3 Hab = a == 0 ? dense(d.ee[0][1]) : Matrix3(dense(d.ee[0][1]).transpose());  // frame edge, real edge
  const Vector3 haa = to_eigen(d.e_angle[a][a]);                                            // frame edge, frame angle
  const Vector3 hab = to_eigen(d.e_angle[a][b]);                                            // frame edge, edge's angle
  const Vector3 hba = to_eigen(d.e_angle[b][a]);                                            // real edge, frame angle
  Matrix3 S = X * Haa * X.transpose() + d.angle_angle[a][a] * T * T.transpose();
  const Vector3 Xh = X * haa;
  S += Xh * T.transpose() + T * Xh.transpose() + 0.5 * (ge * T.transpose() + T * ge.transpose());
  S.diagonal().array() -= ge.dot(T);
  return {S, X * Hab + T * hba.transpose(), X * hab + d.angle_angle[0][1] * T};
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
  out.stretch_natural.setZero(p.edge_stretch.size());
  out.bend_stiffness = p.bend_stiffness;
  out.half_stiffness = p.half_stiffness;
  set_natural(p, out);
}

void set_natural(const Parameters& p, ElasticCoefficients& out) {
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
  const EdgeFrame<double>& end = c.attached[static_cast<std::size_t>(stencil)];
  const EdgeFrame<double>&f0 = s.frame_first ? end : edge, &f1 = s.frame_first ? edge : end;
  const int a = s.frame_first ? 0 : 1, b = 1 - a;  // slots of the frame and of the edge
  const BendTwistDerivatives<double> d =
      bend_twist(k.measure, f0, f1, strain_row(c.half_strain, i), natural_of(k), stiffness_of(k), with_hessian);
  out.energy = d.energy;
  put(out, 0, -d.gradient_e[b]);
  out.gradient[3] = d.gradient_angle[b];
  put(out, 4, d.gradient_e[b]);

  const Vector3 T = to_eigen(end.tangent), ge = to_eigen(d.gradient_e[a]);
  const Vector3 moment = T.cross(ge) + d.gradient_angle[a] * T;
  const auto frame_dof = model.frame_dof[static_cast<std::size_t>(s.frame)];
  const Vector3 w = q.segment<3>(frame_dof);
  const Matrix3 J = cayley_spin(w);
  Eigen::Map<Vector3>(out.gradient + 7) = J.transpose() * moment;
  Vector3 axis = Vector3::Zero();
  if (s.hinge >= 0)
    axis = c.frame[static_cast<std::size_t>(s.frame)] * model.hinges[static_cast<std::size_t>(s.hinge)].axis;
  out.gradient[10] = axis.dot(moment);
  if (!with_hessian) return;

  const auto [S, Se, Sangle] = spin_hessian(d, a, T);
  const Vector3 u = moment - 0.5 * w.cross(moment);
  const double cay = 1.0 / (1.0 + 0.25 * w.squaredNorm());
  const Matrix3 Hww = J.transpose() * S * J - (0.25 * cay * cay) * (u * w.transpose() + w * u.transpose());
  const Matrix3 Hwe = J.transpose() * Se;
  const Vector3 Hwangle = J.transpose() * Sangle;
  const Matrix3 E = dense(d.ee[b][b]);
  const Vector3 hbb = to_eigen(d.e_angle[b][b]);
  for (int r = 0; r < 3; ++r) {
    for (int col = 0; col < 3; ++col) {
      out.hessian[r][col] = out.hessian[4 + r][4 + col] = E(r, col);
      out.hessian[r][4 + col] = out.hessian[4 + r][col] = -E(r, col);
      out.hessian[7 + r][7 + col] = Hww(r, col);
      out.hessian[7 + r][col] = out.hessian[col][7 + r] = -Hwe(r, col);
      out.hessian[7 + r][4 + col] = out.hessian[4 + col][7 + r] = Hwe(r, col);
    }
    out.hessian[r][3] = out.hessian[3][r] = -hbb(r);
    out.hessian[4 + r][3] = out.hessian[3][4 + r] = hbb(r);
    out.hessian[7 + r][3] = out.hessian[3][7 + r] = Hwangle(r);
  }
  out.hessian[3][3] = d.angle_angle[b][b];
  // A hinge turns the attached end about `axis`, after the frame.
  const Vector3 Hw_hinge = J.transpose() * (S * axis + 0.5 * axis.cross(moment));
  const Vector3 He_hinge = Se.transpose() * axis;
  for (int r = 0; r < 3; ++r) {
    out.hessian[7 + r][10] = out.hessian[10][7 + r] = Hw_hinge(r);
    out.hessian[r][10] = out.hessian[10][r] = -He_hinge(r);
    out.hessian[4 + r][10] = out.hessian[10][4 + r] = He_hinge(r);
  }
  out.hessian[3][10] = out.hessian[10][3] = Sangle.dot(axis);
  out.hessian[10][10] = axis.dot(S * axis);
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
