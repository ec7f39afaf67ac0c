// Forces of the energy-momentum scheme: see step_problem.hpp and elasticity/discrete_gradient.hpp.

#include <cmath>

#include "elasticity/discrete_gradient.hpp"
#include "geometry/rotation.hpp"
#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Vec3d row_of(const Columns3& table, int i) { return {table(i, 0), table(i, 1), table(i, 2)}; }
template <class Table>
Vec3d row_of(const Table& table, int i) {
  return {table(i, 0), table(i, 1), table(i, 2)};
}

Vec3d in_plane(const EdgeFrame<double>& f, double sign) { return {sign * f.tangent.x, sign * f.tangent.y, 0.0}; }

/// The moment about a plane's normal with m (w_a - w_b) = E1 - E0, and its derivatives by the turns of both directions
/// at the end: `discrete_moment` for kappa = 2 (t_a x t_b) / (1 + t_a . t_b).
struct PlanarMoment {
  double moment, by_a, by_b;
};

PlanarMoment planar_moment(const BendMeasure& measure, const Vec3d& a0, const Vec3d& a1, const Vec3d& b0,
                           const Vec3d& b1, double kappa0, double kappa1, double natural, double stiffness) {
  const DividedMoments<double> h = divided_moments<true, double>(measure, {kappa0, 0.0, 0.0}, {kappa1, 0.0, 0.0},
                                                                 {natural, 0.0, 0.0}, {stiffness, 0.0, 0.0});
  const Vec3d a = 0.5 * (a0 + a1), b = 0.5 * (b0 + b1);
  const double inverse = 2.0 / (2.0 + dot(a0, b0) + dot(a1, b1)), kappa = 0.5 * (kappa0 + kappa1);
  const double along = dot(a, b), across = cross(a, b).z;
  const double slope = -inverse * (2.0 * along + kappa * across);
  PlanarMoment m;
  m.moment = h.by[0] * slope;
  // By a turn of a less that of b: kappa, and 1 + t_a . t_b.
  const double by_kappa = -(1.0 + 0.25 * kappa1 * kappa1), by_chi = cross(a1, b1).z;
  const double strained =
      h.second[0][0] * slope * by_kappa - h.by[0] * inverse * (0.5 * by_kappa * across + 0.5 * by_chi * slope);
  // d along = (da x b + db' ...) / 2: a turn of a moves it by w x a1.
  const double along_a = 0.5 * cross(a1, b).z, along_b = -0.5 * cross(a, b1).z;
  const double across_a = -0.5 * dot(a1, b), across_b = 0.5 * dot(a, b1);
  m.by_a = strained - h.by[0] * inverse * (2.0 * along_a + kappa * across_a);
  m.by_b = -strained - h.by[0] * inverse * (2.0 * along_b + kappa * across_b);
  return m;
}

Vector2 flat(const Vec3d& v) { return {v.x, v.y}; }
/// By a right angle.
Vector2 turned(const Vector2& v) { return {-v.y(), v.x()}; }

/// `MovingEdge` in a plane, where a moment has one component and directors do not turn.
struct PlanarEdge {
  Vector2 t0, t1, t;
  double inverse_length1, inverse_length, inverse_mean, chi, stretch;
  Vector2 force;  ///< of a unit moment, on the edge's vector

  PlanarEdge(const EdgeFrame<double>& start, const EdgeFrame<double>& middle, const EdgeFrame<double>& end)
      : t0(flat(start.tangent)),
        t1(flat(end.tangent)),
        t(flat(middle.tangent)),
        inverse_length1(end.inverse_length),
        inverse_length(middle.inverse_length) {
    const double l0 = 1.0 / start.inverse_length, l1 = 1.0 / end.inverse_length;
    inverse_mean = 2.0 / (l0 + l1);
    chi = 0.5 / (1.0 + t0.dot(t1));
    stretch = chi * inverse_length * inverse_mean * (l1 - l0);
    force = inverse_length * turned(t) + stretch * cross(t0, t1) * t;
  }

  /// How a moment changes with the edge's vector at the end, of its change by a turn.
  Vector2 column(double by_turn) const { return by_turn * inverse_length1 * turned(t1); }

