// Inertia of edges that spin and turn, and of frames.

#include "steps/inertia.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "steps/regular_stencils.hpp"
#include "steps/turning_inertia.hpp"
#include "steps/turning_kernels.hpp"
#include "steps/turning_slopes.hpp"

namespace withe {
namespace {

/// Finds forces and torques of edges that spin and turn, for given moments of inertia.
void find_turning(const StepProblem& problem, const StepData& data, const VectorX& inertia, TurningForces& out) {
  const Model& model = problem.model;
  out.head.resize(3 * Eigen::Index{model.edge_count});
  out.torque.resize(model.edge_count);
  const TurningBatch batch{.count = model.edge_count,
                           .tail = model.tail_dof.data(),
                           .head = model.head_dof.data(),
                           .angle = model.edge_dof.data(),
                           .z = data.z.data(),
                           .start_q = problem.start->q.data(),
                           .start_v = problem.start->v.data(),
                           .interval = problem.interval,
                           .inertia = inertia.data(),
                           .frames = frames_of(data.configuration),
                           .start_tangent = &problem.start->tangent.data()->x,
                           .start_length = problem.start_configuration.length.data(),
                           .end_length = data.end_configuration.length.data(),
                           .end_frames = frames_of(data.end_configuration),
                           .force = out.head.data(),
                           .torque = out.torque.data()};
  const TurningKernels& kernels = turning_kernels();
  const auto kernel = problem.conserves_energy() ? kernels.energy_momentum
                      : problem.in_middle()      ? kernels.midpoint
                                                 : kernels.euler;
  kernel(batch);
}

/// Adds the inertia of edges that spin and turn. Under backward Euler it is the part that the mass matrix does not
/// contain, under the midpoint rules the whole inertia.
void add_turning_edges(const StepProblem& problem, StepData& data) {
  const Model& model = problem.model;
  TurningForces& forces = data.turning_forces;
  find_turning(problem, data, problem.parameters->edge_inertia, forces);
  for (int e = 0; e < model.edge_count; ++e) {
    if (problem.in_middle()) data.inertia[model.edge_dof[at(e)]] = forces.torque[e];
    add_to_edge(model, e, forces.at_head(e), data.gradient);
  }
}

/// Sets the inertia of frames under the midpoint rules: moments J^T m, where J dw is the spin of a Cayley vector. In
/// energy-momentum steps the rows of all forces except elastic forces become moments.
void set_turning_frames(const StepProblem& problem, StepData& data) {
  const Model& model = problem.model;
  const double inverse = 0.5 / problem.interval;
  for (int f = 0; f < model.frame_count; ++f) {
    const int dof = model.frame_dof[at(f)];
    if (model.planar()) {
      if (!problem.conserves_energy()) continue;
      const double change = 2.0 * (data.z[dof] - problem.start->q[dof]);
      data.inertia[dof] += 2.0 * problem.mass.rows[dof] * inverse * inverse * (finite_turn(change) - change);
      continue;
    }
    const Matrix3 J = cayley_spin(data.z.segment<3>(dof)).transpose();
    if (problem.conserves_energy()) {  // their rows are moments
      const Vector3 other = data.gradient.segment<3>(dof) - data.elastic_rows.segment<3>(dof);
      data.gradient.segment<3>(dof) += J.inverse() * other - other;
    } else {
      data.inertia.segment<3>(dof) = (J * data.inertia.segment<3>(dof)).eval();
    }
  }
}

/// A rigid body in a step, in the axes of space: it turns by the Cayley vector w over `duration`.
///
/// The moment of a step, m = (R1 J W1 - R0 J W0) / dt, makes the change of angular momentum exact. The rates W are
/// about the axes of the body. Midpoint steps have (W0 + W1) / 2 = R0^T w / dt. Then w . m dt is the change of kinetic
/// energy [Simo and Wong 1991, with the Cayley map]. Backward Euler has W1 = R1^T w / dt.
struct TurningBody {
  int dof;
  double duration;
  Vector3 w, spin, carried_spin;  ///< at the end; that of the start, turned with the body
  Matrix3 inertia;                ///< at the end
  Vector3 moment;

  TurningBody(const StepProblem& problem, const VectorX& z, int body)
      : dof(problem.model.frame_dof[at(problem.model.body_frame[at(body)])]),
        duration(problem.duration()),
        w((problem.in_middle() ? 2.0 : 1.0) * z.segment<3>(dof)) {
    const double mean = problem.mass.rows[dof];
    const Matrix3 before = problem.mass.bodies[at(body)] + mean * Matrix3::Identity(), turn = cayley(w);
    const Vector3 rate = problem.start->v.segment<3>(dof);
    inertia = turn * before * turn.transpose();
    carried_spin = turn * rate;
    spin = (1.0 / duration) * w;
    if (problem.in_middle()) spin = 2.0 * spin - carried_spin;
    moment = (inertia * spin - before * rate) / duration;
  }

