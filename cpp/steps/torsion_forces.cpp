#include "steps/torsion_forces.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>

#include "elasticity/discrete_gradient.hpp"
#include "model/drawn_frame.hpp"
#include "steps/discrete_adjoint.hpp"
#include "steps/rounding.hpp"

namespace withe {
namespace {

using D = Dual<kTorsionUnknowns>;
using TorsionLocal = LocalOf<kTorsionUnknowns>;

TorsionSpring torsion_spring_of(const PartNumbers& p, int spring) {
  return {.stiffness = p.torsion_stiffness[spring], .rest_angle = p.torsion_rest_angle[spring]};
}

/// The two edges of a spring, in the order of its description.
std::array<int, 2> edges_of(const Model& model, int spring) {
  const TorsionDescription& d = model.description.torsions[at(spring)];
  return {model.rod_first_edge[at(d.rods[0])] + d.edges[0], model.rod_first_edge[at(d.rods[1])] + d.edges[1]};
}

/// Frame of an edge in space. In a plane, d2 is its normal and d1 = d2 x tangent.
EdgeFrame<double> frame_of(const Model& model, const Configuration& c, int edge) {
  const EdgeFrame<double>& f = c.edge[at(edge)];
  if (!model.planar()) return f;
  const Vec3d t{f.tangent.x, f.tangent.y, 0.0};
  return {t, {-t.y, t.x, 0.0}, {0.0, 0.0, 1.0}, f.inverse_length, {}, {}};
}

/// Components along d1, d2 and tangent of a vector that an edge carries, given as drawn.
Vec3d carried(const Model& model, int edge, const Vector3& drawn) {
  if (!model.planar()) return to_vec3(Vector3(drawn_edge_frame(model, edge).transpose() * drawn));
  const Vector3 t = to_eigen(model.initial_tangent[at(edge)]), &normal = model.plane->normal;
  return {drawn.dot(normal.cross(t)), drawn.dot(normal), drawn.dot(t)};
}

template <class Scalar>
Vec3<Scalar> in_frame(const EdgeFrame<Scalar>& f, const Vec3d& components) {
  return Scalar(components.x) * f.d1 + Scalar(components.y) * f.d2 + Scalar(components.z) * f.tangent;
}

/// Components of the arms of a spring along d1, d2 and tangent of the edges that carry them.
TorsionArms<double> carried_arms(const Model& model, int spring) {
  const TorsionDescription& d = model.description.torsions[at(spring)];
  const auto [first, second] = edges_of(model, spring);
  return {carried(model, first, d.reference), carried(model, first, d.axis.cross(d.reference)),
          carried(model, second, d.reference)};
}

template <class Scalar>
TorsionArms<Scalar> arms_in(const EdgeFrame<Scalar> (&frames)[2], const TorsionArms<double>& carried) {
  return {in_frame(frames[0], carried.u), in_frame(frames[0], carried.v), in_frame(frames[1], carried.w)};
}

/// Energy of a spring between two edges in a configuration [J].
double energy_between(const Model& model, const std::array<int, 2>& edges, const TorsionArms<double>& carried,
                      const TorsionSpring& spring, const Configuration& c) {
  const EdgeFrame<double> frames[2] = {frame_of(model, c, edges[0]), frame_of(model, c, edges[1])};
  return torsion_energy(spring, arms_in(frames, carried));
}

/// Dual number with the derivative `rate` by the unknown at `index`, or a constant for a negative index.
D change(int index, double rate) {
  D d;
  if (index >= 0) d.slope[index] = rate;
  return d;
}

/// Frame with its derivatives: its edge rotates by t x de / l + t (d theta + spin . de).
EdgeFrame<D> moving_frame(const EdgeFrame<double>& f, const TorsionSeat& seat, int dimension, double rate) {
  const auto along = [&](int i) {
    if (i >= dimension) return D();
    return change(seat.head + i, rate) - change(seat.tail + i, rate);
  };
  const Vec3<D> de{along(0), along(1), along(2)};
  const auto constant = [](const Vec3d& v) { return Vec3<D>{v.x, v.y, v.z}; };
  const Vec3<D> t = constant(f.tangent), d1 = constant(f.d1), d2 = constant(f.d2);
  const D about = change(seat.angle, rate) + dot(constant(f.spin), de);
  const Vec3<D> turn = D(f.inverse_length) * cross(t, de) + about * t;
  EdgeFrame<D> out{t + cross(turn, t),   d1 + cross(turn, d1),
                   d2 + cross(turn, d2), f.inverse_length - (f.inverse_length * f.inverse_length) * dot(t, de),
                   constant(f.spin),     constant(f.bow)};
  // spin = - k (s x t) and bow = k (2 + s . t) t + k s with k = 1 / (l (1 + s . t)) give the source s.
  const Vec3d across = f.bow - dot(f.bow, f.tangent) * f.tangent;
  const double half = dot(across, across) / (f.inverse_length * f.inverse_length);  // tan^2 of half the angle to s
  const double k = 0.5 * f.inverse_length * (1.0 + half);
  const Vec3<D> source = constant((1.0 / k) * across + ((1.0 - half) / (1.0 + half)) * f.tangent);
  out.spin = -((out.inverse_length / (1.0 + dot(source, out.tangent))) * cross(source, out.tangent));
  return out;
}

/// Add the rows of the moment on an edge: a force on its head, the opposite one on its tail, and a torque.
void add_rows(const TorsionSeat& seat, int dimension, const Vec3<D>& force, const D& torque,
              D (&rows)[kTorsionUnknowns]) {
  for (int i = 0; i < dimension; ++i) {
    rows[seat.head + i] += force[i];
    rows[seat.tail + i] -= force[i];
  }
  if (seat.angle >= 0) rows[seat.angle] += torque;
}

void put(const D (&rows)[kTorsionUnknowns], bool with_matrix, TorsionLocal& out) {
  for (int i = 0; i < kTorsionUnknowns; ++i) {
    out.gradient[i] = rows[i].value;
    for (int j = 0; with_matrix && j < kTorsionUnknowns; ++j) out.hessian[i][j] = rows[i].slope[j];
  }
}

/// Gradient and Hessian of the energy, or of a torque alone, in a configuration.
void torsion_local(const Model& model, const std::array<TorsionSeat, 2>& seats, const TorsionArms<double>& carried,
                   const TorsionSpring& spring, const Configuration& c, bool with_matrix, TorsionLocal& out) {
  const int n = model.dimension;
  const EdgeFrame<D> frames[2] = {moving_frame(frame_of(model, c, seats[0].edge), seats[0], n, 1.0),
                                  moving_frame(frame_of(model, c, seats[1].edge), seats[1], n, 1.0)};
  const Vec3<D> moment = torsion_moment(spring, arms_in(frames, carried));
  D rows[kTorsionUnknowns];
  for (int k = 0; k < 2; ++k) {
    const Vec3<D> m = k == 0 ? -moment : moment;
    const EdgeFrame<D>& f = frames[k];
    const D torque = dot(m, f.tangent);
    add_rows(seats[at(k)], n, f.inverse_length * cross(m, f.tangent) + torque * f.spin, torque, rows);
  }
  put(rows, with_matrix, out);
}

/// Discrete gradient over an energy-momentum step, and its derivatives by the middle of the step.
void discrete_torsion_local(const Model& model, const std::array<TorsionSeat, 2>& seats,
                            const TorsionArms<double>& carried, const TorsionSpring& spring, const DiscreteStep& step,
                            bool with_matrix, TorsionLocal& out) {
  const int n = model.dimension;
  EdgeFrame<double> start[2];
  EdgeFrame<D> middle[2], end[2];
  for (int k = 0; k < 2; ++k) {
    const TorsionSeat& seat = seats[at(k)];
    start[k] = frame_of(model, step.start, seat.edge);
    middle[k] = moving_frame(frame_of(model, step.middle, seat.edge), seat, n, 1.0);
    end[k] = moving_frame(frame_of(model, step.end, seat.edge), seat, n, 2.0);
  }
  const Vec3<D> moment = discrete_torsion_moment(spring, arms_in(start, carried), arms_in(end, carried));
  const auto constant = [](const Vec3d& v) { return Vec3<D>{v.x, v.y, v.z}; };
  D rows[kTorsionUnknowns];
  for (int k = 0; k < 2; ++k) {
    const Vec3<D> m = k == 0 ? -moment : moment;
    const EdgeFrame<D> from{
        constant(start[k].tangent), constant(start[k].d1), constant(start[k].d2), start[k].inverse_length, {}, {}};
    const MovingEdge<D> edge(from.tangent, from.inverse_length, end[k].tangent, end[k].inverse_length,
                             middle[k].tangent, middle[k].inverse_length,
                             model.planar() ? D() : turn_of_directors(from, end[k]));
    const D torque = edge.torque(m);
    Vec3<D> force = edge.force(m);
    if (step.transported) force += torque * middle[k].spin;
    add_rows(seats[at(k)], n, force, torque, rows);
  }
  put(rows, with_matrix, out);
}

}  // namespace

TorsionForces::TorsionForces(const Model& model) {
  std::vector<int> dofs;
  for (int s = 0; s < static_cast<int>(model.description.torsions.size()); ++s) {
    int own[kTorsionUnknowns], size = 0;
    std::fill(std::begin(own), std::end(own), -1);
    const auto place_of = [&](int first, int count) {
      const auto place = static_cast<int>(std::find(own, own + size, first) - own);
      if (place < size) return place;
      for (int i = 0; i < count; ++i) own[size++] = first + i;
      return place;
    };
    Seats seats;
    for (std::size_t k = 0; k < 2; ++k) {
      const int edge = edges_of(model, s)[k];
      seats[k].edge = edge;
      seats[k].tail = place_of(model.tail_dof[at(edge)], model.dimension);
      if (!model.planar()) seats[k].angle = place_of(model.edge_dof[at(edge)], 1);
      seats[k].head = place_of(model.head_dof[at(edge)], model.dimension);
    }
    seats_.push_back(seats);
    carried_.push_back(carried_arms(model, s));
    dofs.insert(dofs.end(), std::begin(own), std::end(own));
  }
  table_ = ElementTable(kTorsionUnknowns, std::move(dofs));
}

std::string TorsionForces::note() const {
  return std::to_string(table_.count()) + " torsion spring(s): the matrix couples the edges of each";
}

void TorsionForces::add(const StepProblem& problem, StepData& data, const Assembler&, std::span<double> values) const {
  TorsionLocal local;
  for (int s = 0; s < table_.count(); ++s) {
    const TorsionSpring spring = torsion_spring_of(*problem.parameters, s);
    if (spring.stiffness == 0.0) continue;
    const TorsionArms<double>& carried = carried_[at(s)];
    if (problem.conserves_energy())
      discrete_torsion_local(problem.model, seats_[at(s)], carried, spring, discrete_step(problem, data),
                             !values.empty(), local);
    else
      torsion_local(problem.model, seats_[at(s)], carried, spring, data.configuration, !values.empty(), local);
    add_element(table_, s, local, data, values);
    data.potential += energy_between(problem.model, {seats_[at(s)][0].edge, seats_[at(s)][1].edge}, carried, spring,
                                     data.configuration);
    if (!problem.conserves_energy()) continue;
    const int* dofs = table_.dofs(s);
    for (int i = 0; i < kTorsionUnknowns; ++i)
      if (dofs[i] >= 0) data.elastic_rows[dofs[i]] += local.gradient[i];
  }
}

void TorsionForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler&,
                                StepAdjoint& adjoint) const {
  std::optional<DiscreteAdjoint> discrete;
  if (problem.conserves_energy()) discrete.emplace(problem, data, adjoint.rows, adjoint);
  for (int s = 0; s < table_.count(); ++s) {
    const TorsionArms<double>& carried = carried_[at(s)];
    const TorsionSpring spring = torsion_spring_of(*problem.parameters, s);
    double rows[kTorsionUnknowns];
    gather(table_, s, adjoint.rows, rows);
    const auto along = [&](const TorsionSpring& of) {
      TorsionLocal local;
      if (discrete)
        discrete_torsion_local(problem.model, seats_[at(s)], carried, of, discrete_step(problem, data), false, local);
      else
        torsion_local(problem.model, seats_[at(s)], carried, of, data.configuration, false, local);
      double sum = 0.0;
      for (int i = 0; i < kTorsionUnknowns; ++i) sum += rows[i] * local.gradient[i];
      return sum;
    };
    CoefficientAdjoint& by = adjoint.coefficients;
    by.torsion_stiffness[s] += along({.stiffness = 1.0, .rest_angle = spring.rest_angle});
    by.torsion_rest_angle[s] -= spring.stiffness * along({.torque = 1.0});
    if (!discrete) continue;
    Angles angles;
    for (const TorsionSeat& seat : seats_[at(s)]) {
      if (seat.angle < 0) continue;
      angles.place[angles.count] = seat.angle;
      angles.edge[angles.count++] = seat.edge;
    }
    gather(table_, s, discrete->rows(), rows);
    discrete->add_ends<kTorsionUnknowns>(table_, s, rows, angles, [&](const DiscreteStep& step, TorsionLocal& out) {
      discrete_torsion_local(problem.model, seats_[at(s)], carried, spring, step, true, out);
    });
  }
}

