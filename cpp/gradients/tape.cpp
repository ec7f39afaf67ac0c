#include "gradients/tape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "gradients/state_vector.hpp"
#include "integrators/dynamics.hpp"
#include "model/edge_vectors.hpp"
#include "steps/inertia.hpp"

namespace withe {
namespace {

/// Distance of stored states in steps; the states in between are replayed.
constexpr std::size_t kStretch = 100;
constexpr double kRounding = 1e-12;  // motion of resting supports, over the scene's length; and of angles

MatrixX3 at_nodes(const Model& model, const VectorX& by) {
  MatrixX3 out(model.node_count, 3);
  for (int i = 0; i < model.node_count; ++i) out.row(i) = node_vector(model, by, i).transpose();
  return out;
}

/// Takes hands of a state to where they are.
void place_hands(const std::vector<SupportPose>& poses, State& state) {
  for (std::size_t s = 0; s < poses.size(); ++s) {
    state.hands[s].position = poses[s].position;
    state.hands[s].rotation = poses[s].rotation;
  }
}

std::vector<SupportPose> poses_of(const State& state) {
  std::vector<SupportPose> poses;
  for (const HandState& hand : state.hands) poses.push_back({hand.position, hand.rotation});
  return poses;
}

bool same_poses(const std::vector<SupportPose>& a, const std::vector<SupportPose>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const SupportPose& one, const SupportPose& other) {
    return one.position == other.position && one.rotation == other.rotation;
  });
}

}  // namespace

/// Goes through the states of a run again, and back.
class Tape::Player {
 public:
  explicit Player(const Tape& tape) : tape_(tape), model_(tape.model_) {}

  /// The gradient of a step's rule, made when it is first met.
  StepGradient& gradient(StepRule rule) {
    std::unique_ptr<StepGradient>& made = gradients_[static_cast<std::size_t>(rule)];
    if (!made) {
      EquationOptions options = tape_.options_;
      options.rule = rule;
      made = std::make_unique<StepGradient>(model_, options);
    }
    return *made;
  }

  void advance(const Step& step, State& state) {
    const double rate = step.rule == StepRule::backward_euler ? 1.0 : 2.0;
    VectorX v = (rate / step.duration) * (step.end - state.q) - (rate - 1.0) * state.v;
    if (step.rule == StepRule::energy_momentum)
      set_turning_velocities(model_, state.v, step.end - state.q, step.duration, v);
    Equations& equations = gradient(step.rule).equations();
    const Assembler& assembler = equations.assembler();
    assembler.project(v);
    if (const VectorX* held = held_velocity(step)) assembler.add_held_part(*held, 1.0, v);
    if (!model_.planar()) compute_configuration(model_, state, step.end, configuration_);
    accept_configuration(model_, step.end, configuration_, state);
    if (const HandForces* hands = equations.hands()) hands->accept(hands_after(step, state), configuration_, state);
    place_hands(step.hands, state);
    if (!step.obstacles.empty()) state.obstacles = step.obstacles;
    state.v = v;
    state.contacts = step.contacts;
  }

  /// Poses of hands at the end of a step from a state.
  static std::vector<SupportPose> hands_after(const Step& step, const State& start) {
    return step.hands.empty() ? poses_of(start) : step.hands;
  }

  /// Per unknown, undefined for free ones; null if supports rest.
  const VectorX* held_velocity(const Step& step) {
    if (step.held.size() == 0) return nullptr;
    held_.setZero(model_.dof_count);
    Eigen::Index next = 0;
    for (const Constraint& c : model_.constraints) {
      held_.segment(c.first, c.size) = step.held.segment(next, c.size);
      next += c.size;
    }
    return &held_;
  }

 private:
  const Tape& tape_;
  const Model& model_;
  std::array<std::unique_ptr<StepGradient>, 5> gradients_;
  Configuration configuration_;
  VectorX held_;
};

Tape::Tape(const Model& model, EquationOptions options, State first, const Parameters& parameters, bool frictional,
           std::vector<SupportPose> hands)
    : model_(model),
      options_(options),
      acting_(parameters),
      starts_{std::move(first)},
      last_(starts_.front().q),
      last_velocity_(starts_.front().v),
      last_hands_(std::move(hands)),
      last_obstacles_(starts_.front().obstacles),
      frictional_(frictional) {
  place_hands(last_hands_, starts_.front());
}

