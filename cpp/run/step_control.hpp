#pragma once
/// Lengths of the parts in which a time step is taken, as pure functions of what is known. A part that is rejected is
/// subdivided. Parts grow back after some parts that were more accurate than required.
///
/// Lengths change by powers of two and rarely, or symmetry and energy suffer; under error control, whose error would
/// change by four, by the fourth root of two.
///
/// Error control bounds the estimated error per unit of time, allowed(dt) = f (1 - s) tolerance dt / duration, where f
/// is the least ratio of an estimate to the error. In an impact this bound would cost far more steps than it is worth:
/// of all ways to make the same total error, equal errors in every step take the fewest steps. So an event may make as
/// great an error in a step as the steps around it make on average. The error beyond the event's time must be left in a
/// share s of the tolerance, which is kept for events and which time fills again. A step may grow where C (times dt)^p,
/// C the greatest of the last errors over dt^p, is allowed.
///
/// If the scene allows fourth-order steps, error control also chooses the order of each step. It computes for either
/// order the longest allowed step, (allowed(1) / C)^(1 / (p - 1)), and divides this step by its cost. The order with
/// the greater quotient is taken.

#include <array>
#include <optional>

#include "integrators/dynamics.hpp"
#include "integrators/options.hpp"

namespace withe {

/// Verdict on a part of a time step. The last two accept it.
enum class Verdict {
  failed,         ///< no solution was found
  gained_energy,  ///< contact or pressure added energy
  inaccurate,     ///< the error is too great, or the part too long for a motion or a contact
  hard,           ///< longer parts would be rejected
  easy,
};
constexpr bool accepts(Verdict verdict) { return verdict == Verdict::hard || verdict == Verdict::easy; }

/// Easy parts before longer ones are tried, at least.
inline constexpr int kMinPatience = 4;

/// Memory from part to part.
struct StepLengths {
  int level = 0;                ///< present halvings of the time step, in `StepControl::levels_per_halving` to each
  int easy_steps = 0;           ///< since the level changed
  int patience = kMinPatience;  ///< easy parts before longer ones are tried
  bool grown = false;           ///< fewer easy parts than the least patience ago
  bool composed = false;        ///< true if error control takes fourth-order steps
  /// C, greatest estimated error of the last parts over dt^p [m / s^p]: of the integrator, of fourth-order steps.
  std::array<double, 2> error_rates{};
  double mean_step = 0;      ///< under error control, over some of the last parts, weighed by their lengths [s]
  double event_reserve = 1;  ///< share that is left of the error that events may make beyond their time [-]
};

/// Equal parts in which the rest of a time step is taken, from a fraction of it on.
struct Division {
  double from = 0.0;
  long parts = 1, done = 0;

  /// Fraction of the time step that has been taken.
  double reached() const { return from + (1.0 - from) * (static_cast<double>(done) / static_cast<double>(parts)); }
  bool finished() const { return done == parts; }
  bool first() const { return from == 0.0 && done == 0; }
  bool whole() const { return from == 0.0 && parts == 1; }
  /// Length of a part over that of the time step.
  double share() const { return (1.0 - from) / static_cast<double>(parts); }
};

struct StepProgress {
  StepLengths lengths;
  Division division;
};

class StepControl {
 public:
  /// `may_compose`: true if error control may take fourth-order steps besides those of second order.
  explicit StepControl(const Options& options, bool may_compose = false);

  /// Parts at the start of a time step. `has_history`: parts were taken before, from which errors are estimated; else
  /// error control begins with a part too short to need an estimate.
  StepProgress begin(StepLengths lengths, bool has_history) const;
  /// True if shorter parts may follow a rejected one.
  bool may_subdivide(const StepLengths& lengths) const;
  /// Parts after a rejected one, where `may_subdivide`.
  StepProgress subdivide(StepProgress now, Verdict why) const;
  /// Parts after an accepted one of dt.
  StepProgress advance(StepProgress now, Verdict verdict, double dt) const;

  /// Error that is allowed in a part of dt [m]; infinite without error control.
  double allowed_error(double dt) const;
  /// True if a part of dt may have the error, as every part may or as an event.
  bool bears(const StepLengths& lengths, double error, double dt) const;
  /// Lengths after an accepted part of dt with an error, and the verdict on it. `near_limit`: a longer part would be
  /// rejected for another reason.
  struct Accepted {
    StepLengths lengths;
    Verdict verdict = Verdict::easy;
  };
  Accepted accept(StepLengths lengths, const StepErrors& errors, double dt, bool near_limit) const;

  int levels_per_halving() const { return tolerance_ ? 4 : 1; }
  int deepest_level() const { return levels_per_halving() * max_halvings_; }
  /// Number of parts in a time step at a level.
  double parts_at(int level) const;

 private:
  /// The rest of a time step in parts no longer than `level` has them.
  Division divided(const Division& division, int level) const;
  bool may_grow(const StepLengths& lengths, double dt, double times) const;
  StepProgress grown(StepProgress now, double dt) const;
  double order(bool composed) const { return composed ? 5.0 : order_; }
  /// Least number of levels that shorten parts by `ratio`.
  int levels_between(double ratio) const;
  /// Longest step that is accurate enough [s], at most `most`.
  double longest_step(const StepLengths& lengths, bool composed, double most) const;
  /// Changes the order where the other one is cheaper. `whole`: length of the time step [s].
  StepLengths choose_order(StepLengths lengths, double whole) const;

  bool adaptive_, explicit_, may_compose_;
  int max_halvings_;
  double order_;  ///< p of the integrator
  std::optional<double> tolerance_;
  double duration_;
};

}  // namespace withe
