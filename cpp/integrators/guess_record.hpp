#pragma once
/// Record of initial guesses from one time step to the next.

#include <algorithm>
#include <array>

namespace withe {

/// Success rate of a guess that need not lead to the solution: a guess that fails repeatedly is tried more
/// rarely.
struct GuessRecord {
  int misses = 0;  ///< number of consecutive failures
  int waits = 0;   ///< solves to come without it

  bool skipped() { return waits > 0 && waits-- > 0; }
  void note(bool converged) {
    constexpr int kMaxMisses = 6;  // a guess that always misses is tried once in 64 solves
    misses = converged ? 0 : std::min(misses + 1, kMaxMisses);
    waits = (1 << misses) - 1;
  }
};

using GuessRecords = std::array<GuessRecord, 4>;  ///< per `Guess` of inner_solve.cpp

}  // namespace withe
