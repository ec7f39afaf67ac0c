#pragma once
/// Length of the hypotenuse.

#include <cmath>

namespace withe {

/// Not std::hypot: it asks for glibc 2.35, and a wheel must do with 2.34. Squares must not overflow.
inline double hypotenuse(double x, double y) { return std::sqrt(x * x + y * y); }

}  // namespace withe
