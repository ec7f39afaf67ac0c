#include "vision/crossings.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace withe {

namespace {

Vector2 row_of(const Cable& cable, int row) {
  const auto n = static_cast<int>(cable.centreline.rows());
  return cable.centreline.row(cable.closed ? (row + n) % n : std::clamp(row, 0, n - 1)).transpose();
}

int wrap(const Cable& cable, int row) {
  const auto n = static_cast<int>(cable.centreline.rows());
  return cable.closed ? (row % n + n) % n : std::clamp(row, 0, n - 1);
}

/// Place on two segments where they meet, as fractions of their lengths.
std::optional<Vector2> meet(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d) {
  const Vector2 u = b - a;
  const Vector2 v = d - c;
  const double denominator = cross(u, v);
  if (denominator == 0) return std::nullopt;
  const double s = cross(c - a, v) / denominator;
  const double t = cross(c - a, u) / denominator;
  if (s < 0 || s >= 1 || t < 0 || t >= 1) return std::nullopt;
  return Vector2(s, t);
}

struct Box {
  Vector2 low, high;
};

/// A stretch and some rows to either side, since the ends of zones are not sharp.
struct Reach {
  HiddenStretch stretch;
  Box box;
};

Reach widen(const Cable& cable, HiddenStretch stretch) {
  const int n = static_cast<int>(cable.centreline.rows());
  const int more = 2 + static_cast<int>(cable.widths[static_cast<std::size_t>(stretch.first)] / 3);
  stretch.first -= more;
  stretch.last += more;
  if (!cable.closed) {
    stretch.first = std::max(stretch.first, 0);
    stretch.last = std::min(stretch.last, n - 1);
  } else if (stretch.last - stretch.first >= n) {
    stretch.last = stretch.first + n - 1;
  }
  Reach result{stretch, {row_of(cable, stretch.first), row_of(cable, stretch.first)}};
  for (int row = stretch.first; row <= stretch.last; ++row) {
    result.box.low = result.box.low.cwiseMin(row_of(cable, row));
    result.box.high = result.box.high.cwiseMax(row_of(cable, row));
  }
  return result;
}

std::vector<Crossing> meetings(const std::vector<Cable>& cables, const Reach& a, const Reach& b) {
  std::vector<Crossing> found;
  const Cable& first = cables[static_cast<std::size_t>(a.stretch.cable)];
  const Cable& second = cables[static_cast<std::size_t>(b.stretch.cable)];
  const bool same = a.stretch.cable == b.stretch.cable;
  for (int i = a.stretch.first; i < a.stretch.last; ++i) {
    const Vector2 p = row_of(first, i);
    const Vector2 q = row_of(first, i + 1);
    if (std::max(p.x(), q.x()) < b.box.low.x() || std::min(p.x(), q.x()) > b.box.high.x() ||
        std::max(p.y(), q.y()) < b.box.low.y() || std::min(p.y(), q.y()) > b.box.high.y()) {
      continue;
    }
    for (int j = b.stretch.first; j < b.stretch.last; ++j) {
      if (same && std::abs(i - j) < 3) continue;
      const auto place = meet(p, q, row_of(second, j), row_of(second, j + 1));
      if (!place) continue;
      Crossing crossing;
      crossing.point = p + place->x() * (q - p);
      crossing.over = {a.stretch.cable, wrap(first, i + (place->x() >= 0.5 ? 1 : 0))};
      crossing.under = {b.stretch.cable, wrap(second, j + (place->y() >= 0.5 ? 1 : 0))};
      found.push_back(crossing);
    }
  }
  return found;
}

/// Crossings of a hidden stretch with all cables, unless they are known.
void cross_beneath(const std::vector<Cable>& cables, const Reach& bridge, std::vector<Crossing>& crossings) {
  const auto own = static_cast<std::size_t>(bridge.stretch.cable);
  const double width = cables[own].widths[at(wrap(cables[own], bridge.stretch.first))];
  const auto cross_rows = [&](std::size_t c, int first, int last) {
    if (last <= first) return;
    const Reach whole{{-1, static_cast<int>(c), first, last}, {bridge.box.low, bridge.box.high}};
    const std::vector<Crossing> found = meetings(cables, whole, bridge);
    if (found.size() % 2 == 0) return;
    const Crossing& middle = found[found.size() / 2];
    const auto is_known = [&](const Crossing& other) {
      const bool pair = (other.over.cable == middle.over.cable && other.under.cable == middle.under.cable) ||
                        (other.over.cable == middle.under.cable && other.under.cable == middle.over.cable);
      return pair && (other.point - middle.point).norm() < 2 * width;
    };
    if (std::none_of(crossings.begin(), crossings.end(), is_known)) crossings.push_back(middle);
  };
  for (std::size_t c = 0; c < cables.size(); ++c) {
    const int n = static_cast<int>(cables[c].centreline.rows());
    if (c != own) {
      cross_rows(c, 0, cables[c].closed ? n : n - 1);
    } else if (!cables[c].closed) {  // the rows beside the stretch belong to it
      const int beside = static_cast<int>(width);
      cross_rows(c, 0, bridge.stretch.first - beside);
      cross_rows(c, bridge.stretch.last + beside, n - 1);
    }
  }
}

}  // namespace

std::vector<Crossing> find_crossings(const std::vector<Cable>& cables, const std::vector<HiddenStretch>& stretches,
                                     int first_bridge) {
  std::vector<HiddenStretch> sorted = stretches;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const HiddenStretch& a, const HiddenStretch& b) { return a.zone < b.zone; });
  std::vector<Reach> reaches;
  reaches.reserve(sorted.size());
  for (const HiddenStretch& stretch : sorted) {
    reaches.push_back(widen(cables[static_cast<std::size_t>(stretch.cable)], stretch));
  }
  std::vector<Crossing> crossings;
  for (std::size_t i = 0; i < reaches.size(); ++i) {
    for (std::size_t j = i + 1; j < reaches.size() && reaches[j].stretch.zone == reaches[i].stretch.zone; ++j) {
      const Box& a = reaches[i].box;
      const Box& b = reaches[j].box;
      if ((a.low.array() > b.high.array()).any() || (b.low.array() > a.high.array()).any()) continue;
      const std::vector<Crossing> found = meetings(cables, reaches[i], reaches[j]);
      if (found.size() % 2 == 1) crossings.push_back(found[found.size() / 2]);
    }
  }
  for (const Reach& bridge : reaches) {
    if (bridge.stretch.zone >= first_bridge) cross_beneath(cables, bridge, crossings);
  }
  return crossings;
}

RayHit cast_ray(const std::vector<Cable>& cables, const std::vector<HiddenStretch>& stretches, int zone,
                const Vector2& from, const Vector2& direction, double longest) {
  RayHit hit;
  hit.distance = longest;
  for (const HiddenStretch& stretch : stretches) {
    if (stretch.zone != zone) continue;
    const Cable& cable = cables[static_cast<std::size_t>(stretch.cable)];
    const Reach reach = widen(cable, stretch);
    for (int row = reach.stretch.first; row < reach.stretch.last; ++row) {
      const Vector2 a = row_of(cable, row);
      const Vector2 b = row_of(cable, row + 1);
      const auto place = meet(from, from + hit.distance * direction, a, b);
      if (!place) continue;
      hit.distance *= place->x();
      hit.sine = std::abs(cross(direction, (b - a).normalized()));
      hit.through = {stretch.cable, wrap(cable, row + (place->y() >= 0.5 ? 1 : 0))};
    }
  }
  return hit;
}

}  // namespace withe
