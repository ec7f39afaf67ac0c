// Inertia of edges that spin and turn, and of frames.

#include <cmath>

#include "geometry/rotation.hpp"
#include "integrators/equations.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// What an angle of a step counts for where the middle of the step is that of a rotation: of its Cayley vector.
double finite_turn(double angle) { return 2.0 * std::tan(0.5 * angle); }

}  // namespace

/// An edge that spins at omega and turns also needs the couple I omega t x dt/dt: nodal forces
/// +- I omega (dt/dt x t) / l, which do no work; this one acts at its head.
Vec3d Equations::spin_couple(int edge, double omega, const Vec3d& rate) const {
  const EdgeFrame<double>& f = middle_.edge[at(edge)];
  return (parameters_->edge_inertia[edge] * omega * f.inverse_length * f.inverse_length) * cross(rate, f.tangent);
}

void Equations::add_couple(int edge, const Vec3d& force) {
  double *tail = &gradient_[model_.tail_dof[at(edge)]], *head = &gradient_[model_.head_dof[at(edge)]];
  const double component[3] = {force.x, force.y, force.z};
  for (int i = 0; i < 3; ++i) {
    head[i] += component[i];
    tail[i] -= component[i];
  }
}

/// Its Jacobian is left out: it is a small part of the mass term.
void Equations::add_spin_couple(const VectorX& z) {
  const double inverse = 1.0 / h_;
  const double *q0 = state_->q.data(), *v0 = state_->v.data();
  for (int e = 0; e < model_.edge_count; ++e) {
    const int a = model_.tail_dof[at(e)], b = model_.head_dof[at(e)], angle = model_.edge_dof[at(e)];
    const double omega = (z[angle] - q0[angle]) * inverse;
    const Vec3d change{z[b] - z[a] - q0[b] + q0[a], z[b + 1] - z[a + 1] - q0[b + 1] + q0[a + 1],
                       z[b + 2] - z[a + 2] - q0[b + 2] + q0[a + 2]};
    // psi = theta + spin . e is what turns: the edge's inertia acts on the nodes as its elastic torque does. It does no
    // work either, since spin is normal to the edge before and now.
    const double torque = parameters_->edge_inertia[e] * (omega - v0[angle]) * inverse;
    add_couple(e, spin_couple(e, omega, inverse * change) + torque * middle_.edge[at(e)].spin);
  }
}