void Tape::record(const AcceptedStep& step) {
  const State& after = step.after;
  acting_.record(steps_.size(), step.parameters);
  steps_.push_back({step.rule, step.duration, after.time, step.end, held_velocities(after.v), held_gains(step),
                    step.reached, moved_hands(step.hands), moved_obstacles(after.obstacles), after.contacts,
                    step.begins, step.unknown, step.tensions_in_middle});
  const VectorX before = held_velocities(last_velocity_);
  const double moved = steps_.back().held.norm() + before.norm();
  if (moved * std::abs(step.duration) <= kRounding * std::max(model_.length_scale, 1.0)) {
    steps_.back().held.resize(0);
    steps_.back().gain.resize(0);
  }
  if (steps_.size() % kStretch == 0) {
    starts_.push_back(after);
    place_hands(last_hands_, starts_.back());
  }
  last_ = after.q;
  last_velocity_ = after.v;
}

void Tape::note_moment(const Parameters& now) {
  if (steps_.empty() || now.natural_version == acting_.natural_version()) return;
  natural_[count()] = {now.natural_curvature, now.natural_twist, now.edge_natural_stretch};
}

std::vector<SupportPose> Tape::hands_after(long steps) const {
  for (long k = steps; k-- > 0;)
    if (const Step& step = steps_[static_cast<std::size_t>(k)]; !step.hands.empty()) return step.hands;
  return poses_of(starts_.front());
}

std::vector<SupportPose> Tape::moved_hands(const std::vector<SupportPose>& hands) {
  if (same_poses(hands, last_hands_)) return {};
  last_hands_ = hands;
  return hands;
}

std::vector<ObstaclePlace> Tape::moved_obstacles(const std::vector<ObstaclePlace>& obstacles) {
  const auto same = [](const ObstaclePlace& a, const ObstaclePlace& b) {
    const Vec3d point = a.point - b.point, other = a.other - b.other, turn = a.turn - b.turn,
                velocity = a.velocity - b.velocity;
    return dot(point, point) + dot(other, other) + dot(turn, turn) + dot(velocity, velocity) == 0.0;
  };
  if (std::equal(obstacles.begin(), obstacles.end(), last_obstacles_.begin(), last_obstacles_.end(), same)) return {};
  last_obstacles_ = obstacles;
  return obstacles;
}

VectorX Tape::held_gains(const AcceptedStep& step) const {
  const Motion& motion = step.after.motion;
  if (step.rule == StepRule::backward_euler || motion.known < 2 || model_.constraints.empty()) return {};
  VectorX out = VectorX::Zero(static_cast<Eigen::Index>(model_.constraints.size()));
  for (std::size_t i = 0; i < model_.constraints.size(); ++i) {
    const Constraint& c = model_.constraints[i];
    const Vector3 now = c.held(motion.velocity[0]), gain = now - c.held(motion.velocity[1]);
    if (now.norm() > 0.0 && carries_on(now, gain))
      out(static_cast<Eigen::Index>(i)) = 0.5 * step.duration / (motion.time[0] - motion.time[1]);
  }
  return out;
}

VectorX Tape::held_velocities(const VectorX& v) const {
  Eigen::Index count = 0;
  for (const Constraint& c : model_.constraints) count += c.size;
  VectorX out(count);
  count = 0;
  for (const Constraint& c : model_.constraints) {
    out.segment(count, c.size) = c.held(v).head(c.size);
    count += c.size;
  }
  return out;
}

void Tape::cut(long count, const State& after, std::vector<SupportPose> hands) {
  if (count >= this->count()) return;
  steps_.resize(static_cast<std::size_t>(count));
  starts_.resize(steps_.size() / kStretch + 1);
  acting_.cut(steps_.size());
  natural_.erase(natural_.upper_bound(count), natural_.end());
  last_ = after.q;
  last_velocity_ = after.v;
  last_hands_ = std::move(hands);
  last_obstacles_ = after.obstacles;
}

