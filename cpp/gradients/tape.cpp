#include "gradients/tape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "gradients/state_vector.hpp"
#include "steps/inertia.hpp"

namespace withe {
namespace {

constexpr double kRounding = 1e-12;  // by which supports that rest move, of the scene's length; angles likewise

MatrixX3 at_nodes(const Model& model, const VectorX& by) {
  MatrixX3 out(model.node_count, 3);
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    if (model.planar())
      out.row(i) = by(dof) * model.plane->first + by(dof + 1) * model.plane->second;
    else
      out.row(i) = by.segment<3>(dof);
  }
  return out;
}

}  // namespace

void add_to_nodes(const Model& model, const MatrixX3& by, VectorX& out) {
  for (Eigen::Index i = 0; i < by.rows(); ++i) {
    const int dof = model.node_dof[static_cast<std::size_t>(i)];
    const Vector3 row = by.row(i);
    if (model.planar())
      out.segment<2>(dof) += Vector2(row.dot(model.plane->first), row.dot(model.plane->second));
    else
      out.segment<3>(dof) += row;
  }
}

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
    const Assembler& assembler = gradient(step.rule).equations().assembler();
    assembler.project(v);
    if (const VectorX* held = held_velocity(step)) assembler.add_held_part(*held, 1.0, v);
    if (!model_.planar()) compute_configuration(model_, state, step.end, configuration_);
    accept_configuration(model_, step.end, configuration_, state);
    state.v = v;
    state.contacts = step.contacts;
  }

  /// Per unknown, meaningful where held; nothing where supports rest.
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

Tape::Tape(const Model& model, EquationOptions options, State first, Parameters parameters)
    : model_(model),
      options_(options),
      first_(std::move(first)),
      parameters_(std::move(parameters)),
      last_(first_.q),
      last_velocity_(first_.v) {}

void Tape::record(StepRule rule, double duration, const VectorX& end, const State& after, const char* unknown) {
  steps_.push_back({rule, duration, end, held_velocities(after.v), after.contacts, unknown});
  const VectorX before = held_velocities(last_velocity_);
  const double moved = steps_.back().held.norm() + before.norm();
  if (moved * std::abs(duration) <= kRounding * std::max(model_.length_scale, 1.0)) steps_.back().held.resize(0);
  last_ = after.q;
  last_velocity_ = after.v;
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

void Tape::cut(long count, const State& after) {
  if (count >= this->count()) return;
  steps_.resize(static_cast<std::size_t>(count));
  last_ = after.q;
  last_velocity_ = after.v;
}

void Tape::refuse(const std::string& why) {
  if (refused_.empty()) refused_ = why;
}

bool Tape::continues(const State& state, const Parameters& parameters) const {
  return state.q.size() == last_.size() && parameters.version == parameters_.version &&
         parameters.natural_version == parameters_.natural_version && parameters.loads == parameters_.loads &&
         state.q == last_ && state.v == last_velocity_;
}

void Tape::check_known() const {
  std::string why = refused_;
  for (const Step& step : steps_)
    if (why.empty() && step.unknown) why = step.unknown;
  if (!why.empty()) throw std::invalid_argument("no gradient is known of this run: " + why);
}

void Tape::walk_back(const std::function<void(std::size_t, StepGradient&)>& visit) const {
  Player player(*this);
  const auto stride = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(steps_.size()) + 1.0)));
  std::vector<State> starts;  // of every stretch of so many steps
  State state = first_;
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    if (k % stride == 0) starts.push_back(state);
    player.advance(steps_[k], state);
  }
  std::vector<State> states;
  for (std::size_t k = steps_.size(); k-- > 0;) {
    const std::size_t first = k / stride * stride;
    if (k == steps_.size() - 1 || k % stride == stride - 1) {
      states.assign(1, starts[k / stride]);
      for (std::size_t j = first; j < k; ++j) {
        states.push_back(states.back());
        player.advance(steps_[j], states.back());
      }
    }
    const Step& step = steps_[k];
    StepGradient& gradient = player.gradient(step.rule);
    gradient.begin({states[k - first], parameters_, step.rule, step.duration, step.end, player.held_velocity(step)});
    visit(k, gradient);
  }
}

RunGradient Tape::gradient(std::vector<MomentAdjoint> moments) const {
  check_known();
  std::sort(moments.begin(), moments.end(),
            [](const MomentAdjoint& a, const MomentAdjoint& b) { return a.steps < b.steps; });
  if (!moments.empty() && (moments.front().steps < 0 || moments.back().steps > count()))
    throw std::invalid_argument("a moment lies outside of the run");

  StateAdjoint adjoint{VectorX::Zero(model_.dof_count), VectorX::Zero(model_.dof_count)};
  CoefficientAdjoint coefficients(model_, parameters_.loads.rows());
  VectorX held = VectorX::Zero(model_.dof_count);
  const auto add_moments = [&](std::size_t steps) {
    for (; !moments.empty() && moments.back().steps == static_cast<long>(steps); moments.pop_back()) {
      add_to_nodes(model_, moments.back().positions, adjoint.q);
      add_to_nodes(model_, moments.back().velocities, adjoint.v);
    }
  };
  walk_back([&](std::size_t k, StepGradient& gradient) {
    add_moments(k + 1);
    gradient.pull_back(adjoint, coefficients, held);
  });
  add_moments(0);
  return {parameter_gradient(model_, parameters_, coefficients),
          {at_nodes(model_, adjoint.q), at_nodes(model_, adjoint.v)}};
}

RunJacobian Tape::jacobian() const {
  check_known();
  const SparseMatrix basis = free_basis(model_), back = basis.transpose();
  const Eigen::Index free = basis.cols();
  std::vector<StateAdjoint> adjoints;
  for (Eigen::Index row = 0; row < 2 * free; ++row) {
    adjoints.push_back({VectorX::Zero(model_.dof_count), VectorX::Zero(model_.dof_count)});
    (row < free ? adjoints.back().q : adjoints.back().v) = basis.col(row % free);
  }
  std::vector<CoefficientAdjoint> coefficients(adjoints.size(), CoefficientAdjoint(model_, parameters_.loads.rows()));
  VectorX held = VectorX::Zero(model_.dof_count);
  walk_back([&](std::size_t, StepGradient& gradient) {
    for (std::size_t row = 0; row < adjoints.size(); ++row) gradient.pull_back(adjoints[row], coefficients[row], held);
  });
  RunJacobian out{MatrixX(2 * free, 2 * free), {}};
  for (std::size_t row = 0; row < adjoints.size(); ++row) {
    out.state.row(static_cast<Eigen::Index>(row)) << (back * adjoints[row].q).transpose(),
        (back * adjoints[row].v).transpose();
    out.rows.push_back({parameter_gradient(model_, parameters_, coefficients[row]), {}});
  }
  return out;
}

}  // namespace withe
