#include "integrators/predictor.hpp"

#include <algorithm>

#include "common/interpolation.hpp"

namespace withe {

template <class Use>
void Predictor::extrapolated(double time, const History& history, int points, const Use& use) const {
  const auto weight = lagrange_weights(time_, static_cast<std::size_t>(points), time);
  const auto& [a, b, c, d] = history;
  const auto& [wa, wb, wc, wd] = weight;
  switch (points) {
    case 1:
      return use(wa * a);
    case 2:
      return use(wa * a + wb * b);
    case 3:
      return use(wa * a + wb * b + wc * c);
    default:
      return use(wa * a + wb * b + wc * c + wd * d);
  }
}

template <class Use>
void Predictor::predicted(const Step& step, const VectorX& v0, Choice choice, const Use& use) const {
  if (choice.points == 0)
    use(v0);
  else if (choice.velocities)
    extrapolated(step.middle, velocity_, choice.points, use);
  else
    extrapolated(step.middle, acceleration_, choice.points, [&](const auto& a) { use(v0 + step.h * a); });
}

void Predictor::predict(const Step& step, const VectorX& v0, VectorX& out) const {
  predicted(step, v0, choice(step.slot), [&](const auto& velocity) { out = velocity; });
}

void Predictor::choose(const Step& step, const VectorX& v0, const VectorX& velocity, const VectorX& weight) {
  Choice& best = best_[static_cast<std::size_t>(step.slot)];
  double least = INFINITY;
  const auto consider = [&](Choice choice) {
    double error = INFINITY;
    predicted(step, v0, choice, [&](const auto& mean) { error = (mean - velocity).cwiseAbs2().dot(weight); });
    if (!(error < least)) return;
    least = error;
    best = choice;
  };
  for (int points = 0; points <= count_; ++points) consider({false, points});
  // Under backward Euler a step's mean velocity is that at its end, and both are one.
  if (step.h < step.dt)
    for (int points = 1; points <= count_; ++points) consider({true, points});
  // With a longer history the next degree up is worth a trial.
  if (!best.velocities && count_ < kDepth && best.points == count_) ++best.points;
}

void Predictor::record(const Step& step, const VectorX& v0, const VectorX& velocity, const VectorX& acceleration,
                       const VectorX& weight) {
  resize(acceleration.size());
  for (int i = 0; i < count_; ++i)
    if (time_[static_cast<std::size_t>(i)] == step.middle) count_ = i;  // a repetition of this step
  choose(step, v0, velocity, weight);
  for (History* history : {&acceleration_, &velocity_})
    std::rotate(history->begin(), history->end() - 1, history->end());
  std::rotate(time_.begin(), time_.end() - 1, time_.end());
  acceleration_[0] = acceleration;
  velocity_[0] = velocity;
  time_[0] = step.middle;
  count_ = std::min(count_ + 1, kDepth);
}

namespace {

/// Advances y'' + 2 z w y' + w^2 y = w^2 u by a step of dt, in which u is constant. On return `rate` is y'.
void oscillate(double damping, double w, double dt, const VectorX& u, VectorX& y, VectorX& rate) {
  const double s = std::sqrt(1.0 - damping * damping), decay = std::exp(-damping * w * dt),
               sine = decay * std::sin(s * w * dt) / s, cosine = decay * std::cos(s * w * dt);
  y -= u;
  const double of_rate = cosine - damping * sine, of_value = -w * sine;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const double value = y(i);
    y(i) = (cosine + damping * sine) * value + (sine / w) * rate(i) + u(i);
    rate(i) = of_rate * rate(i) + of_value * value;
  }
}

}  // namespace

void Predictor::differentiate(const Butterworth& filter, double cut, double dt, const VectorX& acceleration,
                              VectorX& first, VectorX* third) {
  auto& [mean, value, rate, second_value, second_rate] = slow_;
  if (mean.size() != acceleration.size()) {
    mean = acceleration;  // it has always been so
    for (VectorX* x : {&value, &rate, &second_value, &second_rate}) x->setZero(acceleration.size());
  }
  first = (-std::expm1(-cut) / dt) * (acceleration - mean);
  mean += dt * first;
  if (third) *third = (-1.0 / dt) * value;
  oscillate(filter.damping[0], cut / dt, dt, first, value, rate);
  first = value;
  if (!third) return;
  *third += (1.0 / dt) * value;
  const VectorX& input = *third;
  VectorX& before = scratch_;
  before = second_value;
  oscillate(filter.damping[1], cut / dt, dt, input, second_value, second_rate);
  *third = (1.0 / dt) * (second_value - before);
}

bool Predictor::plausible() const {
  bool fine = count_ >= 0 && count_ <= kDepth;
  for (const Choice& b : best_) fine = fine && b.points >= (b.velocities ? 1 : 0) && b.points <= kDepth;
  for (int i = 0; i < kDepth; ++i)
    for (int j = 0; j < i && i < count_; ++j)
      fine = fine && time_[static_cast<std::size_t>(i)] != time_[static_cast<std::size_t>(j)];
  for (const History* history : {&acceleration_, &velocity_})
    for (const VectorX& a : *history) fine = fine && a.allFinite();
  for (const VectorX& a : slow_) fine = fine && a.allFinite() && a.size() == slow_[0].size();
  return fine;
}

}  // namespace withe
