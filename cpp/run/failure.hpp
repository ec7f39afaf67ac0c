#pragma once

#include <stdexcept>
#include <string>

namespace withe {

/// Non-convergence below the smallest step. Becomes withe.ConvergenceError.
class ConvergenceFailure : public std::runtime_error {
 public:
  ConvergenceFailure(const std::string& message, double time, double step, int rod, int node, double residual)
      : std::runtime_error(message), time(time), step(step), rod(rod), node(node), residual(residual) {}
  double time, step;  ///< [s]
  int rod, node;      ///< where the residual is greatest; -1: not known
  double residual;    ///< [N]
};

}  // namespace withe
