// Forces of the energy-momentum scheme: see equations.hpp.

#include <cmath>

#include "elasticity/bend_planar.hpp"
#include "integrators/equations.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Vector2 along(const EdgeFrame<double>& f, double sign) { return {sign * f.tangent.x, sign * f.tangent.y}; }
Vector2 across(const Vector2& v) { return {-v.y(), v.x()}; }

/// (sin x) / x, and its derivative over x.
struct Sinc {
  double value, slope;
};
Sinc sinc(double x) {
  const double square = x * x;
  if (square < 1e-6) return {1.0 - square / 6.0, -1.0 / 3.0 + square / 30.0};
  const double value = std::sin(x) / x;
  return {value, (std::cos(x) - value) / square};
}

/// How an edge in a plane turns in a step from a to b = 2 m - a; derivatives by m.
struct TurningEdge {
  Vector2 normal;           ///< gradient of its angle at m
  Vector2 by_psi;           ///< of psi
  Eigen::Matrix2d hessian;  ///< of its angle at m
  double psi;               ///< the angle by which it turns [rad]
  double part;              ///< normal . (b - a): 2 tan(psi / 2) where it keeps its length
  Vector2 by_part;          ///< of part
  double share;             ///< psi / part
  Vector2 by_share;         ///< of share
  double stretch;           ///< |b| / |a| - 1
  Vector2 by_stretch;       ///< of stretch
};

TurningEdge turning_edge(const EdgeFrame<double>& start, const EdgeFrame<double>& middle, const EdgeFrame<double>& end,
                         double sign, const Vector2& change) {
  const Vector2 a = along(start, sign), m = along(middle, sign), b = along(end, sign);
  const double inverse = middle.inverse_length;
  TurningEdge e;
  e.normal = inverse * across(m);
  e.by_psi = 2.0 * end.inverse_length * across(b);
  e.hessian = -inverse * (m * e.normal.transpose() + e.normal * m.transpose());
  e.psi = std::atan2(across(a).dot(b), a.dot(b));
  e.part = e.normal.dot(change);
  e.by_part = 2.0 * e.normal + e.hessian * change;
  // part = |a| |b| sin(psi) / |m|^2.
  const Sinc s = sinc(e.psi);
  e.share = start.inverse_length * end.inverse_length / (inverse * inverse * s.value);
  e.by_share = e.share * (2.0 * inverse * m - 2.0 * end.inverse_length * b - (s.slope * e.psi / s.value) * e.by_psi);
  e.stretch = start.inverse_length / end.inverse_length - 1.0;
  e.by_stretch = 2.0 * start.inverse_length * b;
  return e;
}

/// 1 / T, but where T is no more than what edges turn by times what they stretch by: there T may vanish before phi is
/// what it was, and the quotient goes smoothly to zero.
struct Quotient {
  double value, by_T, by_width;
  double turn, stretch;  ///< sums of squares; `reach` times their product is the square of that width
};

Quotient quotient(double T, const TurningEdge& a, const TurningEdge& b, double reach) {
  constexpr double kLeastWidth = 1e-16;
  Quotient q;
  q.turn = a.part * a.part + b.part * b.part;
  q.stretch = a.stretch * a.stretch + b.stretch * b.stretch;
  const double width = reach * q.turn * q.stretch + kLeastWidth, ratio = T * T / width;
  const bool outside = ratio >= 1.0;
  q.value = outside ? 1.0 / T : T * (2.0 - ratio) / width;
  q.by_T = outside ? -1.0 / (T * T) : (2.0 - 3.0 * ratio) / width;
  q.by_width = outside ? 0.0 : -2.0 * T * (1.0 - ratio) / (width * width);
  return q;
}

/// (beta1 - beta0) / (phi1 - phi0) without a difference, and its derivative by phi1.
struct DividedStrain {
  double value, by_end;
};
DividedStrain divided_strain(const BendMeasure& measure, double kappa0, double kappa1, const PlanarStrain<double>& end,
                             double turn) {
  const double a = measure.a, b = measure.b, x0 = kappa0 * kappa0, x1 = kappa1 * kappa1, both = kappa0 * kappa1;
  const double factor = (1.0 + a * (x0 + both + x1) - b * both + a * b * x0 * x1) / ((1.0 + b * x0) * (1.0 + b * x1));
  const double value = sinc(0.5 * turn).value * std::sqrt((1.0 + 0.25 * x0) * (1.0 + 0.25 * x1)) * factor;
  return {value, std::abs(turn) < 1e-5 ? 0.5 * end.second : (end.first - value) / turn};
}

}  // namespace

