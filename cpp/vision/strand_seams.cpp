#include "vision/strand_seams.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "vision/cable_ends.hpp"
#include "vision/strand_colors.hpp"
#include "vision/width_runs.hpp"

namespace withe {

namespace {

bool is_junction(const SkeletonGraph& graph, int node) { return node >= 0 && graph.nodes[at(node)].edges.size() >= 3; }

/// Continuation of a line where a wide run becomes narrower.
struct Narrowing {
  enum class Side { left, middle, right } side = Side::middle;
  double width = 0;
};

/// None if two runs do not follow each other closely, or if the second is not much narrower.
std::optional<Narrowing> narrowing(const SkeletonLine& line, const WidthRun& wide, const WidthRun& narrow) {
  constexpr double thinnest = 0.3, widest = 0.7;  // width of the other strand; a ragged border is 0.2
  if (narrow.width < thinnest * wide.width || narrow.width > widest * wide.width) return std::nullopt;
  const bool behind = narrow.first > wide.last;
  const auto inset = [](const WidthRun& run) { return std::min(static_cast<int>(0.5 * run.width), run.length() / 3); };
  const int from = behind ? wide.last - inset(wide) : wide.first + inset(wide);
  const int to = behind ? narrow.first + inset(narrow) : narrow.last - inset(narrow);
  const Vector2 way = line.position(to) - line.position(from);
  if (way.norm() > 4 * wide.width) return std::nullopt;
  // On an arc the tangents at both ends have opposite equal angles with the chord.
  const double aside = 0.5 * (cross(line.tangent(from), way) + cross(line.tangent(to), way));
  const double of_strand = 0.5 * (wide.width - narrow.width);
  if (std::abs(aside) < 0.5 * of_strand) return Narrowing{Narrowing::Side::middle, narrow.width};
  return Narrowing{aside > 0 ? Narrowing::Side::left : Narrowing::Side::right, narrow.width};
}

/// Seams of strands across a run, as fractions of its width from the left.
class Borders {
 public:
  explicit Borders(double width) : width_(width) {}
  void add(double fraction) {
    constexpr double apart = 0.12;
    if (fraction < apart || fraction > 1 - apart) return;
    for (const double other : fractions_) {
      if (std::abs(other - fraction) < apart) return;
    }
    fractions_.insert(std::upper_bound(fractions_.begin(), fractions_.end(), fraction), fraction);
  }
  /// Splits the remaining parts that are two, three, ... times as wide as a single cable.
  void split_multiples(double single) {
    const std::vector<double> before = fractions_;
    double left = 0;
    for (std::size_t i = 0; i <= before.size(); ++i) {
      const double right = i < before.size() ? before[i] : 1;
      const int count = count_strands((right - left) * width_, single);
      for (int k = 1; k < count; ++k) fractions_.push_back(left + (right - left) * k / count);
      left = right;
    }
    std::sort(fractions_.begin(), fractions_.end());
  }
  const std::vector<double>& fractions() const { return fractions_; }

 private:
  double width_;
  std::vector<double> fractions_;
};

class SeamCutter {
 public:
  SeamCutter(const SkeletonGraph& graph, const ZoneOptions& options, const ColorImage* image, const BitImage& mask)
      : graph_(graph), options_(options), image_(image), mask_(mask), runs_(find_width_runs(graph, mask)) {}

  bool run(BitImage& result, std::vector<DoubtfulZone>& doubts) {
    bool cut = false;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      const WidthRun& run = runs_[r];
      const SkeletonEdge& edge = graph_.edges[at(run.edge)];
      if (is_junction(graph_, edge.nodes[0]) && is_junction(graph_, edge.nodes[1])) continue;
      const SkeletonLine line(edge);
      const std::vector<double> fractions = find_borders(r, line);
      for (const double fraction : fractions) cut_along(seam(line, run, fraction), result);
      if (fractions.empty()) continue;
      doubts.push_back({line.position((run.first + run.last) / 2), Doubt::parallel_strands});
      cut = true;
    }
    return cut;
  }

 private:
  std::vector<double> find_borders(std::size_t r, const SkeletonLine& line) {
    const WidthRun& run = runs_[r];
    Borders borders(run.width);
    constexpr double enough_beside = 1.5, enough = 3, alike = 0.1;
    if (run.length() < enough_beside * run.width || run.width < 4) return {};
    bool sleeve = false;                              // a sleeve thickens a cable on both sides
    for (const std::size_t other : {r - 1, r + 1}) {  // r - 1 may wrap around: no such run
      if (other >= runs_.size() || runs_[other].edge != run.edge) continue;
      const auto beyond = narrowing(line, run, runs_[other]);
      if (!beyond) continue;
      sleeve = sleeve || beyond->side == Narrowing::Side::middle;
      const double fraction = beyond->width / run.width;
      if (beyond->side != Narrowing::Side::middle) {
        borders.add(beyond->side == Narrowing::Side::left ? fraction : 1 - fraction);
      }
    }
    for (const double fraction : fork_borders(run, line)) borders.add(fraction);
    if (run.length() < enough * run.width) return borders.fractions();
    if (image_ != nullptr) {
      for (const double fraction : hue_borders(*image_, line, run)) borders.add(fraction);
    }
    if (!sleeve && borders.fractions().empty() && shading(run, line, 2).value_or(1) < alike) borders.add(0.5);
    if (sleeve) return borders.fractions();
    const double single = narrower_cable(runs_, run.width);
    const int count = single > 0 ? count_strands(run.width, single) : 0;
    if (!borders.fractions().empty() || (count > 1 && shading(run, line, count).value_or(0) < 0.5)) {
      if (single > 0) borders.split_multiples(single);
    }
    return borders.fractions();
  }

