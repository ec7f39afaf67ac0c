#pragma once
/// The line of least bending through points measured along it.

#include <vector>

#include "common/types.hpp"

namespace withe {

/// A point that the line should pass near, `station` along it [px].
struct FitSample {
  Vector2 point;
  double station = 0;
  double weight = 1;
};

/// Points at equal stations 0, `spacing`, ... of the line that minimises
///   sum of weight |x(station) - point|^2  +  stiffness_length^4 integral of |x''|^2.
/// Bumps shorter than the stiffness length [px] are smoothed away. Without samples nearby, the line has the least
/// possible bending. A closed line returns to its first point after `length`; that point is not repeated.
MatrixX2 fit_least_bending(const std::vector<FitSample>& samples, double length, double spacing,
                           double stiffness_length, bool closed);

/// Points at equal distances of at most `spacing` along a polyline; `rows`, if not null, receives for every point its
/// place in the original line, in rows. A closed line is followed back to its first point, which is not repeated.
MatrixX2 resample(const MatrixX2& line, double spacing, bool closed, std::vector<double>* rows = nullptr);

}  // namespace withe
