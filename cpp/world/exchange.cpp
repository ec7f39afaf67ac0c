#include "world/exchange.hpp"

#include "world/archive.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// The number of items.
template <class Archive, class Items>
void exchange_size(Archive& io, Items& items, std::int64_t most, const char* impossible) {
  auto size = static_cast<std::int64_t>(items.size());
  io(size);
  require(size >= 0 && size < most, impossible);
  items.resize(static_cast<std::size_t>(size));
}

template <class Archive>
void exchange_contacts(Archive& io, std::vector<ContactRecord>& contacts) {
  exchange_size(io, contacts, 1 << 28, "snapshot is damaged: impossible number of contacts");
  for (auto& [key, force, stiffness, yielded, approach, age, stick, roll, friction, sticking] : contacts) {
    io(key.a), io(key.b), io(key.end), io(force), io(stiffness), io(yielded), io(approach), io(age);
    for (Vec3d* v : {&stick, &roll, &friction}) io(v->x), io(v->y), io(v->z);
    io(sticking);
  }
}

// Members are named one by one, by structured bindings: one that is added and not named here does not compile.

template <class Archive>
void exchange(Archive& io, Vec3d& v) {
  io(v.x), io(v.y), io(v.z);
}

/// A vector of any size; an archive that ends too early is refused.
template <class Archive>
void exchange(Archive& io, VectorX& v) {
  auto size = static_cast<std::int64_t>(v.size());
  io(size);
  require(size >= 0 && size < 1 << 28, "snapshot is damaged: impossible size");
  v.resize(size);
  io(v);
}

template <class Archive>
void exchange(Archive& io, std::optional<Energy>& energy) {
  bool known = energy.has_value();
  io(known);
  if (!known) {
    energy.reset();
    return;
  }
  if (!energy) energy.emplace();
  auto& [kinetic, stretch, bend, twist, gravity, loads, contact, spring, total, work, dissipated] = *energy;
  for (double* x : {&kinetic, &stretch, &bend, &twist, &gravity, &loads, &contact, &spring, &total, &work, &dissipated})
    io(*x);
}

/// Parameters that users may set; all others follow from these. Contact is that of the drawing where it was not set:
/// see `write_contact`.
template <class Archive>
void exchange(Archive& io, const Model& model, Parameters& p) {
  for (const ParameterInfo& info : parameter_index()) {
    if (info.of_contact()) continue;
    for (int owner = 0; owner < owners_of(model, info); ++owner) {
      ParameterView values = parameter_view(model, p, info.kind, owner);
      io(values);
    }
  }
  io(p.held_lumped);
}

template <class Archive>
void exchange(Archive& io, Span& span) {
  io(span.start), io(span.end);
}

template <class Archive>
void exchange(Archive& io, const Model& model, Settings& settings) {
  auto& [parameters, ramps, obstacle_motions, actuation_before, actuation_changed] = settings;
  exchange(io, model, parameters);
  const auto exchange_ramp = [&](auto& ramp) {
    auto& [from, to, start, end, active] = ramp;
    io(from), io(to), io(start), io(end), io(active);
  };
  for (auto& [curvature, twist, stretch] : ramps.natural)
    exchange_ramp(curvature), exchange_ramp(twist), exchange_ramp(stretch);
  exchange_size(io, ramps.numbers, 1 << 20, "snapshot is damaged: impossible ramp");
  for (auto& [kind, part, from, to, span] : ramps.numbers) {
    int number = static_cast<int>(kind);
    io(number), io(part), io(from), io(to);
    exchange(io, span);
    const auto index = parameter_index();
    require(number >= 0 && number < static_cast<int>(index.size()) && index[at(number)].number && part >= 0 &&
                part < owners_of(model, index[at(number)]) && std::isfinite(from) && std::isfinite(to),
            "snapshot is damaged: impossible ramp");
    kind = static_cast<ParameterKind>(number);
  }
  for (auto& [from, to, shift, turn] : obstacle_motions) {
    for (ObstacleWay* way : {&from, &to}) io(way->shift), io(way->turn);
    exchange(io, shift), exchange(io, turn);
  }
  for (MatrixX2& curvature : actuation_before.curvature) io(curvature);
  for (VectorX& twist : actuation_before.twist) io(twist);
  io(actuation_before.stretch), io(actuation_before.tension), io(actuation_changed);
}

