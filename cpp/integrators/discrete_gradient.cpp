// Forces of the energy-momentum scheme: see equations.hpp.

#include <cmath>

#include "integrators/equations.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Gradients of e0 . e0, e0 . e1, e1 . e1 and e0 x e1 with respect to e = (e0, e1), each linear in e.
void invariant_gradients(const double (&e)[4], double (&g)[4][4]) {
  const double rows[4][4] = {{2.0 * e[0], 2.0 * e[1], 0.0, 0.0},
                             {e[2], e[3], e[0], e[1]},
                             {0.0, 0.0, 2.0 * e[2], 2.0 * e[3]},
                             {e[3], -e[2], -e[1], e[0]}};
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 4; ++i) g[k][i] = rows[k][i];
}

}  // namespace

/// Gonzalez's correction with u = G D: adds r u / (u . D) to the gradient and its derivative with
/// respect to z to the Hessian.
void Equations::correct(Local& local, const Local& end, double start_energy, double stiffness,
                        const ElementTable& table, int element, const Metric& metric) {
  const int n = table.width();
  double D[kMaxLocal]{}, u[kMaxLocal]{}, change[kMaxLocal]{};
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
    double HD = 0.0;
    for (int j = 0; j < n; ++j) HD += local.hessian[i][j] * D[j];
    change[i] = 2.0 * (end.gradient[i] - local.gradient[i]) - HD;
    s += u[i] * D[i];
    r -= local.gradient[i] * D[i];
  }
  if (!(s > 1e-24)) return;
  const double inverse = 1.0 / s, weight = 2.0 * r * inverse;
  for (int j = 0; j < n; ++j) change[j] = inverse * (change[j] - 2.0 * weight * u[j]);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) local.hessian[i][j] += u[i] * change[j];
    local.hessian[i][i] += weight * metric.own[i];
    local.gradient[i] += r * inverse * u[i];
  }
  for (const Metric::Pair& pair : metric.pairs)
    for (int i = 0; i < pair.size; ++i) {
      const int a = pair.a + i, b = pair.b + i;
      local.hessian[a][a] += weight * pair.weight;
      local.hessian[b][b] += weight * pair.weight;
      local.hessian[a][b] -= weight * pair.weight;
      local.hessian[b][a] -= weight * pair.weight;
    }
  add_correction_floor(table.dofs(element), u, n, s, std::max(end.energy, start_energy), stiffness);
}

/// Rounding of r: a strain rounds as positions do, and its moment sqrt(2 K E) makes it an energy. Where hardly
/// anything moves, r u / (u . D) makes that a force that no iteration removes.
void Equations::add_correction_floor(const int* dofs, const double* u, int count, double s, double energy,
                                     double stiffness) {
  const double rounding = rounding_ * (std::sqrt(2.0 * stiffness * energy) + energy) / s;
  for (int i = 0; i < count; ++i)
    if (dofs[i] >= 0) correction_floor_[dofs[i]] += rounding * std::abs(u[i]);
}

/// The same in a plane with the quadratic invariants of the stencil (e0 . e0, e0 . e1, e1 . e1, e0 x e1), whose
/// derivatives at the middle times D are exactly their changes: it conserves angular momentum too.
void Equations::add_planar_invariants(int stencil, Local& local, const Local& end, double start_energy,
                                      double stiffness) {
  constexpr int n = 6;
  double D[kMaxLocal], zm[n];
  gather_difference(assembler_.bend, stencil, D);
  const int* dofs = assembler_.bend.dofs(stencil);
  for (int i = 0; i < n; ++i) zm[i] = last_z_(dofs[i]);
  // Edges as linear maps of the six unknowns.
  const double e[4] = {zm[2] - zm[0], zm[3] - zm[1], zm[4] - zm[2], zm[5] - zm[3]};
  const double d[4] = {D[2] - D[0], D[3] - D[1], D[4] - D[2], D[5] - D[3]};
  double gradient[4][4], change[4], s = 0.0;
  invariant_gradients(e, gradient);
  for (int k = 0; k < 4; ++k) {
    change[k] = 0.0;
    for (int i = 0; i < 4; ++i) change[k] += gradient[k][i] * d[i];
    s += change[k] * change[k];
  }
  const double length4 = (e[0] * e[0] + e[1] * e[1]) * (e[2] * e[2] + e[3] * e[3]);
  if (!(s > 1e-26 * length4)) return;
  double r = end.energy - start_energy, bent[n];
  for (int i = 0; i < n; ++i) {
    r -= local.gradient[i] * D[i];
    double HD = 0.0;
    for (int j = 0; j < n; ++j) HD += local.hessian[i][j] * D[j];
    bent[i] = 2.0 * (end.gradient[i] - local.gradient[i]) - HD;
  }
  // With respect to z: u = sum g_k c_k, du = sum c_k B_k + g_k (dc_k)^T, dc_k = 2 B_k e1 (q1), ds = 2 sum c_k dc_k.
  const double doubled[4] = {2.0 * e[0] + d[0], 2.0 * e[1] + d[1], 2.0 * e[2] + d[2], 2.0 * e[3] + d[3]};
  double dc[4][4], u[4] = {}, ds[4] = {};
  invariant_gradients(doubled, dc);
  const double* c = change;
  double du[4][4] = {{2.0 * c[0], 0.0, c[1], c[3]},
                     {0.0, 2.0 * c[0], -c[3], c[1]},
                     {c[1], -c[3], 2.0 * c[2], 0.0},
                     {c[3], c[1], 0.0, 2.0 * c[2]}};
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 4; ++i) {
      u[i] += gradient[k][i] * c[k];
      ds[i] += 2.0 * c[k] * dc[k][i];
      for (int j = 0; j < 4; ++j) du[i][j] += gradient[k][i] * dc[k][j];
    }
  // From edges to nodes: node rows of e0 are (-1, +1, 0), of e1 (0, -1, +1).
  const auto spread = [](const double* edge, double* node) {
    node[0] = -edge[0], node[1] = -edge[1];
    node[2] = edge[0] - edge[2], node[3] = edge[1] - edge[3];
    node[4] = edge[2], node[5] = edge[3];
  };
  const double inverse = 1.0 / s, weight = r * inverse;
  double un[n], dsn[n], half[4][n];
  spread(u, un);
  spread(ds, dsn);
  for (int i = 0; i < 4; ++i) spread(du[i], half[i]);
  for (int j = 0; j < n; ++j) {
    const double column[4] = {half[0][j], half[1][j], half[2][j], half[3][j]};
    const double along = inverse * (bent[j] - weight * dsn[j]);
    double full[n];
    spread(column, full);
    for (int i = 0; i < n; ++i) local.hessian[i][j] += un[i] * along + weight * full[i];
  }
  for (int i = 0; i < n; ++i) local.gradient[i] += weight * un[i];
  add_correction_floor(dofs, un, n, s, std::max(end.energy, start_energy), stiffness);
}