  std::optional<double> shading(const WidthRun& run, const SkeletonLine& line, int count) const {
    return image_ == nullptr ? std::nullopt : shading_misfit(*image_, line, run, count);
  }

  /// Node of the branches into which the run forks at an end of its edge, if they are together as wide as it.
  std::vector<double> fork_borders(const WidthRun& run, const SkeletonLine& line) {
    const SkeletonEdge& edge = graph_.edges[at(run.edge)];
    for (const int end : {0, 1}) {
      const int node = edge.nodes[at(end)];
      const int left_over = end == 0 ? run.first : line.count() - 1 - run.last;
      if (!is_junction(graph_, node) || left_over > 2 * run.width) continue;
      if (branches_.empty()) branches_ = measure_branches(graph_, options_);
      const int row = end == 0 ? run.first : run.last;
      const Vector2 outwards = end == 0 ? Vector2(-line.tangent(row)) : line.tangent(row);
      std::vector<std::pair<double, double>> prongs;  // place to the left and width
      double sum = 0;
      bool ahead = true;
      for (const int other : graph_.nodes[at(node)].edges) {
        if (other == run.edge) continue;
        const int side = graph_.edges[at(other)].nodes[0] == node ? 0 : 1;
        const Branch& branch = branches_[at(2 * other + side)];
        ahead = ahead && -branch.tangent.dot(outwards) > 0.7;
        const double width = 2 * branch.half_width + 0.5;
        prongs.emplace_back(cross(line.tangent(row), branch.point - line.position(row)), width);
        sum += width;
      }
      if (!ahead || prongs.size() < 2 || std::abs(sum - run.width) > 0.2 * run.width) continue;
      std::sort(prongs.rbegin(), prongs.rend());
      std::vector<double> fractions;
      double from_left = 0;
      for (std::size_t k = 0; k + 1 < prongs.size(); ++k) {
        from_left += prongs[k].second / sum;
        fractions.push_back(from_left);
      }
      return fractions;
    }
    return {};
  }

  /// The border between two strands along a run. It extends beyond the ends of the run as far as the strands lie side
  /// by side.
  std::vector<Vector2> seam(const SkeletonLine& line, const WidthRun& run, double fraction) {
    std::vector<Vector2> raw;
    for (int i = run.first; i <= run.last; i += 2) {
      const Flanks flanks = measure_flanks(mask_, line.position(i), line.normal(i), 1.5 * run.width);
      const double width = flanks.left + flanks.right;
      if (std::abs(width - run.width) > 0.25 * run.width) continue;
      raw.push_back(line.position(i) + (flanks.left - fraction * width) * line.normal(i));
    }
    std::vector<Vector2> points;
    const int n = static_cast<int>(raw.size());
    const bool ring = line.closed() && run.length() > line.count() - 4;
    for (int i = 0; i < n; ++i) {
      Vector2 sum = Vector2::Zero();
      const int reach = ring ? 3 : std::min({3, i, n - 1 - i});
      for (int k = -reach; k <= reach; ++k) sum += raw[at((i + k + n) % n)];
      points.push_back(sum / (2 * reach + 1));
    }
    if (n < 4) return {};
    if (ring) {
      points.push_back(points.front());
      return points;
    }
    extend(points, run.width);
    std::reverse(points.begin(), points.end());
    extend(points, run.width);
    return points;
  }

  /// Extends the seam in a straight line to the border of the mask. Adds nothing if the seam does not leave the mask,
  /// as in a crossing.
  void extend(std::vector<Vector2>& points, double width) {
    const int n = static_cast<int>(points.size());
    const Vector2 end = points.back();
    const Vector2 direction = (end - points[at(std::max(0, n - 1 - 6))]).normalized();
    const Vector2 normal(-direction.y(), direction.x());
    constexpr double beside = 1.6;  // distance from the flank on which the other strand has ended [px]
    const double ahead = reach_border(mask_, end, direction, 3 * width);
    for (double s = 0; s < ahead; s += 0.5) {
      const Vector2 point = end + s * direction;
      for (const double side : {1.0, -1.0}) {
        if (reach_border(mask_, point, side * normal, beside + 1) > beside) continue;
        points.push_back(point);
        points.push_back(point + side * (beside + 1) * normal);
        return;
      }
    }
    if (ahead < 3 * width - 0.5) points.push_back(end + (ahead + 1) * direction);
  }

  /// Removes a line of pixels, wide enough that pixels on its two sides do not touch.
  static void cut_along(const std::vector<Vector2>& points, BitImage& mask) {
    constexpr double half_width = 0.75;
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vector2& a = points[i - 1];
      const Vector2 way = points[i] - a;
      const Vector2 low = a.cwiseMin(points[i]), high = a.cwiseMax(points[i]);
      for (int y = static_cast<int>(std::floor(low.y())); y <= static_cast<int>(std::ceil(high.y())); ++y) {
        for (int x = static_cast<int>(std::floor(low.x())); x <= static_cast<int>(std::ceil(high.x())); ++x) {
          const Vector2 to = Vector2(x, y) - a;
          const double t = std::clamp(to.dot(way) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
          if (mask.at(x, y) && (to - t * way).norm() <= half_width) mask.clear(x, y);
        }
      }
    }
  }

  const SkeletonGraph& graph_;
  const ZoneOptions& options_;
  const ColorImage* image_;
  const BitImage& mask_;
  std::vector<WidthRun> runs_;
  std::vector<Branch> branches_;  // measured when a fork needs them
};

}  // namespace

bool cut_seams(const SkeletonGraph& graph, const ZoneOptions& options, const ColorImage* image, BitImage& mask,
               std::vector<DoubtfulZone>& doubts) {
  const BitImage whole = mask;
  return SeamCutter(graph, options, image, whole).run(mask, doubts);
}

}  // namespace withe