void Tape::refuse(const std::string& why) {
  if (refused_.empty()) refused_ = why;
}

bool Tape::continues(const State& state) const {
  return state.q.size() == last_.size() && state.q == last_ && state.v == last_velocity_;
}

void Tape::check_known() const {
  std::string why = refused_;
  for (const Step& step : steps_)
    if (why.empty() && step.unknown) why = step.unknown;
  if (!why.empty()) throw std::invalid_argument("no gradient of this run is available: " + why);
}

void Tape::walk_back(Player& player, const std::function<void(const Passage&)>& visit) const {
  std::vector<State> states(std::min(kStretch, steps_.size()));  // overwritten without allocation
  ActingNumbers::Player acting;
  std::size_t stretch = acting_.count() - 1;
  for (std::size_t k = steps_.size(); k-- > 0;) {
    const std::size_t first = k / kStretch * kStretch;
    if (k == steps_.size() - 1 || k % kStretch == kStretch - 1) {
      states.front() = starts_[k / kStretch];
      for (std::size_t j = first; j < k; ++j) {
        State& next = states[j + 1 - first];
        next = states[j - first];
        player.advance(steps_[j], next);
      }
    }
    const Step& step = steps_[k];
    while (acting_.first(stretch) > k) --stretch;
    const Parameters& parameters = acting_.play(model_, stretch, acting);
    StepGradient& gradient = player.gradient(step.rule);
    const Prescribed prescribed{.supports = Player::hands_after(step, states[k - first]), .obstacles = step.obstacles};
    gradient.begin({states[k - first], parameters, step.rule, step.duration, step.end, player.held_velocity(step),
                    step.gain.size() != 0 ? &step.gain : nullptr, prescribed});
    const std::function<State()> end = [&] {
      State after = states[k - first];
      player.advance(step, after);
      return after;
    };
    visit({k, stretch, gradient, parameters, prescribed.supports, end});
  }
}

/// Moments that a scalar depends on, by the number of steps before, and by the steps of its reactions.
class Tape::Moments {
 public:
  Moments(const Tape& tape, const std::vector<MomentAdjoint>& moments, const ParameterVisitor& visit, bool by_poses)
      : tape_(tape), moments_(moments), visit_(visit), left_(moments.size()) {
    long last = 0;
    for (const MomentAdjoint& moment : moments_) {
      if (moment.steps < last || moment.steps > tape.count())
        throw std::invalid_argument("a moment lies outside of the run");
      last = moment.steps;
      moment.by.check(tape.model_);
      if (moment.by.has_reactions()) add_reactions(moment, by_poses);
      if (moment.by.tensions.size() != 0 && tensions_in_middle(moment.steps)) add_tensions(moment);
    }
  }

  /// Adds the derivatives of moments after this number of steps; `state()` is the state then.
  void add(std::size_t steps, const Assembler& assembler, const Parameters& parameters,
           const std::function<State()>& state, StateAdjoint& adjoint) {
    for (; left_ > 0 && moments_[left_ - 1].steps == static_cast<long>(steps); --left_) {
      const ReadoutAdjoint& by = moments_[left_ - 1].by;
      add_unknowns(tape_.model_, by, adjoint);
      ReadoutAdjoint others;
      const bool in_middle = by.tensions.size() != 0 && tensions_in_middle(static_cast<long>(steps));
      if (in_middle) {
        others = by;
        others.tensions.resize(0);
      }
      const ReadoutAdjoint& of_state = in_middle ? others : by;
      if (!of_state.needs_state()) continue;
      const Parameters& shown = shown_parameters(static_cast<long>(steps), &parameters);
      CoefficientAdjoint coefficients(tape_.model_, shown.loads.rows());
      add_readouts(tape_.model_, assembler, shown, state(), of_state, adjoint, coefficients);
      const double time = steps == 0 ? tape_.starts_.front().time : tape_.steps_[steps - 1].time;
      visit_(static_cast<long>(steps), static_cast<long>(left_) - 1, time,
             parameter_gradient(tape_.model_, shown, coefficients));
    }
  }

