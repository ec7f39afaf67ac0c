#pragma once
/// The mean velocity of a coming step, extrapolated from the last ones.

#include <algorithm>
#include <array>

#include "common/types.hpp"

namespace withe {

/// Polynomials in time through means of the last steps, each at the middle of its step. They extrapolate either
/// accelerations a, which gives v0 + h a from the velocity v0 at the start of the step, or velocities. Modes that a
/// midpoint step does not resolve flip the sign of v0 and a from step to step, and each degree in a amplifies them
/// further. Their mean velocities are small. The predictor uses the polynomial that would have predicted the last step
/// best. The steps of a composition differ in their horizon, so each has its own slot.
class Predictor {
 public:
  static constexpr int kDepth = 4, kSlots = 5;

  /// Extrapolated quantity, and its number of last steps. With no accelerations, v0 is constant.
  struct Choice {
    bool velocities = false;
    int points = 1;
  };

  /// A step of dt: h from its start to where its forces act, dt / 2 or dt.
  struct Step {
    double middle = 0, h = 0, dt = 0;  ///< [s]
    int slot = 0;
  };

  void clear() {
    count_ = 0;
    for (VectorX& a : slow_) a.resize(0);
  }
  bool empty() const { return count_ == 0; }
  /// Mean velocity of the last step, if there is one.
  const VectorX& latest() const { return velocity_[0]; }
  Choice choice(int slot) const {
    const Choice best = best_[static_cast<std::size_t>(slot)];
    return {best.velocities && count_ > 0, std::min(best.points, count_)};
  }
  /// Mean velocity expected of a step that starts with `v0`.
  void predict(const Step& step, const VectorX& v0, VectorX& out) const;
  /// Adds a step from velocity `v0`; `weight` is the weight of errors per unknown.
  void record(const Step& step, const VectorX& v0, const VectorX& velocity, const VectorX& acceleration,
              const VectorX& weight);

  /// Damping ratios of the oscillators of a Butterworth filter of third or fifth order, whose gain is
  /// (1 + x^(2 n))^(-1/2) at x times the cutoff frequency.
  struct Butterworth {
    std::array<double, 2> damping;
  };
  static constexpr Butterworth kThird{{0.5, 0.5}};                                  // the first two poles suffice
  static constexpr Butterworth kFifth{{0.80901699437494742, 0.30901699437494742}};  // cos 36, cos 72 degrees

  /// First derivative of the accelerations in time, through a low-pass filter of third order. Unless `third` is null,
  /// also their third derivative, through a filter of fifth order. The filters are a running mean and one or two
  /// oscillators of the frequency `cut` / dt, solved exactly for an acceleration that is constant in the step. `filter`
  /// is a Butterworth filter for the derivative of its own order. Call it in every step or in none.
  void differentiate(const Butterworth& filter, double cut, double dt, const VectorX& acceleration, VectorX& first,
                     VectorX* third);

  void resize(Eigen::Index size) {
    for (auto* history : {&acceleration_, &velocity_})
      for (VectorX& a : *history)
        if (a.size() != size) a.setZero(size);
  }
  bool plausible() const;
  /// Reads or writes everything; see archive.hpp of `world`.
  template <class Archive>
  void exchange(Archive& io) {
    io(count_);
    for (Choice& b : best_) {
      io(b.velocities);
      io(b.points);
    }
    for (double& t : time_) io(t);
    for (VectorX& a : acceleration_) io(a);
    for (VectorX& v : velocity_) io(v);
    bool smoothed = slow_[0].size() > 0;
    io(smoothed);
    for (VectorX& a : slow_) {
      a.resize(smoothed ? acceleration_[0].size() : 0);
      io(a);
    }
  }

 private:
  using History = std::array<VectorX, kDepth>;

  /// Calls `use` with an expression, so that the comparison is computed in the same pass.
  template <class Use>
  void extrapolated(double time, const History& history, int points, const Use& use) const;
  template <class Use>
  void predicted(const Step& step, const VectorX& v0, Choice choice, const Use& use) const;
  void choose(const Step& step, const VectorX& v0, const VectorX& velocity, const VectorX& weight);

  int count_ = 0;
  std::array<Choice, kSlots> best_;
  std::array<double, kDepth> time_{};  ///< latest first
  History acceleration_, velocity_;
  VectorX scratch_;
  std::array<VectorX, 5> slow_;  ///< mean, and values and rates of the oscillators; empty until wanted
};

}  // namespace withe