  /// How the force of a moment that stays changes with the edge's vector at the end.
  Eigen::Matrix2d geometry(double moment) const {
    const double i = inverse_length, p = moment * cross(t0, t1), nu = stretch * p;
    const auto normal = [&](const Vector2& v) { return Vector2(inverse_length1 * (v - v.dot(t1) * t1)); };
    const Vector2 by_chi = 2.0 * chi * normal(t0);
    const Vector2 by_nu =
        normal(stretch * moment * turned(t0)) +
        p * (chi * i * inverse_mean * t1 - stretch * (by_chi + 0.5 * i * t + 0.5 * inverse_mean * t1));
    Eigen::Matrix2d out =
        t * by_nu.transpose() - i * i * moment * turned(t) * t.transpose() - 0.5 * nu * i * t * t.transpose();
    const double turn = 0.5 * i * i * moment;
    out(0, 0) += 0.5 * nu * i;
    out(1, 1) += 0.5 * nu * i;
    out(0, 1) -= turn;
    out(1, 0) += turn;
    return out;
  }
};

void add_planar_force(Local& out, int tail, int head, const Vector2& force) {
  for (int k = 0; k < 2; ++k) {
    out.gradient[head + k] += force(k);
    out.gradient[tail + k] -= force(k);
  }
}

/// Rows of one edge by the vector of another, twice: changes of the end are twice those of the middle.
void add_planar_rows(Local& out, const int (&row)[2], const int (&column)[2], const Eigen::Matrix2d& block) {
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b)
      for (int k = 0; k < 2; ++k)
        for (int l = 0; l < 2; ++l) out.hessian[row[a] + k][column[b] + l] += (a == b ? 2.0 : -2.0) * block(k, l);
}

void add_block(Local& out, int row, int column, double factor, const Mat3<double>& m) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.hessian[row + i][column + j] += factor * m.row[i][j];
}

/// Where an edge's vector and angle are among the unknowns of a stencil in space: its head less its tail.
struct EdgePlace {
  int tail, head, angle;
};

void add_edge_forces(Local& out, const EdgePlace& e, const MovingEdge<double>& edge, const EdgeFrame<double>& middle,
                     const Vec3d& moment) {
  const Vec3d f = edge.force(moment) + edge.torque(moment) * middle.spin;
  const double component[3] = {f.x, f.y, f.z};
  for (int i = 0; i < 3; ++i) {
    out.gradient[e.head + i] += component[i];
    out.gradient[e.tail + i] -= component[i];
  }
  out.gradient[e.angle] += edge.torque(moment);
}

/// What an edge makes of a moment that stays, and of its own change of it.
void finish_block(const MovingEdge<double>& edge, const EdgeFrame<double>& middle, const Vec3d& moment, bool own,
                  EdgeBlock<double>& block) {
  if (own) add_edge_geometry(edge, moment, block);
  add_transport(middle, block);
  if (own) add_spin_change(edge, middle, edge.torque(moment), block);
}

/// Rows of edge `r` by the vector and angle of edge `c`, twice: changes of the end are twice those of the middle.
void add_edge_rows(Local& out, const EdgePlace& r, const EdgePlace& c, const EdgeBlock<double>& b) {
  constexpr double kTwice = 2.0;
  for (int s : {1, -1})
    for (int t : {1, -1}) add_block(out, s > 0 ? r.head : r.tail, t > 0 ? c.head : c.tail, s * t * kTwice, b.ee);
  for (int i = 0; i < 3; ++i) {
    out.hessian[r.head + i][c.angle] += kTwice * b.e_angle[i];
    out.hessian[r.tail + i][c.angle] -= kTwice * b.e_angle[i];
    out.hessian[r.angle][c.head + i] += kTwice * b.angle_e[i];
    out.hessian[r.angle][c.tail + i] -= kTwice * b.angle_e[i];
  }
  out.hessian[r.angle][c.angle] += kTwice * b.angle_angle;
}

void clear(Local& out, int width, bool with_matrix = true) {
  for (int i = 0; i < width; ++i) {
    out.gradient[i] = 0.0;
    for (int j = 0; with_matrix && j < width; ++j) out.hessian[i][j] = 0.0;
  }
}