  /// Derivatives by the axial forces in the middle of a step, or null. Call from the last step backwards.
  std::optional<VectorX> tensions(std::size_t step) {
    if (tensions_.empty() || tensions_.back().first != step) return std::nullopt;
    std::optional<VectorX> found = std::move(tensions_.back().second);
    tensions_.pop_back();
    return found;
  }

  /// Derivatives by the reactions of a step, or null. Call from the last step backwards.
  std::optional<ReactionAdjoint> reactions(std::size_t step) {
    if (reactions_.empty() || reactions_.back().first != step) return std::nullopt;
    std::optional<ReactionAdjoint> found = std::move(reactions_.back().second);
    reactions_.pop_back();
    return found;
  }

 private:
  /// True if axial forces after this number of steps are read out in the middle of the last step.
  bool tensions_in_middle(long steps) const {
    return steps > 0 && tape_.steps_[static_cast<std::size_t>(steps - 1)].tensions_in_middle;
  }

  void add_tensions(const MomentAdjoint& moment) {
    const auto step = static_cast<std::size_t>(moment.steps - 1);
    if (tensions_.empty() || tensions_.back().first != step)
      tensions_.emplace_back(step, moment.by.tensions);
    else
      tensions_.back().second += moment.by.tensions;
  }

  /// Reactions are the means over the parts of a time step, about where hands are at its end.
  void add_reactions(const MomentAdjoint& moment, bool by_poses) {
    if (moment.steps == 0)
      throw std::invalid_argument(
          "reactions at the start of a run have no gradient, because they come from the "
          "step before the run: give zeros for the first frame");
    const auto end = static_cast<std::size_t>(moment.steps);
    std::size_t first = end - 1;
    while (first > 0 && !tape_.steps_[first].begins) --first;
    double duration = 0.0;
    for (std::size_t k = first; k < end; ++k) duration += tape_.steps_[k].duration;
    const std::vector<SupportPose> hands = tape_.hands_after(moment.steps);
    for (std::size_t k = first; k < end; ++k) {
      if (by_poses) check_rests(moment.by.reactions, hands, tape_.hands_after(static_cast<long>(k) + 1));
      reactions_.push_back({k, {moment.by.reactions, hands, tape_.steps_[k].duration / duration}});
    }
  }

  /// The way of a hand between the parts of a time step moves the point that its moment is about.
  void check_rests(const SupportAdjoint& by, const std::vector<SupportPose>& hands,
                   const std::vector<SupportPose>& then) const {
    for (Eigen::Index s = 0; s < by.moments.rows(); ++s)
      if (tape_.model_.supports[static_cast<std::size_t>(s)].is_hand() && !by.moments.row(s).isZero(0.0) &&
          hands[static_cast<std::size_t>(s)].position != then[static_cast<std::size_t>(s)].position)
        throw std::invalid_argument(
            "no gradient of the moment of a hand with respect to its path is available in "
            "a subdivided time step: use a smaller time_step, or adaptive=False");
  }

  /// Uses the natural shape after this number of steps.
  const Parameters& shown_parameters(long steps, const Parameters* acted) {
    const auto found = tape_.natural_.find(steps);
    if (found == tape_.natural_.end()) return *acted;
    shown_ = *acted;
    shown_.natural_curvature = found->second.curvature;
    shown_.natural_twist = found->second.twist;
    shown_.edge_natural_stretch = found->second.stretch;
    return shown_;
  }

  const Tape& tape_;
  const std::vector<MomentAdjoint>& moments_;
  const ParameterVisitor& visit_;
  std::size_t left_;
  Parameters shown_;
  std::vector<std::pair<std::size_t, ReactionAdjoint>> reactions_;
  std::vector<std::pair<std::size_t, VectorX>> tensions_;
};

