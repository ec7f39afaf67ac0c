#include "vision/cable_fit.hpp"

#include <algorithm>
#include <cmath>

#include "vision/cable_ends.hpp"

namespace withe {

/// Flank that the crossing cable does not cover at the start of the gap, seen from one branch to the other.
CableOutline::Flank CableOutline::flank_that_shows(const Continuations& links, HalfEdge from, HalfEdge to) {
  const auto zone_of = [&](HalfEdge half) { return links.zone_of[static_cast<std::size_t>(half)]; };
  const int first = zone_of(from);
  const int last = zone_of(to);
  if (first < 0 || last < 0) return Flank::unknown;
  std::vector<Vector2> others;
  const auto collect = [&](int zone) {
    for (const HalfEdge half : links.zones[static_cast<std::size_t>(zone)].branches) {
      const int beyond = zone_of(opposite(half));
      const bool link = first != last && (beyond == first || beyond == last);
      if (half != from && half != to && !link) others.push_back(links.branches[static_cast<std::size_t>(half)].point);
    }
  };
  collect(first);
  if (last != first) collect(last);
  if (others.size() != 2) return Flank::unknown;
  const Vector2& start = links.branches[static_cast<std::size_t>(from)].point;
  const Vector2& end = links.branches[static_cast<std::size_t>(to)].point;
  const auto aside = [&](const Vector2& point) {
    const Vector2 a = end - start, b = point - start;
    return a.x() * b.y() - a.y() * b.x();
  };
  if ((aside(others[0]) > 0) == (aside(others[1]) > 0)) return Flank::unknown;  // they touch
  const double straight = (others[0] - start).norm() + (others[1] - end).norm();
  const double crosswise = (others[1] - start).norm() + (others[0] - end).norm();
  const Vector2& beside_start = straight < crosswise ? others[0] : others[1];
  // At angles above about 37 degrees the gap is short, and both flanks are hidden for most of it.
  if (std::max(straight, crosswise) < 3 * std::min(straight, crosswise)) return Flank::unknown;
  return aside(beside_start) > 0 ? Flank::right : Flank::left;
}

CableOutline::CableOutline(const SkeletonGraph& graph, const Continuations& links, const CablePath& path)
    : closed_(path.closed) {
  for (const HalfEdge entry : path.entries) {
    const SkeletonEdge& edge = graph.edges[static_cast<std::size_t>(edge_of(entry))];
    const int n = static_cast<int>(edge.points.size());
    int first = 0;
    int last = n - 1;
    if (edge.nodes[0] >= 0) {
      first = links.branches[static_cast<std::size_t>(entry)].skip;
      last -= links.branches[static_cast<std::size_t>(opposite(entry))].skip;
    }
    if (last < first) first = last = n / 2;
    int gap = kNoGap;
    Flank shows = Flank::unknown;
    if (!points_.empty() || (closed_ && edge.nodes[0] >= 0)) {
      const HalfEdge exit = links.partner[static_cast<std::size_t>(entry)];
      gap = links.zone_of[static_cast<std::size_t>(entry)];
      if (exit >= 0) gap = std::max(gap, links.zone_of[static_cast<std::size_t>(exit)]);
      if (exit >= 0 && links.ways[static_cast<std::size_t>(exit)].empty()) shows = flank_that_shows(links, exit, entry);
      if (exit >= 0 && !points_.empty()) add_way(links.ways[static_cast<std::size_t>(exit)], gap);
    }
    if (points_.empty()) {
      closing_zone_ = gap;
      closing_shows_ = shows;
      gap = kNoGap;
      shows = Flank::unknown;
    }
    if (n == 0) {
      const Vector2 middle = links.branches[static_cast<std::size_t>(entry)].point;
      points_.push_back({middle, edge.half_width, gap, shows});
      continue;
    }
    for (int i = first; i <= last; ++i) {
      const SkeletonPoint& point = edge.points[static_cast<std::size_t>(end_of(entry) == 0 ? i : n - 1 - i)];
      points_.push_back(
          {point.position(), point.half_width, i == first ? gap : kNoGap, i == first ? shows : Flank::unknown});
    }
  }
  if (closed_ && closing_zone_ >= 0) {
    add_way(links.ways[static_cast<std::size_t>(opposite(path.entries.back()))], closing_zone_);
  }
}

void CableOutline::add_way(const std::vector<Vector2>& way, int zone) {
  for (const Vector2& point : way) points_.push_back({point, points_.back().half_width, zone});
}

void CableOutline::extend(bool at_end, const std::vector<Vector2>& points) {
  if (points_.empty() || points.empty()) return;
  std::vector<Point> more;
  more.reserve(points.size());
  const double half_width = (at_end ? points_.back() : points_.front()).half_width;
  for (const Vector2& point : points) more.push_back({point, half_width, kNoGap});
  if (at_end) {
    points_.insert(points_.end(), more.begin(), more.end());
  } else {
    points_.front().zone_before = kNoGap;
    points_.insert(points_.begin(), more.rbegin(), more.rend());
  }
}

double CableOutline::length() const {
  double sum = 0;
  for (std::size_t i = 1; i < points_.size(); ++i) sum += (points_[i].position - points_[i - 1].position).norm();
  return sum;
}

std::vector<double> CableOutline::stations(double& total) const {
  // A chain of pixels is longer than the line that it represents. Steps are therefore measured over five pixels.
  const int n = static_cast<int>(points_.size());
  std::vector<double> result(points_.size(), 0.0);
  int run_start = 0;
  for (int i = 1; i < n; ++i) {
    const Point& here = points_[static_cast<std::size_t>(i)];
    double step = 0;
    if (here.zone_before != kNoGap) {
      run_start = i;
      step = (here.position - points_[static_cast<std::size_t>(i - 1)].position).norm();
    } else {
      int from = std::max(i - 3, run_start);
      int to = i;
      while (to + 1 < n && to < i + 2 && points_[static_cast<std::size_t>(to + 1)].zone_before == kNoGap) ++to;
      step =
          (points_[static_cast<std::size_t>(to)].position - points_[static_cast<std::size_t>(from)].position).norm() /
          (to - from);
    }
    result[static_cast<std::size_t>(i)] = result[static_cast<std::size_t>(i - 1)] + std::max(step, 0.05);
  }
  total = result.back();
  if (closed_) total += std::max((points_.front().position - points_.back().position).norm(), 0.5);
  return result;
}

namespace {

struct Place {
  Vector2 point, normal;
  Flanks flanks;
};

/// Place where the visible flank changes: the middle of the stretch in which the mask is hardly wider than its least
/// width.
std::size_t find_waist(const std::vector<Place>& places, double half_width) {
  const std::size_t size = places.size();
  if (size <= 8) return size / 2;
  const auto wide = [&](std::size_t k) {
    double sum = 0;
    for (std::size_t j = k - 2; j <= k + 2; ++j) sum += places[j].flanks.left + places[j].flanks.right;
    return sum / 5;
  };
  std::size_t waist = size / 2;
  for (std::size_t k = size / 5 + 2; k + size / 5 + 2 < size; ++k) {
    if (wide(k) < wide(waist)) waist = k;
  }
  const double level = wide(waist) + half_width;
  std::size_t first = waist, last = waist;
  while (first > 2 && wide(first - 1) < level) --first;
  while (last + 3 < size && wide(last + 1) < level) ++last;
  return (first + last) / 2;
}

/// Between the rows of a line over a length [px].
double row_spacing(const MatrixX2& line, bool closed, double total) {
  return total / static_cast<double>(closed ? line.rows() : line.rows() - 1);
}

}  // namespace

std::vector<FitSample> CableOutline::flank_samples(const BitImage& mask, const MatrixX2& line, double spacing,
                                                   const std::vector<double>& station) const {
  const std::ptrdiff_t n = line.rows();
  const auto measure = [&](std::ptrdiff_t row, double limit, Vector2& point, Vector2& normal) -> Flanks {
    const std::ptrdiff_t before = closed_ ? (row + n - 1) % n : std::max<std::ptrdiff_t>(row - 1, 0);
    const std::ptrdiff_t after = closed_ ? (row + 1) % n : std::min(row + 1, n - 1);
    const Vector2 tangent = (line.row(after) - line.row(before)).transpose().normalized();
    point = line.row(row).transpose();
    normal = Vector2(-tangent.y(), tangent.x());
    return measure_flanks(mask, point, normal, limit);
  };
  std::vector<FitSample> samples;
  Vector2 point, normal;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const int zone = i > 0 ? points_[i].zone_before : closing_zone_;
    if (zone < 0) continue;
    const double from = i > 0 ? station[i - 1] : station.back();
    const double to = i > 0 ? station[i] : spacing * static_cast<double>(n);
    const double half_width = 0.5 * ((i > 0 ? points_[i - 1] : points_.back()).half_width + points_[i].half_width);
    // Result of the same measurement for the whole cable, just outside.
    const double margin = half_width;
    double width = 0;
    int count = 0;
    for (double s = margin; s < margin + 6 * half_width; s += spacing) {
      for (const double place : {(from - s) / spacing, (to + s) / spacing}) {
        const auto row = static_cast<std::ptrdiff_t>(std::lround(place));
        if (row < 0 || row >= n) continue;
        const Flanks flanks = measure(row, 2 * half_width + 1, point, normal);
        if (flanks.left + flanks.right > 2.6 * half_width + 1) continue;
        width += flanks.left + flanks.right;
        ++count;
      }
    }
    if (count < 3) continue;
    const double own = 0.5 * width / count;
    std::vector<Place> places;
    for (double s = from; s <= to; s += spacing) {
      Place place;
      const auto row = std::min(static_cast<std::ptrdiff_t>(std::lround(s / spacing)), n - 1);
      place.flanks = measure(row, 2 * half_width + 1, place.point, place.normal);
      places.push_back(place);
    }
    const std::size_t size = places.size();
    const Flank shows = i > 0 ? points_[i].shows : closing_shows_;
    const std::size_t waist = shows == Flank::unknown ? 0 : find_waist(places, own);
    for (std::size_t k = 0; k < size; ++k) {
      const auto& [place, normal_here, flanks] = places[k];
      const bool known = shows != Flank::unknown;
      const bool left = known ? (shows == Flank::left) == (k < waist) : flanks.left < flanks.right;
      const double beyond = (left ? flanks.left : flanks.right) - own;
      if (std::abs(beyond) > std::max(0.4 * own, known ? 2.0 : 0.0)) continue;
      samples.push_back(
          {place + (left ? beyond : -beyond) * normal_here, from + static_cast<double>(k) * spacing, 0.5 * spacing});
    }
  }
  return samples;
}

