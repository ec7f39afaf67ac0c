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

void Predictor::differentiate(int order, double share, double dt, const VectorX& acceleration, VectorX& out) {
  if (slow_[0].size() != acceleration.size())
    for (std::size_t k = 0; k < slow_.size(); ++k)
      slow_[k] = (k < 3 ? 1.0 : 0.0) * acceleration;  // it has always been so
  slow_[0] += share * (acceleration - slow_[0]);
  slow_[1] += share * (slow_[0] - slow_[1]);
  out = slow_[1];
  for (int k = 0; k < order; ++k) {
    VectorX& mean = slow_[static_cast<std::size_t>(2 + k)];
    out = (share / dt) * (out - mean);
    mean += dt * out;
  }
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