/// Rounding of the moments: directions, and angles with them, round by eps |x| / l.
void TorsionForces::add_rounding(const StepProblem& problem, StepData& data) const {
  for (int s = 0; s < table_.count(); ++s) {
    const TorsionSpring spring = torsion_spring_of(*problem.parameters, s);
    const auto inverse_length = [&](const TorsionSeat& seat) { return 1.0 / data.configuration.length[seat.edge]; };
    const Seats& seats = seats_[at(s)];
    const double turns = data.rounding.reach * (inverse_length(seats[0]) + inverse_length(seats[1]));
    const double moment = kRounding * spring.stiffness * (turns + std::numbers::pi + std::abs(spring.rest_angle));
    const int* dofs = table_.dofs(s);
    for (const TorsionSeat& seat : seats) {
      for (int i = 0; i < problem.model.dimension; ++i)
        for (int place : {seat.tail, seat.head}) data.floor[dofs[place + i]] += moment * inverse_length(seat);
      if (seat.angle >= 0) data.floor[dofs[seat.angle]] += moment;
    }
  }
}

double torsion_energy(const Model& model, const PartNumbers& numbers, const Configuration& c, int spring) {
  return energy_between(model, edges_of(model, spring), carried_arms(model, spring), torsion_spring_of(numbers, spring),
                        c);
}

}  // namespace withe
