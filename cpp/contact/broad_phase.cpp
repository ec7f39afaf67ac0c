#include "contact/broad_phase.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace withe {
namespace {

constexpr int kMaxCells = 64;                   // a box that covers more is compared with every other one
constexpr long long kMaxCellsOfAxis = 1 << 20;  // cells along an axis, at most

}  // namespace

Box Box::around(const Vec3<double>& p, const Vec3<double>& q, double margin) {
  return {{std::min(p.x, q.x) - margin, std::min(p.y, q.y) - margin, std::min(p.z, q.z) - margin},
          {std::max(p.x, q.x) + margin, std::max(p.y, q.y) + margin, std::max(p.z, q.z) + margin}};
}

void Box::include(const Box& other) {
  for (int k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
}

/// About as wide as a box.
BroadPhase::Grid BroadPhase::Grid::of(const std::vector<Box>& boxes) {
  Grid grid{{INFINITY, INFINITY, INFINITY}, 0.0};
  double size = 0.0, end[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (const Box& box : boxes) {
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) {
      longest = std::max(longest, box.high[k] - box.low[k]);
      grid.origin[k] = std::min(grid.origin[k], box.low[k]);
      end[k] = std::max(end[k], box.high[k]);
    }
    size += longest;
  }
  const double extent = std::max({end[0] - grid.origin[0], end[1] - grid.origin[1], end[2] - grid.origin[2]});
  grid.width =
      std::max({size / static_cast<double>(boxes.size()), extent / static_cast<double>(kMaxCellsOfAxis - 2), 1e-300});
  return grid;
}

/// Boxes that cover many cells are set aside.
void BroadPhase::sort_into_cells(const std::vector<Box>& boxes, const Grid& grid) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    long long first[3], last[3], count = 1;
    for (int k = 0; k < 3; ++k) {
      first[k] = grid.cell(boxes[i].low[k], k);
      last[k] = grid.cell(boxes[i].high[k], k);
      count *= last[k] - first[k] + 1;
    }
    if (count > kMaxCells) {
      large_.push_back(static_cast<int>(i));
      continue;
    }
    for (long long x = first[0]; x <= last[0]; ++x)
      for (long long y = first[1]; y <= last[1]; ++y)
        for (long long z = first[2]; z <= last[2]; ++z)
          entries_.push_back({(x * kMaxCellsOfAxis + y) * kMaxCellsOfAxis + z, static_cast<int>(i)});
  }
  std::sort(entries_.begin(), entries_.end(),
            [](const Entry& a, const Entry& b) { return a.cell != b.cell ? a.cell < b.cell : a.box < b.box; });
}

/// Boxes that share several cells are a pair in the first of them only.
void BroadPhase::pair_within_cells(const std::vector<Box>& boxes, const Grid& grid) {
  for (std::size_t begin = 0; begin < entries_.size();) {
    std::size_t stop = begin + 1;
    while (stop < entries_.size() && entries_[stop].cell == entries_[begin].cell) ++stop;
    for (std::size_t i = begin; i < stop; ++i)
      for (std::size_t j = i + 1; j < stop; ++j) {
        const Box &a = boxes[static_cast<std::size_t>(entries_[i].box)],
                  &b = boxes[static_cast<std::size_t>(entries_[j].box)];
        if (!a.overlaps(b)) continue;
        long long first = 0;
        for (int k = 0; k < 3; ++k) first = first * kMaxCellsOfAxis + grid.cell(std::max(a.low[k], b.low[k]), k);
        if (first == entries_[begin].cell) pairs_.push_back({entries_[i].box, entries_[j].box});
      }
    begin = stop;
  }
}

void BroadPhase::pair_large(const std::vector<Box>& boxes) {
  for (const int mine : large_)
    for (int other = 0; other < static_cast<int>(boxes.size()); ++other) {
      const bool other_large = std::binary_search(large_.begin(), large_.end(), other);
      if (other == mine || (other_large && other < mine)) continue;
      if (boxes[static_cast<std::size_t>(mine)].overlaps(boxes[static_cast<std::size_t>(other)]))
        pairs_.push_back({std::min(mine, other), std::max(mine, other)});
    }
}

const std::vector<BroadPhase::Pair>& BroadPhase::find(const std::vector<Box>& boxes) {
  pairs_.clear();
  entries_.clear();
  large_.clear();
  if (boxes.size() < 2) return pairs_;
  const Grid grid = Grid::of(boxes);
  sort_into_cells(boxes, grid);
  pair_within_cells(boxes, grid);
  pair_large(boxes);
  std::sort(pairs_.begin(), pairs_.end(),
            [](const Pair& a, const Pair& b) { return a.a != b.a ? a.a < b.a : a.b < b.b; });
  return pairs_;
}

}  // namespace withe