template <class Archive>
void exchange(Archive& io, HandState& hand) {
  constexpr const char* kImpossible = "snapshot is damaged: impossible hand";
  auto& [position, rotation, points, edges, slip, twist, ring] = hand;
  io(position), io(rotation);
  exchange_size(io, points, 1 << 28, kImpossible);
  for (Vector3& point : points) io(point);
  exchange_size(io, edges, 1 << 28, kImpossible);
  for (Matrix3& edge : edges) io(edge);
  exchange_size(io, slip, 1 << 28, kImpossible);
  for (Vector3& by : slip) io(by);
  exchange(io, twist);
  auto& [place, origin, fed, slid, left] = ring;
  io(place.piece), io(place.along), io(place.beyond), io(origin), io(fed), io(slid), io(left);
}

template <class Archive>
void exchange(Archive& io, State& state) {
  auto& [time, q, v, acceleration, acceleration_current, load_force, friction_force, tangent, director, frame, bend_tau,
         half_tau, contacts, obstacles, hands, contact_stiffness, motion, stop_rates] = state;
  io(time), io(q), io(v), io(acceleration), io(acceleration_current);
  exchange(io, load_force);
  exchange(io, friction_force);
  for (auto& t : tangent) exchange(io, t);
  for (auto& d : director) exchange(io, d);
  for (auto& f : frame) io(f);
  io(bend_tau), io(half_tau);
  exchange_contacts(io, contacts);
  for (auto& [point, other, turn, velocity] : obstacles)
    exchange(io, point), exchange(io, other), exchange(io, turn), exchange(io, velocity);
  for (HandState& hand : hands) exchange(io, hand);
  io(contact_stiffness);
  auto& [known, velocity, times] = motion;
  io(known);
  for (int i : {0, 1}) io(velocity[i]), io(times[i]);
  exchange(io, stop_rates);
}

/// Wrenches of supports.
template <class Archive>
void exchange(Archive& io, std::vector<Wrench>& wrenches) {
  exchange_size(io, wrenches, 1 << 20, "snapshot is damaged: impossible number of supports");
  for (auto& [force, moment] : wrenches) io(force), io(moment);
}

template <class Archive>
void exchange(Archive& io, Moving& moving) {
  auto& [state, predictor, motions, ledger, impulses, joint_impulses, impulse_time] = moving;
  exchange(io, state);
  predictor.exchange(io);
  for (auto& motion : motions) {
    auto& [position, rotation, from_position, to_position, from_rotation, to_rotation, roll, shift, turn, stretch, fed,
           fed_before, feed_rate, feeds_since] = motion;
    io(position), io(rotation), io(from_position), io(to_position), io(from_rotation), io(to_rotation);
    io(roll), exchange(io, shift), exchange(io, turn), io(stretch), io(fed), io(fed_before), io(feed_rate),
        io(feeds_since);
  }
  auto& [support_work, actuation_work, dissipated, load_work] = ledger;
  for (double* x : {&support_work, &actuation_work, &dissipated, &load_work, &impulse_time}) io(*x);
  exchange(io, impulses);
  exchange(io, joint_impulses);
}