void Equations::gather_difference(const ElementTable& table, int element, double* difference) const {
  const int* dofs = table.dofs(element);
  for (int i = 0; i < table.width(); ++i) difference[i] = dofs[i] < 0 ? 0.0 : difference_(dofs[i]);
}

void Equations::add_discrete_gradient(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out) {
  const std::span<double> values = assembler_.solver().values();
  Local local, end;
  const auto add = [&](const ElementTable& table, int i) {
    table.add_gradient(i, local.gradient, 1.0, gradient_, magnitude_);
    if (with_matrix) table.add_hessian(i, local.hessian, 1.0, values);
  };
  const int dim = model_.dimension;
  for (int e = 0; e < model_.edge_count; ++e) {
    const double rest = model_.edge_length(e), EA = elastic.stretch_stiffness(e);
    const double l0 = start_.length(e), l1 = end_.length(e), sum = l0 + l1;
    const double force = EA * (0.5 * sum / rest - 1.0), geometric = axial_force ? axial_force[e] : force;
    const int* dofs = assembler_.stretch.dofs(e);
    double mean[3];
    for (int i = 0; i < dim; ++i) mean[i] = 2.0 * (z(dofs[dim + i]) - z(dofs[i])) / sum;
    const Vec3d& t1 = end_.edge[at(e)].tangent;
    const double t[3] = {t1.x, t1.y, t1.z};
    for (int i = 0; i < dim; ++i) {
      local.gradient[i] = -force * mean[i];
      local.gradient[dim + i] = force * mean[i];
      for (int j = 0; j < dim; ++j) {
        const double h = mean[i] * t[j] * (EA / rest - 2.0 * geometric / sum) + (i == j ? 2.0 * geometric / sum : 0.0);
        local.hessian[i][j] = local.hessian[dim + i][dim + j] = h;
        local.hessian[i][dim + j] = local.hessian[dim + i][j] = -h;
      }
    }
    add(assembler_.stretch, e);
  }
  for (int b = 0; b < static_cast<int>(model_.bend.size()); ++b) {
    bend_local(model_, elastic, middle_, b, true, local);
    bend_local(model_, elastic, end_, b, false, end);
    const BendTwistEnergy before = bend_energy_of(elastic, start_, b);
    const double stiffness = elastic.bend_stiffness.row(b).maxCoeff();
    if (model_.planar()) {
      add_planar_invariants(b, local, end, before.bend + before.twist, stiffness);
    } else {
      const BendStencil& s = model_.bend[at(b)];
      Metric metric;
      for (int k = 0; k < 2; ++k)
        metric.pairs[k] = {4 * k, 4 * k + 4, 3, inverse_rest_[s.edge[k]] * inverse_rest_[s.edge[k]]};
      metric.own[3] = metric.own[7] = 1.0;
      correct(local, end, before.bend + before.twist, stiffness, assembler_.bend, b, metric);
    }
    add(assembler_.bend, b);
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    half_local(model_, z, elastic, middle_, h, true, local);
    half_local(model_, end_q_, elastic, end_, h, false, end);
    const BendTwistEnergy before = half_energy_of(elastic, start_, h);
    const double stiffness = elastic.half_stiffness.row(h).maxCoeff();
    const int edge = model_.half[at(h)].edge;
    Metric metric;
    metric.pairs[0] = {0, dim == 2 ? 2 : 4, dim, inverse_rest_[edge] * inverse_rest_[edge]};
    if (dim == 2)
      metric.own[4] = 1.0;
    else
      for (int i : {3, 7, 8, 9, 10}) metric.own[i] = 1.0;
    correct(local, end, before.bend + before.twist, stiffness, assembler_.half, h, metric);
    add(assembler_.half, h);
  }
  if (!parameters_->viscous || h_ == 0.0) return;
  add_elastic(viscous_, z, with_matrix, nullptr, out);
}

}  // namespace withe