InitialGradient Tape::gradient(const std::vector<MomentAdjoint>& given, const ParameterVisitor& visit,
                               const PoseVisitor& visit_poses) const {
  check_known();
  Moments moments(*this, given, visit, static_cast<bool>(visit_poses));
  StateAdjoint adjoint{VectorX::Zero(model_.dof_count), VectorX::Zero(model_.dof_count)};
  const CoefficientAdjoint none(model_, acting_.load_rows());
  CoefficientAdjoint coefficients = none;
  HeldAdjoint held(model_);
  VectorX drawn = held.pose;
  double time = starts_.front().time;
  bool begins = true;
  Player player(*this);
  walk_back(player, [&](const Passage& passage) {
    const std::size_t k = passage.step;
    moments.add(k + 1, passage.gradient.equations().assembler(), passage.parameters, passage.end, adjoint);
    if (begins) time = acting_time(steps_[k]);
    held.pose.setZero();
    const std::optional<ReactionAdjoint> reactions = moments.reactions(k);
    const std::optional<VectorX> tensions = moments.tensions(k);
    passage.gradient.pull_back(adjoint, coefficients, held, reactions ? &*reactions : nullptr,
                               tensions ? &*tensions : nullptr);
    drawn += held.pose;
    if (visit_poses) {
      PoseAdjoint poses =
          by_poses(model_, steps_[k].end, held.pose, held.hands, {passage.hands, starts_.front().hands});
      poses.obstacles = by_places(model_, held.obstacles);
      visit_poses(static_cast<long>(k), steps_[k].reached, poses);
    }
    begins = k == acting_.first(passage.stretch) || k == 0;
    if (!begins) return;
    visit(static_cast<long>(k), -1, time, parameter_gradient(model_, passage.parameters, coefficients));
    coefficients = none;
  });
  if (steps_.empty()) visit(0, -1, time, parameter_gradient(model_, acting_.start(), coefficients));
  const StepRule rule = steps_.empty() ? StepRule::backward_euler : steps_.front().rule;
  const Assembler& assembler = player.gradient(rule).equations().assembler();
  moments.add(0, assembler, acting_.start(), [&] { return starts_.front(); }, adjoint);
  assembler.project(adjoint.v);  // velocities of held unknowns are prescribed
  const State& first = starts_.front();
  const std::vector<SupportPose> hands = poses_of(first);
  PoseAdjoint poses = by_poses(model_, first.q, adjoint.q, adjoint.hands, {hands, first.hands});
  poses.obstacles = by_places(model_, adjoint.obstacles);
  drawn += adjoint.q;
  return {at_nodes(model_, adjoint.q), at_nodes(model_, adjoint.v), std::move(poses),
          by_drawing(model_, first.q, drawn)};
}

RunJacobian Tape::jacobian() const {
  check_known();
  for (const Support& s : model_.supports)
    if (s.active && s.yields() && std::isfinite(s.description.hand.force_limit))
      throw std::invalid_argument(
          "no Jacobian is available with a hand that slips, because its slip is not part "
          "of a state vector: use grasp without force_limit=");
  if (acting_.count() > 1)
    throw std::invalid_argument(
        "no Jacobian is available while a natural shape ramps, or for a run in which a parameter was set: set "
        "parameters before the run, without over=, or take the gradient of a record");
  const SparseMatrix basis = free_basis(model_), back = basis.transpose();
  const Eigen::Index free = basis.cols();
  std::vector<StateAdjoint> adjoints;
  for (Eigen::Index row = 0; row < 2 * free; ++row) {
    adjoints.push_back({VectorX::Zero(model_.dof_count), VectorX::Zero(model_.dof_count)});
    (row < free ? adjoints.back().q : adjoints.back().v) = basis.col(row % free);
  }
  std::vector<CoefficientAdjoint> coefficients(adjoints.size(), CoefficientAdjoint(model_, acting_.load_rows()));
  HeldAdjoint held(model_);
  Player player(*this);
  walk_back(player, [&](const Passage& passage) {
    for (std::size_t row = 0; row < adjoints.size(); ++row)
      passage.gradient.pull_back(adjoints[row], coefficients[row], held);
  });
  const Parameters& parameters = acting_.start();
  RunJacobian out{MatrixX(2 * free, 2 * free), {}};
  for (std::size_t row = 0; row < adjoints.size(); ++row) {
    out.state.row(static_cast<Eigen::Index>(row)) << (back * adjoints[row].q).transpose(),
        (back * adjoints[row].v).transpose();
    out.rows.push_back(parameter_gradient(model_, parameters, coefficients[row]));
  }
  return out;
}

}  // namespace withe