/// How the torque on a hinge follows from the moment m on what it carries: m . arm. Behind a frame that turns by the
/// Cayley vector w the hinge turns by `angle` about `axis`, and what both make of the carried frame is a rotation with
/// the Cayley vector w + angle arm.
struct HingeArm {
  Vector3 arm;
  Matrix3 by_frame;  ///< by w
  Vector3 by_angle;
};

HingeArm hinge_arm(const Vector3& w, const Vector3& axis, double angle) {
  const Vector3 x = 0.5 * w;
  const double t = std::tan(0.5 * angle), along = x.dot(axis), n = 1.0 / (1.0 - along * t);
  const bool little = std::abs(angle) < 1e-4;
  const double k = little ? 1.0 + angle * angle / 12.0 : 2.0 * t / angle;
  const double by_k = little ? angle / 6.0 : ((1.0 + t * t) * angle - 2.0 * t) / (angle * angle);
  const Vector3 a = n * (axis + x.cross(axis) + along * x);
  HingeArm h;
  h.arm = k * a;
  h.by_frame =
      0.5 * k *
      (n * (-cross_matrix(axis) + along * Matrix3::Identity() + x * axis.transpose()) + n * t * a * axis.transpose());
  h.by_angle = by_k * a + k * n * along * 0.5 * (1.0 + t * t) * a;
  return h;
}

/// Bending of a stencil in a plane.
void planar_bend_local(const Model& model, const ElasticCoefficients& elastic, const Configuration& start,
                       const Configuration& middle, const Configuration& end, int stencil, bool with_matrix,
                       Local& local) {
  const BendStencil& s = model.bend[at(stencil)];
  clear(local, 6, with_matrix);
  Vec3d t0[2], t1[2];
  int ends[2][2];
  for (int k = 0; k < 2; ++k) {
    const int first = 2 * k, second = 2 * (k + 1);
    ends[k][0] = s.sign[k] > 0 ? first : second;
    ends[k][1] = s.sign[k] > 0 ? second : first;
    t0[k] = in_plane(start.edge[at(s.edge[k])], s.sign[k]);
    t1[k] = in_plane(end.edge[at(s.edge[k])], s.sign[k]);
  }
  const PlanarMoment m =
      planar_moment(elastic.measure, t0[0], t1[0], t0[1], t1[1], start.bend_strain(stencil, 0),
                    end.bend_strain(stencil, 0), elastic.bend_natural(stencil, 0), elastic.bend_stiffness(stencil, 0));
  const auto edge_of = [&](int e) { return PlanarEdge(start.edge[at(e)], middle.edge[at(e)], end.edge[at(e)]); };
  const PlanarEdge edge[2] = {edge_of(s.edge[0]), edge_of(s.edge[1])};
  const double by[2] = {m.by_a, m.by_b};
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? 1.0 : -1.0;
    add_planar_force(local, ends[i][0], ends[i][1], sign * m.moment * edge[i].force);
    for (int j = 0; with_matrix && j < 2; ++j) {
      Eigen::Matrix2d block = sign * edge[i].force * edge[j].column(by[j]).transpose();
      if (i == j) block += edge[i].geometry(sign * m.moment);
      add_planar_rows(local, ends[i], ends[j], block);
    }
  }
}

MovingEdge<double> moving_edge(const StepProblem& problem, const StepData& data, int edge) {
  const EdgeFrame<double>&start = problem.start_configuration.edge[at(edge)], &middle = data.configuration.edge[at(edge)], &end = data.end_configuration.edge[at(edge)];
  return {start.tangent,         start.inverse_length,         end.tangent, end.inverse_length, middle.tangent,
          middle.inverse_length, turn_of_directors(start, end)};
}