/// Gonzalez's correction with u = G D: adds r u / (u . D) to the gradient and its derivative with
/// respect to z to the Hessian.
void Equations::correct(Local& local, const Local& end, double start_energy, double stiffness,
                        const ElementTable& table, int element, const Metric& metric, bool with_matrix) {
  const int n = table.width();
  double D[kMaxLocal]{}, u[kMaxLocal]{};
  gather_difference(table, element, D);
  for (int i = 0; i < n; ++i) u[i] = metric.own[i] * D[i];
  for (const Metric::Pair& pair : metric.pairs)
    for (int i = 0; i < pair.size; ++i) {
      const double pull = pair.weight * (D[pair.a + i] - D[pair.b + i]);
      u[pair.a + i] += pull;
      u[pair.b + i] -= pull;
    }
  double s = 0.0, r = end.energy - start_energy;
  for (int i = 0; i < n; ++i) {
    s += u[i] * D[i];
    r -= local.gradient[i] * D[i];
  }
  if (!(s > 1e-24)) return;
  const double inverse = 1.0 / s;
  if (with_matrix) add_correction_hessian(local, end, metric, D, u, n, inverse, 2.0 * r * inverse);
  for (int i = 0; i < n; ++i) local.gradient[i] += r * inverse * u[i];
  // A strain rounds as positions do, and its moment sqrt(2 K E) makes it an energy: the rounding of r.
  const double energy = std::max(end.energy, start_energy);
  add_correction_floor(table.dofs(element), u, n, rounding_ * (std::sqrt(2.0 * stiffness * energy) + energy) / s);
}

/// How Gonzalez's correction changes with z, from what the Hessian and the gradients are without it.
void Equations::add_correction_hessian(Local& local, const Local& end, const Metric& metric, const double* D,
                                       const double* u, int n, double inverse, double weight) {
  double change[kMaxLocal];
  for (int i = 0; i < n; ++i) {
    double HD = 0.0;
    for (int j = 0; j < n; ++j) HD += local.hessian[i][j] * D[j];
    change[i] = inverse * (2.0 * (end.gradient[i] - local.gradient[i]) - HD - 2.0 * weight * u[i]);
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) local.hessian[i][j] += u[i] * change[j];
    local.hessian[i][i] += weight * metric.own[i];
  }
  for (const Metric::Pair& pair : metric.pairs)
    for (int i = 0; i < pair.size; ++i) {
      const int a = pair.a + i, b = pair.b + i;
      local.hessian[a][a] += weight * pair.weight;
      local.hessian[b][b] += weight * pair.weight;
      local.hessian[a][b] -= weight * pair.weight;
      local.hessian[b][a] -= weight * pair.weight;
    }
}

/// Where hardly anything moves, a quotient of differences makes their rounding a force that no iteration removes.
void Equations::add_correction_floor(const int* dofs, const double* u, int count, double rounding) {
  for (int i = 0; i < count; ++i)
    if (dofs[i] >= 0) correction_floor_[dofs[i]] += rounding * std::abs(u[i]);
}

