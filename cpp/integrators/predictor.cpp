#include "integrators/predictor.hpp"

#include <algorithm>

namespace withe {

void Predictor::extrapolate(double time, int points, VectorX& out) const {
  std::array<double, kDepth> weight;  // Lagrange's
  for (int i = 0; i < points; ++i) {
    const auto a = static_cast<std::size_t>(i);
    weight[a] = 1.0;
    for (int j = 0; j < points; ++j) {
      const auto b = static_cast<std::size_t>(j);
      if (j != i) weight[a] *= (time - time_[b]) / (time_[a] - time_[b]);
    }
  }
  const auto& [a, b, c, d] = acceleration_;
  const auto& [wa, wb, wc, wd] = weight;
  switch (points) {
    case 0:
      out.setZero(a.size());
      break;
    case 1:
      out = wa * a;
      break;
    case 2:
      out = wa * a + wb * b;
      break;
    case 3:
      out = wa * a + wb * b + wc * c;
      break;
    default:
      out = wa * a + wb * b + wc * c + wd * d;
  }
}

void Predictor::record(double time, int slot, const VectorX& acceleration, const VectorX& weight, VectorX& scratch) {
  resize(acceleration.size());
  for (int i = 0; i < count_; ++i)
    if (time_[static_cast<std::size_t>(i)] == time) count_ = i;  // the same step again
  double least = INFINITY;
  for (int points = 0; points <= count_; ++points) {
    extrapolate(time, points, scratch);
    const double error = (scratch - acceleration).cwiseAbs2().dot(weight);
    if (error < least) {
      least = error;
      best_[static_cast<std::size_t>(slot)] = points;
    }
  }
  // With a longer history the next degree up is worth a trial.
  if (count_ < kDepth && best_[static_cast<std::size_t>(slot)] == count_) ++best_[static_cast<std::size_t>(slot)];
  std::rotate(acceleration_.begin(), acceleration_.end() - 1, acceleration_.end());
  std::rotate(time_.begin(), time_.end() - 1, time_.end());
  acceleration_[0] = acceleration;
  time_[0] = time;
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
  for (const int b : best_) fine = fine && b >= 0 && b <= kDepth;
  for (int i = 0; i < kDepth; ++i)
    for (int j = 0; j < i && i < count_; ++j)
      fine = fine && time_[static_cast<std::size_t>(i)] != time_[static_cast<std::size_t>(j)];
  for (const VectorX& a : acceleration_) fine = fine && a.allFinite();
  for (const VectorX& a : slow_) fine = fine && a.allFinite() && a.size() == slow_[0].size();
  return fine;
}

}  // namespace withe