  /// Derivative of the moment by the unknowns of the frame at z.
  Matrix3 slope(const StepProblem& problem) const {
    const double rate = problem.in_middle() ? 2.0 : 1.0;
    const Matrix3 turn = rate * cayley_spin(w);  // spatial spin of the end by the unknowns
    Matrix3 by_spin = (rate * rate / duration) * Matrix3::Identity();
    if (problem.in_middle()) by_spin += cross_matrix(carried_spin) * turn;
    return (1.0 / duration) *
           ((inertia * cross_matrix(spin) - cross_matrix(inertia * spin)) * turn + inertia * by_spin);
  }
};

/// Rows of bodies; their frames have no other inertia.
void set_turning_bodies(const StepProblem& problem, StepData& data) {
  for (int b = 0; b < static_cast<int>(problem.mass.bodies.size()); ++b) {
    const TurningBody body(problem, data.z, b);
    data.inertia.segment<3>(body.dof) =
        problem.conserves_energy() ? body.moment
                                   : Vector3(cayley_spin(data.z.segment<3>(body.dof)).transpose() * body.moment);
  }
}

/// Derivatives of the rows of bodies in place of those of the mass matrix.
void add_body_slopes(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                     std::span<double> values) {
  const double rate = 1.0 / (problem.interval * problem.interval);
  for (int b = 0; b < static_cast<int>(problem.mass.bodies.size()); ++b) {
    const TurningBody body(problem, data.z, b);
    Matrix3 slope = body.slope(problem);
    if (!problem.conserves_energy()) {
      const Vector3 w = data.z.segment<3>(body.dof);
      slope = (cayley_spin(w).transpose() * slope + cayley_moment_slope(w, body.moment)).eval();
    }
    slope -= rate * (problem.mass.bodies[at(b)] + problem.mass.rows[body.dof] * Matrix3::Identity());
    assembler.add_block(body.dof, slope, values);
  }
}

/// Derivatives of the inertia of edges, beyond those of the mass matrix.
void add_edge_slopes(const StepProblem& problem, StepData& data, const ElementTable& edges, std::span<double> values) {
  const Model& model = problem.model;
  const double inverse = 1.0 / problem.interval;
  const VectorX& q0 = problem.start->q;
  data.turning.resize(at(model.edge_count));
  for (int e = 0; e < model.edge_count; ++e) {
    const int angle = model.edge_dof[at(e)];
    TurningSlopes& slopes = data.turning[at(e)];
    set_turning_slopes(
        {problem.rule, problem.duration(), problem.parameters->edge_inertia[e], edge_vector(model, data.z, e),
         edge_vector(model, q0, e), data.z[angle] - q0[angle], problem.start->v[angle]},
        slopes);
    double hessian[7][7];
    for (int column = 0; column < 7; ++column) {
      const int unknown = column < 3 ? column : column == 3 ? 3 : column - 4;
      const double sign = column < 3 ? -1.0 : 1.0;
      for (int i = 0; i < 3; ++i) {
        hessian[4 + i][column] = sign * slopes.by[i][unknown];
        hessian[i][column] = -hessian[4 + i][column];
      }
      hessian[3][column] = sign * slopes.by[3][unknown];
    }
    hessian[3][3] -= inverse * inverse * problem.mass.rows[angle];
    edges.add_hessian(e, hessian, 1.0, values);
  }
}

void add_turning_adjoint(const StepProblem& problem, const StepData& data, const TurningForces& unit, int edge,
                         StepAdjoint& adjoint) {
  const Model& model = problem.model;
  const int tail = model.tail_dof[at(edge)], head = model.head_dof[at(edge)], angle = model.edge_dof[at(edge)];
  const Vec3d apart = edge_vector(model, adjoint.rows, edge);
  // The mass matrix has the torque of backward Euler.
  const double about = problem.in_middle() ? adjoint.rows[angle] : 0.0;
  const TurningSlopes& slopes = data.turning[at(edge)];
  double by[TurningSlopes::kUnknowns];
  for (int k = 0; k < TurningSlopes::kUnknowns; ++k) {
    by[k] = about * slopes.by[3][k];
    for (int i = 0; i < 3; ++i) by[k] += apart[i] * slopes.by[i][k];
  }
  for (int i = 0; i < 3; ++i) {
    adjoint.start[head + i] += by[4 + i];
    adjoint.start[tail + i] -= by[4 + i];
  }
  adjoint.start[angle] += by[7];
  adjoint.velocity[angle] += by[8];
  adjoint.coefficients.mass[angle] += dot(apart, unit.at_head(edge)) + about * unit.torque[edge];
}

void add_frame_slopes(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                      std::span<double> values) {
  const Model& model = problem.model;
  const double rate = 1.0 / (problem.interval * problem.interval);
  for (int f = 0; f < model.frame_count; ++f) {
    const int dof = model.frame_dof[at(f)];
    if (model.planar()) {
      if (!problem.conserves_energy()) continue;
      const double t = std::tan(data.z[dof] - problem.start->q[dof]);
      values[static_cast<std::size_t>(assembler.diagonal_offsets()[at(dof)])] += rate * problem.mass.rows[dof] * t * t;
      continue;
    }
    const Vector3 w = data.z.segment<3>(dof);
    if (problem.conserves_energy()) {
      // Rows of other forces are multiplied by T = J^-T = I + w^ / 2 + w w^T / 4. Rows of elastic forces are already
      // divided by it.
      const Vector3 moment = data.gradient.segment<3>(dof) - data.elastic_rows.segment<3>(dof),
                    other = cayley_spin(w).transpose() * moment;
      assembler.turn_rows(dof, cayley_spin(w).transpose().inverse(), values);
      assembler.add_block(
          dof, -0.5 * cross_matrix(other) + 0.25 * (w * other.transpose() + w.dot(other) * Matrix3::Identity()),
          values);
    } else {
      const Vector3 moment = problem.mass.rows[dof] * data.acceleration.segment<3>(dof);
      const Matrix3 J = cayley_spin(w).transpose();
      assembler.add_block(
          dof, rate * problem.mass.rows[dof] * (J - Matrix3::Identity()) + cayley_moment_slope(w, moment), values);
    }
  }
}

}  // namespace

Inertia::Inertia(const Model& model, bool exact) {
  if (!exact || model.planar()) return;
  std::vector<int> dofs;
  for (int e = 0; e < model.edge_count; ++e) {
    for (int i = 0; i < 3; ++i) dofs.push_back(model.tail_dof[at(e)] + i);
    dofs.push_back(model.edge_dof[at(e)]);
    for (int i = 0; i < 3; ++i) dofs.push_back(model.head_dof[at(e)] + i);
  }
  edges_ = ElementTable(7, std::move(dofs));
}

void Inertia::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                  std::span<double> values) const {
  if (!problem.moves()) return;
  const int n = problem.model.dof_count;
  const double inverse = 1.0 / problem.interval;
  data.acceleration = inverse * (inverse * (data.z - problem.start->q) - problem.start->v);
  if (problem.held_acceleration.size() != 0) assembler.set_held_part(problem.held_acceleration, data.acceleration);
  multiply(problem.model, problem.mass, data.acceleration, data.inertia);
  if (!problem.model.planar()) add_turning_edges(problem, data);
  if (problem.in_middle()) set_turning_frames(problem, data);
  set_turning_bodies(problem, data);
  const bool turning_too = problem.exact && !values.empty();
  if (turning_too && problem.in_middle()) add_frame_slopes(problem, data, assembler, values);
  data.gradient.head(n) += data.inertia;
  data.row_magnitude.head(n) += data.inertia.cwiseAbs();
  if (values.empty()) return;
  add_mass_matrix(problem, problem.mass, inverse * inverse, assembler, values);
  add_body_slopes(problem, data, assembler, values);
  if (turning_too && !problem.model.planar()) add_edge_slopes(problem, data, edges_, values);
}