template <class Archive>
void exchange(Archive& io, StepHistory& history) {
  auto& [lengths, grid_origin, grid_steps, steps_taken, contact_guard, step_watch, first_energy, greatest_kinetic] =
      history;
  auto& [level, easy_steps, patience, grown, composed, error_rates, mean_step, event_reserve] = lengths;
  io(level), io(easy_steps), io(patience), io(grown), io(composed), io(error_rates[0]), io(error_rates[1]),
      io(mean_step), io(event_reserve), io(grid_origin), io(grid_steps), io(steps_taken);
  auto& [greatest, gained, put_in] = contact_guard;
  io(greatest), io(gained), io(put_in);
  auto& [change, motion, most, pull, moved, acceleration] = step_watch;
  for (VectorX* v : {&change, &motion, &most, &pull, &moved, &acceleration}) exchange(io, *v);
  exchange(io, first_energy);
  io(greatest_kinetic);
}

template <class Archive>
void exchange(Archive& io, Found& found) {
  auto& [custom_force, custom_moments, reaction_residual, reaction_place, hand_wrenches, joint_wrenches, tensions,
         reaction_current] = found;
  io(custom_force), io(custom_moments), io(reaction_residual), io(reaction_place), io(reaction_current);
  exchange(io, hand_wrenches);
  exchange(io, joint_wrenches);
  exchange(io, tensions);
}

template <class Archive>
void exchange(Archive& io, std::vector<ContactKey>& keys) {
  exchange_size(io, keys, 1 << 28, "snapshot is damaged: impossible number of contacts");
  for (auto& [a, b, end] : keys) io(a), io(b), io(end);
}

template <class Archive>
void exchange(Archive& io, StokesletFluid::Memory& memory) {
  auto& [solution, past, known, factorized_at, iterations, fresh_iterations, wave, excess, waited, regularization] =
      memory;
  for (VectorX* v : {&solution, &past[0], &past[1], &factorized_at, &wave}) exchange(io, *v);
  io(known), io(iterations), io(fresh_iterations), io(excess), io(waited), io(regularization);
}

template <class Archive>
void exchange(Archive& io, EquationsMemory& memory) {
  auto& [ordered, coupled, groups, matrix, flow_excess, fluid] = memory;
  exchange(io, ordered);
  exchange(io, coupled);
  exchange_size(io, groups, 1 << 28, "snapshot is damaged: impossible number of groups");
  for (std::vector<int>& group : groups) {
    exchange_size(io, group, 1 << 10, "snapshot is damaged: impossible group");
    for (int& unknown : group) io(unknown);
  }
  io(matrix);
  io(flow_excess);
  exchange(io, fluid);
}

template <class Archive>
void exchange(Archive& io, MatrixHistory& history) {
  auto& [interval, contraction, waited, slow] = history;
  io(interval);
  for (double& rate : contraction) io(rate);
  io(waited), io(slow);
}

template <class Archive>
void exchange(Archive& io, GuessRecords& records) {
  for (auto& [misses, waits] : records) io(misses), io(waits);
}

}  // namespace

template <class Archive>
void exchange(Archive& io, const Model& model, Running& running) {
  exchange(io, model, static_cast<Settings&>(running));
  exchange(io, static_cast<Moving&>(running));
  exchange(io, static_cast<StepHistory&>(running));
  exchange(io, static_cast<Found&>(running));
}

template <class Archive>
void exchange(Archive& io, Lagged& lagged) {
  auto& [matrix, guesses, owner, systems] = lagged;
  exchange(io, matrix);
  exchange(io, guesses);
  int number = owner ? static_cast<int>(*owner) : -1;
  io(number);
  require(number >= -1 && number < static_cast<int>(kSystems.size()), "snapshot is damaged: unknown equations");
  if (number >= 0) owner = static_cast<System>(number);
  for (auto& memory : systems) {
    bool known = memory.has_value();
    io(known);
    if (known && !memory) memory.emplace();
    if (known) exchange(io, *memory);
  }
}

template void exchange(Writer&, const Model&, Running&);
template void exchange(Reader&, const Model&, Running&);
template void exchange(Writer&, Lagged&);
template void exchange(Reader&, Lagged&);

}  // namespace withe