/// Bending and twisting of a stencil in space.
void discrete_bend_local(const StepProblem& problem, const StepData& data, int stencil, bool with_matrix, Local& local) {
  const BendStencil& s = problem.model.bend[at(stencil)];
  clear(local, 11, with_matrix);
  // An edge against its rod has its head where the stencil has its tail.
  EdgePlace place[2];
  for (int k = 0; k < 2; ++k) {
    const int first = 4 * k, second = 4 * (k + 1);
    place[k] = {s.sign[k] > 0 ? first : second, s.sign[k] > 0 ? second : first, first + 3};
  }
  const MovingEdge<double> edge[2] = {moving_edge(problem, data, s.edge[0]), moving_edge(problem, data, s.edge[1])};
  EdgeFrame<double> f0[2], f1[2];
  for (int k = 0; k < 2; ++k) {
    f0[k] = oriented(problem.start_configuration.edge[at(s.edge[k])], s.sign[k]);
    f1[k] = oriented(data.end_configuration.edge[at(s.edge[k])], s.sign[k]);
  }
  DiscreteMoment<double> m{};
  discrete_moment<true>(problem.elastic.measure, f0[0], f1[0], f0[1], f1[1], row_of(problem.start_configuration.bend_strain, stencil),
                        row_of(data.end_configuration.bend_strain, stencil), row_of(problem.elastic.bend_natural, stencil),
                        row_of(problem.elastic.bend_stiffness, stencil), m);
  EdgeColumns<double> columns[2];
  for (int k = 0; k < 2; ++k) columns[k] = edge_columns(k == 0 ? m.by_a : m.by_b, data.end_configuration.edge[at(s.edge[k])]);
  const Vec3d moment[2] = {m.moment, -m.moment};
  for (int i = 0; i < 2; ++i) {
    const EdgeFrame<double>& middle = data.configuration.edge[at(s.edge[i])];
    add_edge_forces(local, place[i], edge[i], middle, moment[i]);
    for (int j = 0; with_matrix && j < 2; ++j) {
      EdgeBlock<double> block = edge_block(edge[i], i == 0 ? 1.0 : -1.0, columns[j]);
      finish_block(edge[i], middle, moment[i], i == j, block);
      add_edge_rows(local, place[i], place[j], block);
    }
  }
}

/// Bending in a plane between a frame and an edge; the frame's row is a moment.
void discrete_planar_half_local(const StepProblem& problem, const StepData& data, int stencil, Local& local) {
  const FrameStencil& s = problem.model.half[at(stencil)];
  clear(local, 5);
  const Vec3d f0 = in_plane(problem.start_configuration.attached[at(stencil)], 1.0), f1 = in_plane(data.end_configuration.attached[at(stencil)], 1.0);
  const Vec3d t0 = in_plane(problem.start_configuration.edge[at(s.edge)], 1.0), t1 = in_plane(data.end_configuration.edge[at(s.edge)], 1.0);
  const double kappa0 = problem.start_configuration.half_strain(stencil, 0), kappa1 = data.end_configuration.half_strain(stencil, 0);
  const double natural = problem.elastic.half_natural(stencil, 0), stiffness = problem.elastic.half_stiffness(stencil, 0);
  const PlanarMoment p = s.frame_first
                             ? planar_moment(problem.elastic.measure, f0, f1, t0, t1, kappa0, kappa1, natural, stiffness)
                             : planar_moment(problem.elastic.measure, t0, t1, f0, f1, kappa0, kappa1, natural, stiffness);
  const double sign = s.frame_first ? -1.0 : 1.0;  // of the moment on the edge
  const double by_edge = s.frame_first ? p.by_b : p.by_a, by_frame = s.frame_first ? p.by_a : p.by_b;
  const PlanarEdge edge(problem.start_configuration.edge[at(s.edge)], data.configuration.edge[at(s.edge)], data.end_configuration.edge[at(s.edge)]);
  const int ends[2] = {0, 2};
  const Vector2 column = edge.column(by_edge), by_turn = 2.0 * sign * by_frame * edge.force;
  add_planar_force(local, ends[0], ends[1], sign * p.moment * edge.force);
  add_planar_rows(local, ends, ends, sign * edge.force * column.transpose() + edge.geometry(sign * p.moment));
  local.gradient[4] = -sign * p.moment;
  for (int i = 0; i < 2; ++i) {
    local.hessian[2 + i][4] += by_turn(i);
    local.hessian[i][4] -= by_turn(i);
    local.hessian[4][2 + i] -= 2.0 * sign * column(i);
    local.hessian[4][i] += 2.0 * sign * column(i);
  }
  local.hessian[4][4] = -2.0 * sign * by_frame;
}