void Inertia::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                          StepAdjoint& adjoint) const {
  if (!problem.moves()) return;
  const Model& model = problem.model;
  const double inverse = 1.0 / problem.interval;
  VectorX rows = adjoint.rows;
  if (problem.in_middle() && !model.planar()) {
    for (int e = 0; e < model.edge_count; ++e) rows[model.edge_dof[at(e)]] = 0.0;
    for (int f = 0; f < model.frame_count; ++f) {
      const int dof = model.frame_dof[at(f)];
      rows.segment<3>(dof) = (cayley_spin(data.z.segment<3>(dof)) * rows.segment<3>(dof)).eval();
    }
  }
  add_mass_adjoint(model, data.acceleration, rows, adjoint.coefficients.mass, adjoint.coefficients.mass_coupling);
  VectorX force;
  multiply(model, problem.mass, rows, force);
  adjoint.acceleration = force;
  if (problem.held_acceleration.size() != 0) assembler.project(force);
  adjoint.start -= inverse * inverse * force;
  adjoint.velocity -= inverse * force;
  if (model.planar()) {
    for (int f = 0; problem.conserves_energy() && f < model.frame_count; ++f) {
      const int dof = model.frame_dof[at(f)];
      const double apart = data.z[dof] - problem.start->q[dof], t = std::tan(apart);
      adjoint.start[dof] -= inverse * inverse * problem.mass.rows[dof] * t * t * rows[dof];
      adjoint.coefficients.mass[dof] += inverse * inverse * (t - apart) * rows[dof];
    }
    return;
  }
  TurningForces unit;  // forces of edges with unit moments of inertia
  find_turning(problem, data, VectorX::Ones(model.edge_count), unit);
  for (int e = 0; e < model.edge_count; ++e) add_turning_adjoint(problem, data, unit, e, adjoint);
}