double CableOutline::median_half_width() const {
  std::vector<double> half_widths;
  for (const Point& point : points_) half_widths.push_back(point.half_width);
  const auto middle = half_widths.begin() + static_cast<std::ptrdiff_t>(half_widths.size() / 2);
  std::nth_element(half_widths.begin(), middle, half_widths.end());
  return *middle;
}

std::vector<FitSample> CableOutline::point_samples(const std::vector<double>& station) const {
  std::vector<FitSample> samples;
  for (std::size_t i = 0; i < points_.size(); ++i) samples.push_back({points_[i].position, station[i], 1.0});
  // If there is only one sample, a second one determines the line.
  if (samples.size() == 1) samples.push_back({samples[0].point + Vector2(1, 0), samples[0].station + 1, 1.0});
  return samples;
}

double CableOutline::lengthen_gaps(const MatrixX2& line, bool closed, double total,
                                   std::vector<double>& station) const {
  const std::ptrdiff_t n = line.rows();
  const double h = row_spacing(line, closed, total);
  std::vector<double> arc(static_cast<std::size_t>(n) + 1, 0.0);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const double step = i + 1 < n || closed ? (line.row((i + 1) % n) - line.row(i)).norm() : 0.0;
    arc[static_cast<std::size_t>(i) + 1] = arc[static_cast<std::size_t>(i)] + step;
  }
  const auto arc_at = [&](double s) {
    const double place = std::clamp(s / h, 0.0, static_cast<double>(n) - 1e-9);
    const auto i = static_cast<std::size_t>(place);
    return arc[i] + (place - static_cast<double>(i)) * (arc[i + 1] - arc[i]);
  };
  const double closing = std::max(total - station.back(), arc_at(total) - arc_at(station.back()));
  double shift = 0;
  std::vector<double> moved = station;
  for (std::size_t i = 1; i < points_.size(); ++i) {
    if (points_[i].zone_before != kNoGap) {
      const double gap = station[i] - station[i - 1];
      shift += std::clamp(arc_at(station[i]) - arc_at(station[i - 1]), gap, 3 * gap) - gap;
    }
    moved[i] = station[i] + shift;
  }
  station = moved;
  return std::max(moved.back() + (closed ? closing : 0.0), 1.0);
}