/// Bending in a plane: moment x (beta1 - beta0) / (phi1 - phi0), moment K (b - n) with b the mean of both beta, times a
/// discrete gradient of phi = angle(e1) - angle(e0). psi / part of the gradient at the middle is one of an edge's
/// angle; it turns the stencil unless both edges have the same share. Forces that do no work take the difference of the
/// shares away, all of it but where T = part1 - part0 vanishes before phi is what it was, as edges also change their
/// lengths.
void Equations::add_planar_bend(int stencil, bool with_matrix, Local& local) {
  constexpr int n = 6;
  const BendStencil& s = model_.bend[at(stencil)];
  double D[kMaxLocal];
  gather_difference(assembler_.bend, stencil, D);
  TurningEdge edge[2];
  for (int k = 0; k < 2; ++k) {
    const auto e = at(s.edge[k]);
    edge[k] = turning_edge(start_.edge[e], middle_.edge[e], end_.edge[e], s.sign[k],
                           {D[2 * k + 2] - D[2 * k], D[2 * k + 3] - D[2 * k + 1]});
  }
  const double kappa0 = start_.bend_strain(stencil, 0), kappa1 = end_.bend_strain(stencil, 0);
  const PlanarStrain<double> start = planar_strain(elastic.measure, kappa0),
                             end = planar_strain(elastic.measure, kappa1);
  const DividedStrain slope = divided_strain(elastic.measure, kappa0, kappa1, end, edge[1].psi - edge[0].psi);
  const double stiffness = elastic.bend_stiffness(stencil, 0);
  const double moment = stiffness * (0.5 * (start.value + end.value) - elastic.bend_natural(stencil, 0));
  const double by_moment = 0.5 * stiffness * end.first;

  const double T = edge[1].part - edge[0].part, difference = edge[1].share - edge[0].share;
  const double reach = keep_momentum_ ? 0.1 : 25.0;  // wide windows are easy to solve in
  const Quotient w = quotient(T, edge[0], edge[1], reach);
  constexpr double kSign[2] = {-1.0, 1.0};  // phi is the second edge's angle less the first one's
  Eigen::Vector4d by_phi, by_w, by_difference, force;
  for (int k = 0; k < 2; ++k) {
    by_phi.segment<2>(2 * k) = kSign[k] * edge[k].by_psi;
    by_difference.segment<2>(2 * k) = kSign[k] * edge[k].by_share;
    by_w.segment<2>(2 * k) =
        (kSign[k] * w.by_T + w.by_width * 2.0 * reach * w.stretch * edge[k].part) * edge[k].by_part +
        (w.by_width * 2.0 * reach * w.turn * edge[k].stretch) * edge[k].by_stretch;
  }
  const double scale = moment * slope.value;
  const Eigen::Vector4d by_scale = (by_moment * slope.value + moment * slope.by_end) * by_phi;
  Eigen::Matrix4d H;
  for (int k = 0; k < 2; ++k) {
    const TurningEdge &own = edge[k], &other = edge[1 - k];
    const double share = own.share + difference * other.part * w.value;
    force.segment<2>(2 * k) = (kSign[k] * scale * share) * own.normal;
    if (!with_matrix) continue;
    Eigen::Vector4d by_share = other.part * (w.value * by_difference + difference * by_w);
    by_share.segment<2>(2 * k) += own.by_share;
    by_share.segment<2>(2 - 2 * k) += difference * w.value * other.by_part;
    H.middleRows<2>(2 * k) = kSign[k] * own.normal * (share * by_scale + scale * by_share).transpose();
    H.block<2, 2>(2 * k, 2 * k) += (kSign[k] * scale * share) * own.hessian;
  }
  constexpr double kRounding = 1e-15;  // of `difference`
  const double u[n] = {-force[0], -force[1], force[0] - force[2], force[1] - force[3], force[2], force[3]};
  add_correction_floor(assembler_.bend.dofs(stencil), u, n,
                       kRounding * std::abs(w.value) * (std::abs(edge[0].part) + std::abs(edge[1].part)));
  for (int i = 0; i < n; ++i) local.gradient[i] = u[i];
  if (!with_matrix) return;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) local.hessian[i][j] = 0.0;
  // From edges to nodes: rows and columns of an edge are those of its head less those of its tail.
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      local.hessian[i][j] += H(i, j);
      local.hessian[i + 2][j + 2] += H(i, j);
      local.hessian[i][j + 2] -= H(i, j);
      local.hessian[i + 2][j] -= H(i, j);
    }
}

void Equations::gather_difference(const ElementTable& table, int element, double* difference) const {
  const int* dofs = table.dofs(element);
  for (int i = 0; i < table.width(); ++i) difference[i] = dofs[i] < 0 ? 0.0 : difference_(dofs[i]);
}

/// Force of the mean strain, along the mean of the edge.
void Equations::mean_stretch_local(const VectorX& z, int edge, const double* axial_force, Local& local) const {
  const int dim = model_.dimension;
  const double force = force_[edge], geometric = axial_force ? axial_force[edge] : force;
  const int* dofs = assembler_.stretch.dofs(edge);
  double mean[3];
  for (int i = 0; i < dim; ++i) mean[i] = inverse_mean_[edge] * (z(dofs[dim + i]) - z(dofs[i]));
  const Vec3d& t1 = end_.edge[at(edge)].tangent;
  const double t[3] = {t1.x, t1.y, t1.z}, transverse = geometric * inverse_mean_[edge];
  for (int i = 0; i < dim; ++i) {
    local.gradient[i] = -force * mean[i];
    local.gradient[dim + i] = force * mean[i];
    for (int j = 0; j < dim; ++j) {
      const double h = mean[i] * t[j] * (modulus_[edge] - transverse) + (i == j ? transverse : 0.0);
      local.hessian[i][j] = local.hessian[dim + i][dim + j] = h;
      local.hessian[i][dim + j] = local.hessian[dim + i][j] = -h;
    }
  }
}