/// Coupling of nodes off the diagonal reduces the diagonal.
void add_mass_matrix(const StepProblem& problem, const MassMatrix& mass, double factor, const Assembler& assembler,
                     std::span<double> values) {
  const Model& model = problem.model;
  const std::vector<std::ptrdiff_t>& diagonal = assembler.diagonal_offsets();
  for (int i = 0; i < model.dof_count; ++i) values[static_cast<std::size_t>(diagonal[at(i)])] += factor * mass.rows[i];
  for (std::size_t b = 0; b < mass.bodies.size(); ++b)
    assembler.add_block(model.frame_dof[at(model.body_frame[b])], factor * mass.bodies[b], values);
  const auto size = static_cast<std::size_t>(model.dimension);
  for (int e = 0; e < model.edge_count; ++e) {
    const double coupling = factor * mass.coupling[e];
    const std::ptrdiff_t* entry = assembler.edge_couplings.data() + at(e) * 4 * size;
    for (std::size_t i = 0; i < size; ++i, entry += 4) {
      values[static_cast<std::size_t>(entry[0])] -= coupling;
      values[static_cast<std::size_t>(entry[1])] -= coupling;
      values[static_cast<std::size_t>(entry[2])] += coupling;
      if (entry[3] >= 0) values[static_cast<std::size_t>(entry[3])] += coupling;
    }
  }
}

void add_explicit_spin_couple(const StepProblem& problem, StepData& data, int edge, const VectorX& v) {
  const Model& model = problem.model;
  const EdgeFrame<double>& f = data.configuration.edge[at(edge)];
  add_to_edge(model, edge,
              spin_couple<double>(problem.parameters->edge_inertia[edge], v[model.edge_dof[at(edge)]],
                                  edge_vector(model, v, edge), f.tangent, f.inverse_length),
              data.gradient);
}

namespace {

/// Visits every angle whose rate comes from a finite rotation: angles of joints in a plane, of edges in space.
template <class Set>
void for_each_turn(const Model& model, const Set& set) {
  if (model.planar())
    for (int f = 0; f < model.frame_count; ++f) set(model.frame_dof[at(f)]);
  else
    for (int e = 0; e < model.edge_count; ++e) set(model.edge_dof[at(e)]);
}

/// Visits the same angles with the `finite_turn` of their change.
template <class Use>
void for_each_finite_turn(const Model& model, const VectorX& change, const Use& use) {
  if (model.planar()) {
    for_each_turn(model, [&](int dof) { use(dof, finite_turn(change[dof])); });
    return;
  }
  constexpr int kSome = 64;
  double turn[kSome];
  for (int first = 0; first < model.edge_count; first += kSome) {
    const int count = std::min(kSome, model.edge_count - first);
    const int* angle = &model.edge_dof[at(first)];
    turning_kernels().finite_turns(count, angle, change.data(), turn);
    for (int i = 0; i < count; ++i) use(angle[i], turn[i]);
  }
}

}  // namespace

void set_turning_velocities(const Model& model, const VectorX& v0, const VectorX& change, double dt, VectorX& v1) {
  for_each_finite_turn(model, change, [&](int dof, double turn) { v1[dof] = 2.0 * turn / dt - v0[dof]; });
}

void set_body_velocities(const Model& model, const VectorX& v0, const VectorX& change, double dt, VectorX& v1) {
  if (model.planar()) return;
  for (int frame : model.body_frame) {
    const int dof = model.frame_dof[at(frame)];
    const Vector3 w = change.segment<3>(dof);
    v1.segment<3>(dof) = (2.0 / dt) * w - cayley(w) * v0.segment<3>(dof);
  }
}

