#pragma once
/// Length of the hypotenuse.

#include <cmath>

namespace withe {

/// Replaces std::hypot, which requires glibc 2.35, while wheels must run with 2.34. Squares must not overflow.
inline double hypotenuse(double x, double y) { return std::sqrt(x * x + y * y); }

}  // namespace withe
