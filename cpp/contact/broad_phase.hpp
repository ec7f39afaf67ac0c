#pragma once
/// Overlapping boxes, in a time proportional to the number of boxes and of overlapping pairs.

#include <vector>

#include "geometry/vec3.hpp"

namespace withe {

/// An axis-aligned box.
struct Box {
  double low[3], high[3];

  /// The smallest that holds two points, grown by `margin` on every side.
  static Box around(const Vec3<double>& p, const Vec3<double>& q, double margin);
  void include(const Box& other);
  bool overlaps(const Box& other) const {
    for (int k = 0; k < 3; ++k)
      if (low[k] > other.high[k] || other.low[k] > high[k]) return false;
    return true;
  }
};

/// Finds overlaps by sorting boxes into the cells of a grid about as wide as a box. Keeps its memory between calls.
class BroadPhase {
 public:
  struct Pair {
    int a, b;  ///< a < b
  };
  /// Every overlapping pair once, sorted.
  const std::vector<Pair>& find(const std::vector<Box>& boxes);

 private:
  struct Entry {
    long long cell;
    int box;
  };
  /// Cubes of one width.
  struct Grid {
    double origin[3], width;

    static Grid of(const std::vector<Box>& boxes);
    long long cell(double x, int axis) const { return static_cast<long long>((x - origin[axis]) / width); }
  };

  void sort_into_cells(const std::vector<Box>& boxes, const Grid& grid);
  void pair_within_cells(const std::vector<Box>& boxes, const Grid& grid);
  void pair_large(const std::vector<Box>& boxes);

  std::vector<Entry> entries_;
  std::vector<int> large_;
  std::vector<Pair> pairs_;
};

}  // namespace withe