/// Inertia of spinning edges and of frames in a step under the midpoint rules, such that angular momentum is kept
/// exactly. The spin's part of it, I omega t, changes in a step by dt m, m = I (omega1 t1 - omega0 t0) / dt: nodes and
/// angle of the edge take that moment like any other, about where the edge is in the middle. In energy-momentum steps
/// omega is 2 tan(D theta / 2) / dt, as in a rigid rotation of the whole, and an axial force that vanishes with the
/// square of the step makes the work of m what kinetic energy changes by. Jacobians are left out: they are a small part
/// of the mass term.
void Equations::set_turning_inertia(const VectorX& z) {
  const double dt = 2.0 * h_, inverse = 1.0 / dt;
  if (model_.planar()) {
    for (int f = 0; energy_momentum_ && f < model_.frame_count; ++f) {
      const int dof = model_.frame_dof[at(f)];
      const double change = 2.0 * (z[dof] - state_->q[dof]);
      inertia_[dof] += 2.0 * mass_.rows[dof] * inverse * inverse * (finite_turn(change) - change);
    }
    return;
  }
  const double *q0 = state_->q.data(), *v0 = state_->v.data();
  for (int e = 0; e < model_.edge_count; ++e) {
    const int a = model_.tail_dof[at(e)], b = model_.head_dof[at(e)], angle = model_.edge_dof[at(e)];
    const EdgeFrame<double>& middle = middle_.edge[at(e)];
    const Vec3d& t0 = state_->tangent[at(e)];
    Vec3d t1;
    if (energy_momentum_) {
      t1 = end_.edge[at(e)].tangent;
    } else {
      const Vec3d e1{2.0 * (z[b] - z[a]) - q0[b] + q0[a], 2.0 * (z[b + 1] - z[a + 1]) - q0[b + 1] + q0[a + 1],
                     2.0 * (z[b + 2] - z[a + 2]) - q0[b + 2] + q0[a + 2]};
      t1 = (1.0 / std::sqrt(dot(e1, e1))) * e1;
    }
    const double change = 2.0 * (z[angle] - q0[angle]);
    const double turn = energy_momentum_ ? finite_turn(change) : change;
    const double inertia = mass_.rows[angle];
    const Vec3d moment = (inertia * inverse) * ((2.0 * inverse * turn - v0[angle]) * t1 - v0[angle] * t0);
    const double torque = dot(moment, middle.tangent);
    inertia_[angle] = torque;
    Vec3d force = middle.inverse_length * cross(moment, middle.tangent);
    // An edge's torque turns its nodes by spin . e as well; that of inertia takes back what all others do.
    force += torque * middle.spin;
    if (energy_momentum_) {
      const Vec3d apart = t1 - t0;
      const double mean = 0.5 * (start_.length[e] + end_.length[e]), cosine = 0.5 * dot(t0 + t1, middle.tangent);
      const double rate = inverse * turn;
      force -= (inertia * rate * rate * dot(apart, apart) / (4.0 * mean * cosine)) * middle.tangent;
    }
    add_couple(e, force);
  }
  for (int f = 0; f < model_.frame_count; ++f) {
    const int dof = model_.frame_dof[at(f)];
    const Matrix3 J = cayley_spin(z.segment<3>(dof)).transpose();
    if (energy_momentum_) {  // whose rows are moments
      const Vector3 other = gradient_.segment<3>(dof) - elastic_rows_.segment<3>(dof);
      gradient_.segment<3>(dof) += J.inverse() * other - other;
    } else {
      inertia_.segment<3>(dof) = (J * inertia_.segment<3>(dof)).eval();
    }
  }
}

void Equations::set_turning_velocities(const VectorX& change, double dt, VectorX& v1) const {
  const auto set = [&](int dof) { v1[dof] = 2.0 * finite_turn(change[dof]) / dt - state_->v[dof]; };
  if (model_.planar())
    for (int f = 0; f < model_.frame_count; ++f) set(model_.frame_dof[at(f)]);
  else
    for (int e = 0; e < model_.edge_count; ++e) set(model_.edge_dof[at(e)]);
}

/// 2 tan(D theta / 2) over how much of the mean of an edge's tangents lies along it in the middle.
double Equations::working_turn(int edge, double change) const {
  const Vec3d mean = 0.5 * (start_.edge[at(edge)].tangent + end_.edge[at(edge)].tangent);
  return finite_turn(change) / dot(mean, middle_.edge[at(edge)].tangent);
}

const VectorX& Equations::working_change(const VectorX& change) {
  working_change_ = change;
  for (int f = 0; f < model_.frame_count; ++f) {
    const int dof = model_.frame_dof[at(f)];
    if (model_.planar())
      working_change_[dof] = finite_turn(change[dof]);
    else
      working_change_.segment<3>(dof) *= 1.0 + 0.0625 * change.segment<3>(dof).squaredNorm();
  }
  for (int e = 0; !model_.planar() && e < model_.edge_count; ++e) {
    const int dof = model_.edge_dof[at(e)];
    working_change_[dof] = working_turn(e, change[dof]);
  }
  return working_change_;
}

void Equations::set_working_rows(const VectorX& change, VectorX& rows) const {
  const auto ratio = [](double turn, double angle) { return std::abs(angle) < 1e-8 ? 1.0 : turn / angle; };
  for (const Support& s : model_.supports) {
    if (!s.active) continue;
    if (model_.planar() && s.frame >= 0) {
      const int dof = model_.frame_dof[at(s.frame)];
      rows[dof] += elastic_rows_[dof] * (ratio(finite_turn(change[dof]), change[dof]) - 1.0);
    } else if (!model_.planar() && s.other_node >= 0) {
      const int dof = model_.edge_dof[at(s.edge)];
      rows[dof] += elastic_rows_[dof] * (ratio(working_turn(s.edge, change[dof]), change[dof]) - 1.0);
    }
  }
}

}  // namespace withe
