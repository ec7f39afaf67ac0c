#include "vision/cable_ends.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace withe {

namespace {

bool inside(const BitImage& mask, const Vector2& point) {
  return mask.at(static_cast<int>(std::lround(point.x())), static_cast<int>(std::lround(point.y())));
}

}  // namespace

double reach_border(const BitImage& mask, const Vector2& from, const Vector2& direction, double limit) {
  constexpr double step = 0.25;
  double distance = step;
  while (distance < limit && inside(mask, from + distance * direction)) distance += step;
  return distance - 0.5 * step;
}

Flanks measure_flanks(const BitImage& mask, const Vector2& from, const Vector2& normal, double limit) {
  return {reach_border(mask, from, normal, limit), reach_border(mask, from, -normal, limit)};
}

EndShape measure_end(const BitImage& mask, const Vector2& point, const Vector2& tangent, double half_width) {
  const Vector2 normal(-tangent.y(), tangent.x());
  const double limit = 3 * half_width + 2;
  const auto ahead = [&](double aside) {
    const Vector2 start = point + aside * half_width * normal;
    return inside(mask, start) ? reach_border(mask, start, tangent, limit) : 0.0;
  };
  const auto mean_ahead = [&](double from, double to) {
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const double aside = from + (to - from) * k / 3;
      sum += ahead(aside) + ahead(-aside);
    }
    return sum / 8;
  };
  const double middle = mean_ahead(0.0, 0.3);
  return {middle, (middle - mean_ahead(0.5, 0.8)) / half_width};
}

std::vector<Vector2> grow_end(const BitImage& mask, const Branch& tip) {
  std::vector<Vector2> points;
  const double half_width = tip.half_width;
  const double wide = 2 * half_width + 1;
  const double longest = 8 * half_width + 30;
  Vector2 point = tip.point;
  Vector2 tangent = tip.tangent;
  if (!inside(mask, point)) return points;
  double left_to_go = 0;
  double way = 0;
  while (true) {
    left_to_go = reach_border(mask, point, tangent, 3 * half_width + 2);
    // Beyond this place the border in front would pull the point aside.
    if (left_to_go < half_width + 1 || way > longest) break;
    const Vector2 normal(-tangent.y(), tangent.x());
    Vector2 next = point + tangent;
    const Flanks flanks = measure_flanks(mask, next, normal, wide);
    if (flanks.left + flanks.right > 3 * half_width + 2) break;  // not this cable alone
    // In front of an oblique cut only one of both flanks belongs to the cable.
    if (flanks.left + flanks.right > 1.6 * half_width) {
      next += std::clamp(0.5 * (flanks.left - flanks.right), -0.3, 0.3) * normal;
    }
    const Vector2 turned = 0.9 * tangent + 0.1 * (next - point).normalized();
    tangent = turned.normalized();
    point = next;
    points.push_back(point);
    way += 1;
  }
  const EndShape shape = measure_end(mask, point, tangent, half_width);
  const double limit = 3 * half_width + 2;
  if (shape.middle >= limit - 1) return points;  // runs into something else
  // A few pixels decide, so the estimate stays away from either extreme: a wrong one costs less than a half width.
  const double roundness = std::clamp(0.2 + 0.6 * (shape.fallen - 0.08) / 0.14, 0.2, 0.8);
  const double rest = shape.middle - roundness * half_width;
  for (double s = 1; s < rest; s += 1) points.push_back(point + s * tangent);
  if (rest > 0) points.push_back(point + rest * tangent);
  return points;
}

}  // namespace withe