/// Bending and twisting in space between a frame and an edge. The frame's rows are the moment on it, whose work is that
/// over its Cayley vector.
void discrete_half_local(const StepProblem& problem, const StepData& data, int stencil, Local& local) {
  const FrameStencil& s = problem.model.half[at(stencil)];
  clear(local, 11);
  const MovingEdge<double> edge = moving_edge(problem, data, s.edge);
  const EdgeFrame<double>&e0 = problem.start_configuration.edge[at(s.edge)], &e1 = data.end_configuration.edge[at(s.edge)];
  const EdgeFrame<double>&f0 = problem.start_configuration.attached[at(stencil)], &f1 = data.end_configuration.attached[at(stencil)];
  const bool first = s.frame_first;
  DiscreteMoment<double> m;
  discrete_moment<true>(problem.elastic.measure, first ? f0 : e0, first ? f1 : e1, first ? e0 : f0, first ? e1 : f1,
                        row_of(problem.start_configuration.half_strain, stencil), row_of(data.end_configuration.half_strain, stencil),
                        row_of(problem.elastic.half_natural, stencil), row_of(problem.elastic.half_stiffness, stencil), m);
  const double sign = first ? -1.0 : 1.0;  // of the moment on the edge
  const Mat3<double>&by_edge = first ? m.by_b : m.by_a, &by_frame = first ? m.by_a : m.by_b;
  const EdgePlace place{0, 4, 3};
  const Vec3d moment = sign * m.moment;
  const EdgeColumns<double> columns = edge_columns(by_edge, e1);
  EdgeBlock<double> block = edge_block(edge, sign, columns);
  finish_block(edge, data.configuration.edge[at(s.edge)], moment, true, block);
  add_edge_forces(local, place, edge, data.configuration.edge[at(s.edge)], moment);
  add_edge_rows(local, place, place, block);

  // The frame turns at the end by J(w) dw, and by its hinge's angle about the hinge's axis there.
  const int dof = problem.model.frame_dof[at(s.frame)];
  const Vector3 w = data.end.segment<3>(dof), on_frame = -sign * to_eigen(m.moment);
  const Matrix3 J = cayley_spin(w);
  Matrix3 by_spin, by_vector;  // of the moment m
  for (int i = 0; i < 3; ++i) {
    by_spin.row(i) << by_frame.row[i].x, by_frame.row[i].y, by_frame.row[i].z;
    by_vector.row(i) << columns.edge.row[i].x, columns.edge.row[i].y, columns.edge.row[i].z;
  }
  Eigen::Matrix<double, 3, 11> by;  // m by the unknowns of the end
  by.setZero();
  by.middleCols<3>(4) = by_vector;
  by.leftCols<3>() = -by_vector;
  by.col(3) << columns.angle.x, columns.angle.y, columns.angle.z;
  by.middleCols<3>(7) = by_spin * J;
  HingeArm h{Vector3::Zero(), Matrix3::Zero(), Vector3::Zero()};
  if (s.hinge >= 0) {
    const Hinge& hinge = problem.model.hinges[at(s.hinge)];
    by.col(10) = by_spin * (data.end_configuration.frame[at(s.frame)] * hinge.axis);
    h = hinge_arm(w, problem.start_configuration.frame[at(s.frame)] * hinge.axis, 2.0 * (data.z(hinge.dof) - problem.start->q(hinge.dof)));
  }
  // Rows of the edge by the frame and its hinge.
  for (int k = 7; k < 11; ++k) {
    const Vec3d change = to_vec3(Vector3(2.0 * sign * by.col(k)));
    const Vec3d f = edge.force(change) + edge.torque(change) * data.configuration.edge[at(s.edge)].spin;
    for (int i = 0; i < 3; ++i) {
      local.hessian[4 + i][k] += f[i];
      local.hessian[i][k] -= f[i];
    }
    local.hessian[3][k] += edge.torque(change);
  }
  const Eigen::Matrix<double, 3, 11> frame_rows = (-2.0 * sign) * by;
  Eigen::Matrix<double, 1, 11> hinge_row = h.arm.transpose() * frame_rows;
  hinge_row.segment<3>(7) += 2.0 * on_frame.transpose() * h.by_frame;
  hinge_row(10) += 2.0 * on_frame.dot(h.by_angle);
  for (int i = 0; i < 3; ++i) {
    local.gradient[7 + i] = on_frame(i);
    for (int k = 0; k < 11; ++k) local.hessian[7 + i][k] = frame_rows(i, k);
  }
  local.gradient[10] = h.arm.dot(on_frame);
  for (int k = 0; k < 11; ++k) local.hessian[10][k] = hinge_row(k);
}

