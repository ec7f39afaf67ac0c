// Inertia of edges that spin and turn, and of frames.

#include "steps/inertia.hpp"

#include <cmath>

#include "geometry/rotation.hpp"

namespace withe {
namespace {

/// What an angle of a step counts for where the middle of the step is that of a rotation: of its Cayley vector.
double finite_turn(double angle) { return 2.0 * std::tan(0.5 * angle); }

/// An edge that spins at omega and turns also needs the couple I omega t x dt/dt: nodal forces
/// +- I omega (dt/dt x t) / l, which do no work; this one acts at its head.
Vec3d spin_couple(const StepProblem& problem, const StepData& data, int edge, double omega, const Vec3d& rate) {
  const EdgeFrame<double>& f = data.configuration.edge[at(edge)];
  return (problem.parameters->edge_inertia[edge] * omega * f.inverse_length * f.inverse_length) *
         cross(rate, f.tangent);
}

void add_couple(const Model& model, int edge, const Vec3d& force, VectorX& gradient) {
  double *tail = &gradient[model.tail_dof[at(edge)]], *head = &gradient[model.head_dof[at(edge)]];
  const double component[3] = {force.x, force.y, force.z};
  for (int i = 0; i < 3; ++i) {
    head[i] += component[i];
    tail[i] -= component[i];
  }
}

/// Its Jacobian is left out: it is a small part of the mass term.
void add_spin_couple(const StepProblem& problem, StepData& data) {
  const Model& model = problem.model;
  const VectorX& z = data.z;
  const double inverse = 1.0 / problem.interval;
  const double *q0 = problem.start->q.data(), *v0 = problem.start->v.data();
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)], angle = model.edge_dof[at(e)];
    const double omega = (z[angle] - q0[angle]) * inverse;
    const Vec3d change{z[b] - z[a] - q0[b] + q0[a], z[b + 1] - z[a + 1] - q0[b + 1] + q0[a + 1],
                       z[b + 2] - z[a + 2] - q0[b + 2] + q0[a + 2]};
    // psi = theta + spin . e is what turns: the edge's inertia acts on the nodes as its elastic torque does. It does no
    // work either, since spin is normal to the edge before and now.
    const double torque = problem.parameters->edge_inertia[e] * (omega - v0[angle]) * inverse;
    add_couple(model, e,
               spin_couple(problem, data, e, omega, inverse * change) + torque * data.configuration.edge[at(e)].spin,
               data.gradient);
  }
}

/// Inertia of spinning edges and of frames in a step under the midpoint rules, such that angular momentum is kept
/// exactly. The spin's part of it, I omega t, changes in a step by dt m, m = I (omega1 t1 - omega0 t0) / dt: nodes and
/// angle of the edge take that moment like any other, about where the edge is in the middle. In energy-momentum steps
/// omega is 2 tan(D theta / 2) / dt, as in a rigid rotation of the whole, and an axial force that vanishes with the
/// square of the step makes the work of m what kinetic energy changes by. Jacobians are left out: they are a small part
/// of the mass term.
void set_turning_inertia(const StepProblem& problem, StepData& data) {
  const Model& model = problem.model;
  const VectorX& z = data.z;
  const double dt = 2.0 * problem.interval, inverse = 1.0 / dt;
  if (model.planar()) {
    for (int f = 0; problem.conserves_energy() && f < model.frame_count; ++f) {
      const int dof = model.frame_dof[at(f)];
      const double change = 2.0 * (z[dof] - problem.start->q[dof]);
      data.inertia[dof] += 2.0 * problem.mass.rows[dof] * inverse * inverse * (finite_turn(change) - change);
    }
    return;
  }
  const double *q0 = problem.start->q.data(), *v0 = problem.start->v.data();
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)], angle = model.edge_dof[at(e)];
    const EdgeFrame<double>& middle = data.configuration.edge[at(e)];
    const Vec3d& t0 = problem.start->tangent[at(e)];
    Vec3d t1;
    if (problem.conserves_energy()) {
      t1 = data.end_configuration.edge[at(e)].tangent;
    } else {
      const Vec3d e1{2.0 * (z[b] - z[a]) - q0[b] + q0[a], 2.0 * (z[b + 1] - z[a + 1]) - q0[b + 1] + q0[a + 1],
                     2.0 * (z[b + 2] - z[a + 2]) - q0[b + 2] + q0[a + 2]};
      t1 = (1.0 / std::sqrt(dot(e1, e1))) * e1;
    }
    const double change = 2.0 * (z[angle] - q0[angle]);
    const double turn = problem.conserves_energy() ? finite_turn(change) : change;
    const double inertia = problem.mass.rows[angle];
    const Vec3d moment = (inertia * inverse) * ((2.0 * inverse * turn - v0[angle]) * t1 - v0[angle] * t0);
    const double torque = dot(moment, middle.tangent);
    data.inertia[angle] = torque;
    Vec3d force = middle.inverse_length * cross(moment, middle.tangent);
    // An edge's torque turns its nodes by spin . e as well; that of inertia takes back what all others do.
    force += torque * middle.spin;
    if (problem.conserves_energy()) {
      const Vec3d apart = t1 - t0;
      const double mean = 0.5 * (problem.start_configuration.length[e] + data.end_configuration.length[e]),
                   cosine = 0.5 * dot(t0 + t1, middle.tangent);
      const double rate = inverse * turn;
      force -= (inertia * rate * rate * dot(apart, apart) / (4.0 * mean * cosine)) * middle.tangent;
    }
    add_couple(model, e, force, data.gradient);
  }
  for (int f = 0; f < model.frame_count; ++f) {
    const int dof = model.frame_dof[at(f)];
    const Matrix3 J = cayley_spin(z.segment<3>(dof)).transpose();
    if (problem.conserves_energy()) {  // whose rows are moments
      const Vector3 other = data.gradient.segment<3>(dof) - data.elastic_rows.segment<3>(dof);
      data.gradient.segment<3>(dof) += J.inverse() * other - other;
    } else {
      data.inertia.segment<3>(dof) = (J * data.inertia.segment<3>(dof)).eval();
    }
  }
}

}  // namespace

