#pragma once
/// Forces and moments on nodes that a user computes from their positions x and velocities v: F(t, x, v).

#include <functional>

#include <Eigen/SparseCore>

#include "common/types.hpp"

namespace withe {

using SparseMatrix = Eigen::SparseMatrix<double>;

struct CustomForces {
  MatrixX3 forces;   ///< per node [N]
  MatrixX3 moments;  ///< per node, in world axes [N m]; empty: none
  /// dF/dx [N/m] and dF/dv [N s/m]: three rows per node for forces, then three per node for moments if there are any;
  /// three columns per node. Empty: zero, or not requested.
  SparseMatrix by_position, by_velocity;
};

/// `derivatives`: whether they are wanted.
using CustomFunction =
    std::function<CustomForces(double time, const MatrixX3& positions, const MatrixX3& velocities, bool derivatives)>;

}  // namespace withe