void Equations::corrected_bend_local(int stencil, bool with_matrix, Local& local) {
  Local end;
  bend_local(model_, elastic, middle_, stencil, with_matrix, local);
  bend_local(model_, elastic, end_, stencil, false, end);
  const BendTwistEnergy before = bend_energy_of(elastic, start_, stencil);
  const BendStencil& s = model_.bend[at(stencil)];
  Metric metric;
  for (int k = 0; k < 2; ++k)
    metric.pairs[k] = {4 * k, 4 * k + 4, 3, inverse_rest_[s.edge[k]] * inverse_rest_[s.edge[k]]};
  metric.own[3] = metric.own[7] = 1.0;
  correct(local, end, before.bend + before.twist, elastic.bend_stiffness.row(stencil).maxCoeff(), assembler_.bend,
          stencil, metric, with_matrix);
}

void Equations::corrected_half_local(const VectorX& z, int stencil, bool with_matrix, Local& local) {
  Local end;
  half_local(model_, z, elastic, middle_, stencil, with_matrix, local);
  half_local(model_, end_q_, elastic, end_, stencil, false, end);
  const BendTwistEnergy before = half_energy_of(elastic, start_, stencil);
  const int dim = model_.dimension, edge = model_.half[at(stencil)].edge;
  Metric metric;
  metric.pairs[0] = {0, dim == 2 ? 2 : 4, dim, inverse_rest_[edge] * inverse_rest_[edge]};
  if (dim == 2)
    metric.own[4] = 1.0;
  else
    for (int i : {3, 7, 8, 9, 10}) metric.own[i] = 1.0;
  correct(local, end, before.bend + before.twist, elastic.half_stiffness.row(stencil).maxCoeff(), assembler_.half,
          stencil, metric, with_matrix);
}

/// Axial forces of the mean strain, and 2 / (l0 + l1).
void Equations::set_mean_axial_forces() {
  const int n = model_.edge_count;
  force_.resize(n);
  modulus_.resize(n);
  inverse_mean_.resize(n);
  for (int e = 0; e < n; ++e) {
    const double EA = elastic.stretch_stiffness[e], sum = start_.length[e] + end_.length[e];
    force_[e] = EA * (0.5 * sum / model_.edge_length[e] - 1.0);
    modulus_[e] = EA / model_.edge_length[e];
    inverse_mean_[e] = 2.0 / sum;
  }
}

void Equations::add_discrete_gradient(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out) {
  const std::span<double> values = assembler_.solver().values();
  Local local;
  const auto add = [&](const ElementTable& table, int i) {
    table.add_gradient(i, local.gradient, 1.0, gradient_, magnitude_);
    if (with_matrix) table.add_hessian(i, local.hessian, 1.0, values);
  };
  const auto add_edge = [&](int e) {
    mean_stretch_local(z, e, axial_force, local);
    add(assembler_.stretch, e);
  };
  set_mean_axial_forces();
  if (model_.planar()) {
    for (int e = 0; e < model_.edge_count; ++e) add_edge(e);
    for (int b = 0; b < static_cast<int>(model_.bend.size()); ++b) {
      add_planar_bend(b, with_matrix, local);
      add(assembler_.bend, b);
    }
  } else {
    stencil_kernels().momentum_bend(regular_batch(elastic, axial_force, with_matrix ? values.data() : nullptr),
                                    {.end_frames = &end_.edge.data()->tangent.x,
                                     .start_strain = start_.bend_strain.data(),
                                     .end_strain = end_.bend_strain.data(),
                                     .change = difference_.data(),
                                     .inverse_rest = inverse_rest_.data(),
                                     .inverse_mean = inverse_mean_.data(),
                                     .rounding = rounding_,
                                     .floor = correction_floor_.data()});
    for (int e : assembler_.regular.other_edges) add_edge(e);
    for (int b : assembler_.regular.other_bend) {
      corrected_bend_local(b, with_matrix, local);
      add(assembler_.bend, b);
    }
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    corrected_half_local(z, h, with_matrix, local);
    add(assembler_.half, h);
  }
  if (!parameters_->viscous || h_ == 0.0) return;
  add_elastic(viscous_, z, with_matrix, nullptr, out);
}

}  // namespace withe
