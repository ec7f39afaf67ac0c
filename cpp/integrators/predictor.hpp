#pragma once
/// The mean acceleration of a coming step, extrapolated from those of the last ones.

#include <algorithm>
#include <array>

#include "common/types.hpp"

namespace withe {

/// Polynomials in time through the mean accelerations of the last steps, each taken at the middle of its step. Used is
/// the degree that would have predicted the last one best: modes that the step does not resolve flip sign from step to
/// step, and every degree amplifies them more. Steps of a composition differ in how far they look ahead, so each has a
/// slot.
class Predictor {
 public:
  static constexpr int kDepth = 4, kSlots = 5;

  void clear() {
    count_ = 0;
    for (VectorX& a : slow_) a.resize(0);
  }
  bool empty() const { return count_ == 0; }
  /// Number of steps that the coming prediction in `slot` uses; 0: none is better.
  int points(int slot) const { return std::min(best_[static_cast<std::size_t>(slot)], count_); }
  /// Acceleration expected at `time` from the last `points` steps.
  void extrapolate(double time, int points, VectorX& out) const;
  /// Takes in the mean acceleration of a step about `time`; `weight` per unknown says how much an error there matters.
  void record(double time, int slot, const VectorX& acceleration, const VectorX& weight, VectorX& scratch);

  /// Derivative of the accelerations in time, of an odd `order` up to three, through order + 2 running means that each
  /// forget `share` of the past in a step of dt. To be asked for in every step or in none.
  void differentiate(int order, double share, double dt, const VectorX& acceleration, VectorX& out);

  void resize(Eigen::Index size) {
    for (VectorX& a : acceleration_)
      if (a.size() != size) a.setZero(size);
  }
  bool plausible() const;
  /// Reads or writes everything; see archive.hpp of `world`.
  template <class Archive>
  void exchange(Archive& io) {
    io(count_);
    for (int& b : best_) io(b);
    for (double& t : time_) io(t);
    for (VectorX& a : acceleration_) io(a);
    bool smoothed = slow_[0].size() > 0;
    io(smoothed);
    for (VectorX& a : slow_) {
      a.resize(smoothed ? acceleration_[0].size() : 0);
      io(a);
    }
  }

 private:
  int count_ = 0;
  std::array<int, kSlots> best_{1, 1, 1, 1, 1};
  std::array<double, kDepth> time_{};  ///< latest first
  std::array<VectorX, kDepth> acceleration_;
  std::array<VectorX, 5> slow_;  ///< running means, empty until wanted
};

}  // namespace withe