void CableOutline::describe_rows(const std::vector<double>& places, const std::vector<double>& station, int number,
                                 Cable& cable, std::vector<HiddenStretch>& stretches) const {
  const std::size_t count = places.size();
  cable.widths.resize(count);
  cable.hidden.assign(count, 0);
  const std::size_t own = stretches.size();
  std::size_t next = 0;
  for (std::size_t r = 0; r < count; ++r) {
    const double s = places[r];
    while (next < points_.size() && station[next] < s) ++next;
    const bool wraps = next == points_.size() || next == 0;
    const Point& after = points_[next == points_.size() ? (cable.closed ? 0 : next - 1) : next];
    const Point& before = points_[next == 0 ? 0 : next - 1];
    const int gap = !wraps ? after.zone_before : (cable.closed ? closing_zone_ : kNoGap);
    double t = 1;
    if (!wraps && station[next] > station[next - 1]) t = (s - station[next - 1]) / (station[next] - station[next - 1]);
    cable.widths[r] = std::max(1.0, 2 * ((1 - t) * before.half_width + t * after.half_width));
    if (gap == kNoGap) continue;
    cable.hidden[r] = 1;
    if (gap < 0) continue;
    const int row = static_cast<int>(r);
    if (!stretches.empty() && stretches.back().cable == number && stretches.back().zone == gap &&
        stretches.back().last == row - 1) {
      stretches.back().last = row;
    } else {
      stretches.push_back({gap, number, row, row});
    }
  }
  // A stretch of a ring that contains its first row is one stretch, and continues beyond the last row.
  if (!cable.closed || stretches.size() < own + 2) return;
  const HiddenStretch first = stretches[own];
  HiddenStretch& last = stretches.back();
  if (first.first != 0 || last.last != static_cast<int>(count) - 1 || first.zone != last.zone) return;
  last.last += first.last + 1;
  stretches.erase(stretches.begin() + static_cast<std::ptrdiff_t>(own));
}

