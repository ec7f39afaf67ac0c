#pragma once
/// Heuristics of Newton's method beyond full steps, by name, so that each can be switched off and measured
/// (benchmarks/ablation.py).

namespace withe {

enum class Heuristic : unsigned {
  reuse_across_steps,
  reuse_within_step,
  rest_from_reuse,
  refresh_after_slow,
  forget_contraction,
  late_matrix,
  matrix_worth,
  reject_stagnation,
  surface_search,
  search_descent,
  drop_geometric,
  start_accelerated,
  start_plain,
  start_continuation,
  start_record,
  few_iterations,
  hold_sticking,
  predict_friction,
  supports_linear,
};

/// A set of heuristics that are switched off.
class Without {
 public:
  bool uses(Heuristic h) const { return (bits_ >> static_cast<unsigned>(h) & 1U) == 0U; }
  void switch_off(Heuristic h) { bits_ |= 1U << static_cast<unsigned>(h); }

 private:
  unsigned bits_ = 0;
};

}  // namespace withe
