#pragma once
/// Continuation: from a solved boundary value problem to another in steps that adapt.

#include <algorithm>
#include <utility>

#include "elastica/shooting.hpp"

namespace withe {

/// `ask(share, guess)` poses the problem at a share of the way from what `path` solves to what is wanted, and may
/// change the guess. False where a step below `least` would be needed; the problem is then left where it was not
/// solved.
template <class Problem, class Ask>
bool follow(ShootingSolver<Problem>& solver, const Problem& problem, double least, typename Problem::Path& path,
            typename Problem::Path& trial, const Ask& ask) {
  double done = 0, step = 1;
  while (done < 1) {
    const double next = std::min(1.0, done + step);
    trial = path;
    ask(next, trial);
    if (solver.solve(problem, trial).converged) {
      std::swap(path, trial);
      done = next;
      step *= 2;
    } else {
      step /= 2;
      if (step < least) return false;
    }
  }
  return true;
}

}  // namespace withe
