#pragma once
/// What is remembered of the initial guess from one time step to the next.

#include <algorithm>

namespace withe {

/// How often the extrapolated motion, which need not lead to the solution, has done so: what misses time and again is
/// tried ever more rarely.
struct GuessRecord {
  int misses = 0;  ///< in a row
  int waits = 0;   ///< solves to come without it

  bool skipped() { return waits > 0 && waits-- > 0; }
  void note(bool converged) {
    constexpr int kMostMisses = 6;
    misses = converged ? 0 : std::min(misses + 1, kMostMisses);
    waits = (1 << misses) - 1;
  }
};

}  // namespace withe
