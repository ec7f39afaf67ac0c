// Forces of the energy-momentum scheme: see equations.hpp.

#include <cmath>

#include "integrators/equations.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

/// Gonzalez's correction with G = `metric` and u = G D: adds r u / (u . D) to the gradient and its derivative with
/// respect to z to the Hessian.
void Equations::correct(Local& local, const Local& end, double start_energy, double stiffness,
                        const ElementTable& table, int element, const double (*metric)[kMaxLocal]) {
  const int n = table.width();
  double D[kMaxLocal], u[kMaxLocal] = {}, HD[kMaxLocal] = {};
  gather_difference(table, element, D);
  double s = 0.0, r = end.energy - start_energy;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      u[i] += metric[i][j] * D[j];
      HD[i] += local.hessian[i][j] * D[j];
    }
    s += u[i] * D[i];
    r -= local.gradient[i] * D[i];
  }
  if (!(s > 1e-24)) return;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      local.hessian[i][j] += u[i] * (2.0 * (end.gradient[j] - local.gradient[j]) - HD[j]) / s +
                             2.0 * r * (metric[i][j] / s - 2.0 * u[i] * u[j] / (s * s));
  for (int i = 0; i < n; ++i) local.gradient[i] += r * u[i] / s;
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
  const double e0[2] = {zm[2] - zm[0], zm[3] - zm[1]}, e1[2] = {zm[4] - zm[2], zm[5] - zm[3]};
  const double d0[2] = {D[2] - D[0], D[3] - D[1]}, d1[2] = {D[4] - D[2], D[5] - D[3]};
  // Gradients in (e0, e1); each invariant is bilinear with matrix B: value = e^T B e / 2, gradient B e.
  static constexpr double B[4][4][4] = {{{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}},
                                        {{0, 0, 1, 0}, {0, 0, 0, 1}, {1, 0, 0, 0}, {0, 1, 0, 0}},
                                        {{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 2, 0}, {0, 0, 0, 2}},
                                        {{0, 0, 0, 1}, {0, 0, -1, 0}, {0, -1, 0, 0}, {1, 0, 0, 0}}};
  const double e[4] = {e0[0], e0[1], e1[0], e1[1]}, d[4] = {d0[0], d0[1], d1[0], d1[1]};
  double change[4] = {}, gradient[4][4] = {}, s = 0.0;
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) gradient[k][i] += B[k][i][j] * e[j];
    for (int i = 0; i < 4; ++i) change[k] += gradient[k][i] * d[i];
    s += change[k] * change[k];
  }
  const double length4 = (e[0] * e[0] + e[1] * e[1]) * (e[2] * e[2] + e[3] * e[3]);
  if (!(s > 1e-26 * length4)) return;
  double r = end.energy - start_energy, HD[n] = {};
  for (int i = 0; i < n; ++i) {
    r -= local.gradient[i] * D[i];
    for (int j = 0; j < n; ++j) HD[i] += local.hessian[i][j] * D[j];
  }
  // With respect to z: u = sum g_k c_k, du = sum c_k B_k + g_k (dc_k)^T, dc_k = 2 B_k e1 (q1), ds = 2 sum c_k dc_k.
  double u[4] = {}, du[4][4] = {}, ds[4] = {};
  for (int k = 0; k < 4; ++k) {
    double dc[4] = {};
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) dc[i] += B[k][i][j] * (2.0 * e[j] + d[j]);
    for (int i = 0; i < 4; ++i) {
      u[i] += gradient[k][i] * change[k];
      ds[i] += 2.0 * change[k] * dc[i];
      for (int j = 0; j < 4; ++j) du[i][j] += change[k] * B[k][i][j] + gradient[k][i] * dc[j];
    }
  }
  // From edges to nodes: node rows of e0 are (-1, +1, 0), of e1 (0, -1, +1).
  const auto spread = [](const double* edge, double* node) {
    node[0] = -edge[0], node[1] = -edge[1];
    node[2] = edge[0] - edge[2], node[3] = edge[1] - edge[3];
    node[4] = edge[2], node[5] = edge[3];
  };
  double un[n], dsn[n], half[4][n], dun[n][n];
  spread(u, un);
  spread(ds, dsn);
  for (int i = 0; i < 4; ++i) spread(du[i], half[i]);
  for (int j = 0; j < n; ++j) {
    const double column[4] = {half[0][j], half[1][j], half[2][j], half[3][j]};
    double full[n];
    spread(column, full);
    for (int i = 0; i < n; ++i) dun[i][j] = full[i];
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      local.hessian[i][j] += un[i] * (2.0 * (end.gradient[j] - local.gradient[j]) - HD[j]) / s +
                             r * (dun[i][j] / s - un[i] * dsn[j] / (s * s));
  for (int i = 0; i < n; ++i) local.gradient[i] += r * un[i] / s;
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
  double metric[kMaxLocal][kMaxLocal] = {};
  const auto clear = [&] {
    for (auto& row : metric)
      for (double& m : row) m = 0.0;
  };
  const auto couple = [&](int a, int b, double weight) {
    for (int i = 0; i < dim; ++i) {
      metric[a + i][a + i] += weight;
      metric[b + i][b + i] += weight;
      metric[a + i][b + i] -= weight;
      metric[b + i][a + i] -= weight;
    }
  };
  for (int b = 0; b < static_cast<int>(model_.bend.size()); ++b) {
    bend_local(model_, elastic, middle_, b, true, local);
    bend_local(model_, elastic, end_, b, false, end);
    const BendTwistEnergy before = bend_energy_of(elastic, start_, b);
    const double stiffness = elastic.bend_stiffness.row(b).maxCoeff();
    if (model_.planar()) {
      add_planar_invariants(b, local, end, before.bend + before.twist, stiffness);
    } else {
      const BendStencil& s = model_.bend[at(b)];
      clear();
      couple(0, 4, 1.0 / std::pow(model_.edge_length(s.edge[0]), 2));
      couple(4, 8, 1.0 / std::pow(model_.edge_length(s.edge[1]), 2));
      metric[3][3] = metric[7][7] = 1.0;
      correct(local, end, before.bend + before.twist, stiffness, assembler_.bend, b, metric);
    }
    add(assembler_.bend, b);
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    half_local(model_, z, elastic, middle_, h, true, local);
    half_local(model_, end_q_, elastic, end_, h, false, end);
    const BendTwistEnergy before = half_energy_of(elastic, start_, h);
    const double stiffness = elastic.half_stiffness.row(h).maxCoeff();
    const double weight = 1.0 / std::pow(model_.edge_length(model_.half[at(h)].edge), 2);
    clear();
    couple(0, dim == 2 ? 2 : 4, weight);
    if (dim == 2)
      metric[4][4] = 1.0;
    else
      for (int i : {3, 7, 8, 9, 10}) metric[i][i] = 1.0;
    correct(local, end, before.bend + before.twist, stiffness, assembler_.half, h, metric);
    add(assembler_.half, h);
  }
  if (!parameters_->viscous || h_ == 0.0) return;
  add_elastic(viscous_, z, with_matrix, nullptr, out);
}

}  // namespace withe