/// Force of the mean strain, along the mean of the edge.
void mean_stretch_local(const StepProblem& problem, const StepData& data, const Assembler& assembler, int edge, const double* axial_force, Local& local) {
  const int dim = problem.model.dimension;
  const double force = data.force[edge], geometric = axial_force ? axial_force[edge] : force;
  const int* dofs = assembler.stretch.dofs(edge);
  double mean[3];
  for (int i = 0; i < dim; ++i) mean[i] = data.inverse_mean[edge] * (data.z(dofs[dim + i]) - data.z(dofs[i]));
  const Vec3d& t1 = data.end_configuration.edge[at(edge)].tangent;
  const double t[3] = {t1.x, t1.y, t1.z}, transverse = geometric * data.inverse_mean[edge];
  for (int i = 0; i < dim; ++i) {
    local.gradient[i] = -force * mean[i];
    local.gradient[dim + i] = force * mean[i];
    for (int j = 0; j < dim; ++j) {
      const double h = mean[i] * t[j] * (data.modulus[edge] - transverse) + (i == j ? transverse : 0.0);
      local.hessian[i][j] = local.hessian[dim + i][dim + j] = h;
      local.hessian[i][dim + j] = local.hessian[dim + i][j] = -h;
    }
  }
}

}  // namespace

void ElasticForces::add_discrete_gradient(const StepProblem& problem, StepData& data, const Assembler& assembler,
                                          std::span<double> values) const {
  const Model& model = problem.model;
  const bool with_matrix = !values.empty();
  Local local;
  const auto add = [&](const ElementTable& table, int i) {
    table.add_gradient(i, local.gradient, 1.0, data.gradient, data.row_magnitude);
    if (with_matrix) table.add_hessian(i, local.hessian, 1.0, values);
  };
  set_mean_axial_forces(problem, data);
  const auto add_edge = [&](int e) {
    mean_stretch_local(problem, data, assembler, e, data.axial_force, local);
    add(assembler.stretch, e);
  };
  const auto add_bend = [&](int b) {
    if (model.planar())
      planar_bend_local(model, problem.elastic, problem.start_configuration, data.configuration, data.end_configuration,
                        b, with_matrix, local);
    else
      discrete_bend_local(problem, data, b, with_matrix, local);
    add(assembler.bend, b);
  };
  if (model.planar()) {
    for (int e = 0; e < model.edge_count; ++e) add_edge(e);
    for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) add_bend(b);
  } else {
    stencil_kernels().momentum_bend(regular_batch(problem.elastic, data, assembler, values, data.axial_force),
                                    {.start_frames = &problem.start_configuration.edge.data()->tangent.x,
                                     .end_frames = &data.end_configuration.edge.data()->tangent.x,
                                     .start_strain = problem.start_configuration.bend_strain.data(),
                                     .end_strain = data.end_configuration.bend_strain.data()});
    for (int e : assembler.regular.other_edges) add_edge(e);
    for (int b : assembler.regular.other_bend) add_bend(b);
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    if (model.planar())
      discrete_planar_half_local(problem, data, h, local);
    else
      discrete_half_local(problem, data, h, local);
    add(assembler.half, h);
  }
  data.elastic_rows = data.gradient.head(model.dof_count);
  if (problem.viscous_acts()) add_elastic(problem, data.viscous, data, assembler, values, nullptr);
}

}  // namespace withe