Cable CableOutline::fit(const BitImage& mask, const TraceOptions& options, int number,
                        std::vector<HiddenStretch>& stretches) const {
  Cable cable;
  cable.closed = closed_ && points_.size() >= 8;
  double total = 0;
  std::vector<double> station = stations(total);
  const double stiffness = options.stiffness_length * std::clamp(std::max(median_half_width(), 0.5), 1.5, 12.0);
  const double spacing = std::min(2.0, stiffness);
  total = std::max(total, 1.0);
  MatrixX2 line = fit_least_bending(point_samples(station), total, spacing, stiffness, cable.closed);

  bool gaps = closing_zone_ != kNoGap;
  bool shallow = closing_shows_ != Flank::unknown;
  for (const Point& point : points_) {
    gaps = gaps || point.zone_before != kNoGap;
    shallow = shallow || point.shows != Flank::unknown;
  }
  if (gaps) {
    total = lengthen_gaps(line, cable.closed, total, station);
    // Flanks are searched from the line that was fitted without them. Flanks of shallow crossings are searched again
    // from the resulting line.
    const int rounds = shallow ? 3 : 2;
    for (int round = 0; round < rounds; ++round) {
      std::vector<FitSample> samples = point_samples(station);
      if (round > 0) {
        const std::vector<FitSample> flanks =
            flank_samples(mask, line, row_spacing(line, cable.closed, total), station);
        samples.insert(samples.end(), flanks.begin(), flanks.end());
      }
      line = fit_least_bending(samples, total, spacing, stiffness, cable.closed);
    }
  }

  std::vector<double> places;
  cable.centreline = resample(line, options.spacing, cable.closed, &places);
  const double h = row_spacing(line, cable.closed, total);
  for (double& place : places) place *= h;
  describe_rows(places, station, number, cable, stretches);
  return cable;
}

}  // namespace withe