namespace {

/// Moves what is left of the residual at the base of a body into the velocity of its centre of mass. Returns the moment
/// that is left about the base, and on massless copies of the body.
Vector3 balance_base(const StepProblem& problem, const StepData& data, int body, VectorX& v1) {
  const Model& model = problem.model;
  const BodyDescription& of = model.description.bodies[at(body)];
  const double mass = problem.parameters->added_mass(of.center);
  const bool is_carried = std::any_of(model.carried.begin(), model.carried.end(),
                                      [&](const CarriedPart& part) { return part.node == of.node; });
  Vector3 moment = Vector3::Zero();
  for (const Loop& loop : model.loops)
    if (loop.body == body) moment += frame_vector(model, data.residual, loop.copy_frame);
  const auto& bodies = model.description.bodies;
  const bool is_shared = std::any_of(bodies.begin(), bodies.begin() + body,
                                     [&](const BodyDescription& before) { return before.node == of.node; });
  if (is_carried || is_shared || mass == 0.0) return moment;
  const Vector3 force = node_vector(model, data.residual, of.node);
  const Vector3 lever = node_position(model, data.z, of.node) - node_position(model, data.z, of.center);
  put_node_vector(model, of.center, node_vector(model, v1, of.center) - problem.duration() / mass * force, v1);
  return moment + lever.cross(force);
}

}  // namespace

void balance_bodies(const StepProblem& problem, const StepData& data, VectorX& v1) {
  const Model& model = problem.model;
  if (!problem.conserves_energy()) return;
  for (int b = 0; b < static_cast<int>(model.body_frame.size()); ++b) {
    const int dof = model.frame_dof[at(model.body_frame[at(b)])];
    if (problem.mass.rows[dof] == 0.0) continue;  // a copy at a closed loop of joints
    // A loop collects the tolerance of its multipliers, too.
    const Vector3 left = model.loops.empty() ? Vector3(Vector3::Zero()) : balance_base(problem, data, b, v1);
    if (model.planar()) {
      v1[dof] -= problem.duration() * (data.residual[dof] + left.dot(model.plane->normal)) * problem.mass.inverse[dof];
    } else {
      const TurningBody body(problem, data.z, b);
      v1.segment<3>(dof) -=
          problem.duration() * body.inertia.ldlt().solve(Vector3(data.residual.segment<3>(dof) + left));
    }
  }
}

double farthest_turn(const Model& model, const VectorX& q0, const VectorX& q1) {
  double farthest = 0.0;
  for_each_turn(model, [&](int dof) { farthest = std::max(farthest, std::abs(q1[dof] - q0[dof])); });
  return farthest;
}

void set_velocity_rates(const Model& model, const VectorX& change, double dt, VectorX& rates) {
  rates.setConstant(model.dof_count, 2.0 / dt);
  for_each_turn(model, [&](int dof) {
    const double t = std::tan(0.5 * change[dof]);
    rates[dof] *= 1.0 + t * t;
  });
}

/// Component of the mean of an edge's tangents at both ends of a step along the edge in the middle.
double mean_along_middle(const StepProblem& problem, const StepData& data, int edge) {
  const Vec3d mean =
      0.5 * (problem.start_configuration.edge[at(edge)].tangent + data.end_configuration.edge[at(edge)].tangent);
  return dot(mean, data.configuration.edge[at(edge)].tangent);
}

void set_working_change(const StepProblem& problem, const StepData& data, const VectorX& change, VectorX& working) {
  const Model& model = problem.model;
  working = change;
  for_each_finite_turn(model, change, [&](int dof, double turn) { working[dof] = turn; });
  if (model.planar()) return;
  for (int f = 0; f < model.frame_count; ++f) {
    const int dof = model.frame_dof[at(f)];
    working.segment<3>(dof) *= 1.0 + 0.0625 * change.segment<3>(dof).squaredNorm();
  }
  for (int e = 0; e < model.edge_count; ++e) working[model.edge_dof[at(e)]] /= mean_along_middle(problem, data, e);
}

double finite_turn_work(const StepProblem& problem, const StepData& data, const VectorX& change,
                        const VectorX& working) {
  double work = 0.0;
  const auto add = [&](int dof) { work += data.elastic_rows[dof] * (working[dof] - change[dof]); };
  for (const Support& s : problem.model.supports) {
    if (!s.active) continue;
    if (problem.model.planar() && s.frame >= 0) add(problem.model.frame_dof[at(s.frame)]);
    if (problem.model.planar()) continue;
    for (int edge : s.edges) add(problem.model.edge_dof[at(edge)]);
  }
  return work;
}

}  // namespace withe
