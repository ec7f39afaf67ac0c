#include "run/journal.hpp"

#include <algorithm>
#include <string>

namespace withe {
namespace {

constexpr const char* kFriction =
    "anchored or semi-explicit friction acts; use friction_model='implicit' or "
    "'lagged', or friction=0";
constexpr const char* kFrictionChanged =
    "friction, or a coefficient of a pair of bodies, was added or removed during "
    "the run; begin a new run at the change";
constexpr const char* kRestitution = "impacts lose energy by their restitution; use restitution=1";

bool known_friction(FrictionLaw law) { return law == FrictionLaw::implicit || law == FrictionLaw::lagged; }

bool loses_in_impacts(const ContactDescription& contact) {
  const auto loses = [](double restitution) { return restitution >= 0.0 && restitution < 1.0; };
  return loses(contact.restitution) || (contact.obstacle_restitution.array() < 1.0).any() ||
         std::any_of(contact.pairs.begin(), contact.pairs.end(), [&](const auto& p) { return loses(p.restitution); });
}

/// Reason why a step with contact has no gradient; none where it has one.
const char* unknown_to_gradients(const Contact& contact, const ContactDescription& description) {
  if (contact.frictional() && !known_friction(description.friction_law)) return kFriction;
  if (loses_in_impacts(description)) return kRestitution;
  return nullptr;
}

/// Shares of their ways that moving supports and obstacles have gone.
Reached reached(const Settings& settings, const Moving& now) {
  Reached out;
  const double time = now.state.time;
  const auto moves = [&](const auto& m) { return time < std::max(m.shift.end, m.turn.end); };
  if (std::any_of(now.motions.begin(), now.motions.end(), moves)) {
    out.supports.resize(static_cast<Eigen::Index>(now.motions.size()), 2);
    for (Eigen::Index s = 0; s < out.supports.rows(); ++s) {
      const SupportMotion& m = now.motions[static_cast<std::size_t>(s)];
      out.supports.row(s) << m.shift.fraction(time), m.turn.fraction(time);
    }
  }
  const std::vector<ObstacleMotion>& obstacles = settings.obstacle_motions;
  if (std::any_of(obstacles.begin(), obstacles.end(), moves)) {
    out.obstacles.resize(static_cast<Eigen::Index>(obstacles.size()));
    for (Eigen::Index o = 0; o < out.obstacles.size(); ++o)
      out.obstacles(o) = obstacles[static_cast<std::size_t>(o)].shift.fraction(time);
  }
  return out;
}

}  // namespace

bool has_rings(const Model& model) {
  return std::any_of(model.supports.begin(), model.supports.end(),
                     [](const Support& s) { return s.active && s.slides(); });
}

std::shared_ptr<Tape> start_tape(const Model& model, const Options& options, const Contact* contact,
                                 const Settings& settings, const Moving& now) {
  auto tape = std::make_shared<Tape>(model, equation_options(options), now.state, settings.parameters,
                                     contact && contact->frictional(), poses_of(now.motions));
  if (options.integrator == Integrator::verlet || options.integrator == Integrator::statics)
    tape->refuse("integrator '" + std::string(options.integrator == Integrator::verlet ? "verlet" : "static") +
                 "' has no gradients; use another integrator");
  if (has_rings(model)) tape->refuse(kRingHasNoGradient);
  if (contact)
    if (const char* unknown = unknown_to_gradients(*contact, model.description.contact)) tape->refuse(unknown);
  return tape;
}

void check_tape(Tape& tape, const State& state, const Parameters& parameters) {
  if (!tape.continues(state)) tape.refuse("the state was changed during the run; begin a new run at the change");
  if (!tape.has_loads(parameters))
    tape.refuse("loads were added or removed during the run; begin a new run at the change");
}

void record_step(Tape& tape, const Model& model, const Contact* contact, const Settings& settings, const Moving& now,
                 const JournalEntry& step) {
  const char* unknown = nullptr;
  if (contact) {
    const ContactDescription& description = model.description.contact;
    unknown = unknown_to_gradients(*contact, description);
    if (!unknown && !tape.has_friction(description, contact->frictional())) unknown = kFrictionChanged;
    if (!unknown && !contact->has_given_stiffness(now.state)) unknown = kStiffnessHasNoGradient;
  }
  tape.record({step.rule, step.dt, step.move, now.state, settings.parameters, reached(settings, now),
               poses_of(now.motions), step.begins, unknown, step.rule == StepRule::midpoint});
}

}  // namespace withe