void Inertia::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                  std::span<double> values) const {
  if (!problem.moves()) return;
  const int n = problem.model.dof_count;
  const double inverse = 1.0 / problem.interval;
  data.acceleration = inverse * (inverse * (data.z - problem.start->q) - problem.start->v);
  if (problem.held_acceleration.size() != 0) {
    assembler.project(data.acceleration);
    assembler.add_held_part(problem.held_acceleration, 1.0, data.acceleration);
  }
  multiply(problem.model, problem.mass, data.acceleration, data.inertia);
  if (problem.in_middle())
    set_turning_inertia(problem, data);
  else if (!problem.model.planar())
    add_spin_couple(problem, data);
  data.gradient.head(n) += data.inertia;
  data.row_magnitude.head(n) += data.inertia.cwiseAbs();
  if (!values.empty()) add_mass_matrix(problem, problem.mass, inverse * inverse, assembler, values);
}

/// What couples nodes off the diagonal is less on it.
void add_mass_matrix(const StepProblem& problem, const MassMatrix& mass, double factor, const Assembler& assembler,
                     std::span<double> values) {
  const Model& model = problem.model;
  const std::vector<std::ptrdiff_t>& diagonal = assembler.diagonal_offsets();
  for (int i = 0; i < model.dof_count; ++i) values[static_cast<std::size_t>(diagonal[at(i)])] += factor * mass.rows[i];
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
  const int a = model.tail_dof[at(edge)], b = model.head_dof[at(edge)];
  const Vec3d rate{v[b] - v[a], v[b + 1] - v[a + 1], v[b + 2] - v[a + 2]};
  add_couple(model, edge, spin_couple(problem, data, edge, v[model.edge_dof[at(edge)]], rate), data.gradient);
}

void set_turning_velocities(const StepProblem& problem, const VectorX& change, double dt, VectorX& v1) {
  const auto set = [&](int dof) { v1[dof] = 2.0 * finite_turn(change[dof]) / dt - problem.start->v[dof]; };
  if (problem.model.planar())
    for (int f = 0; f < problem.model.frame_count; ++f) set(problem.model.frame_dof[at(f)]);
  else
    for (int e = 0; e < problem.model.edge_count; ++e) set(problem.model.edge_dof[at(e)]);
}

/// 2 tan(D theta / 2) over how much of the mean of an edge's tangents lies along it in the middle.
double working_turn(const StepProblem& problem, const StepData& data, int edge, double change) {
  const Vec3d mean =
      0.5 * (problem.start_configuration.edge[at(edge)].tangent + data.end_configuration.edge[at(edge)].tangent);
  return finite_turn(change) / dot(mean, data.configuration.edge[at(edge)].tangent);
}

void set_working_change(const StepProblem& problem, const StepData& data, const VectorX& change, VectorX& working) {
  working = change;
  for (int f = 0; f < problem.model.frame_count; ++f) {
    const int dof = problem.model.frame_dof[at(f)];
    if (problem.model.planar())
      working[dof] = finite_turn(change[dof]);
    else
      working.segment<3>(dof) *= 1.0 + 0.0625 * change.segment<3>(dof).squaredNorm();
  }
  for (int e = 0; !problem.model.planar() && e < problem.model.edge_count; ++e) {
    const int dof = problem.model.edge_dof[at(e)];
    working[dof] = working_turn(problem, data, e, change[dof]);
  }
}

void set_working_rows(const StepProblem& problem, const StepData& data, const VectorX& change, VectorX& rows) {
  const auto ratio = [](double turn, double angle) { return std::abs(angle) < 1e-8 ? 1.0 : turn / angle; };
  for (const Support& s : problem.model.supports) {
    if (!s.active) continue;
    if (problem.model.planar() && s.frame >= 0) {
      const int dof = problem.model.frame_dof[at(s.frame)];
      rows[dof] += data.elastic_rows[dof] * (ratio(finite_turn(change[dof]), change[dof]) - 1.0);
    } else if (!problem.model.planar() && s.other_node >= 0) {
      const int dof = problem.model.edge_dof[at(s.edge)];
      rows[dof] +=
          data.elastic_rows[dof] * (ratio(working_turn(problem, data, s.edge, change[dof]), change[dof]) - 1.0);
    }
  }
}

}  // namespace withe
