#include "geometry/tube.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/check.hpp"

namespace withe {
namespace {

double length(const Vec3d& v) { return std::sqrt(dot(v, v)); }

/// Adds s (1 - e e^T - f f^T), with two unit vectors at a right angle.
void add_across(double s, const Vec3d& e, const Vec3d& f, Mat3<double>& out) {
  for (int k = 0; k < 3; ++k) {
    const Vec3d unit{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
    out.row[k] += s * (unit - e[k] * e - f[k] * f);
  }
}

}  // namespace

Tube::Tube(const std::vector<Vec3d>& ends, const std::vector<Vec3d>& middles, double inner, double wall)
    : inner_(inner), wall_(wall) {
  require(!middles.empty() && ends.size() == middles.size() + 1, "the axis of a tube needs one end more than curves");
  require(inner > 0.0 && wall > 0.0 && std::isfinite(inner) && std::isfinite(wall),
          "radius and wall of a tube must be positive");
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const Vec3d along = middles[i] - ends[i], bend = ends[i + 1] - middles[i] - along;
    require(dot(along, along) > 0.0 && dot(along + bend, along + bend) > 0.0 && std::isfinite(dot(bend, bend)),
            "the axis of a tube has a curve without length, curve ", i);
    curves_.push_back({ends[i], along, bend});
  }
  add_ball(0, static_cast<int>(curves_.size()));
}

int Tube::add_ball(int first, int end) {
  const auto index = balls_.size();
  const auto far_end = [](const Curve& c) { return c.start + 2.0 * c.along + c.bend; };
  Vec3d low = curves_[static_cast<std::size_t>(first)].start, high = low;
  const auto each_point = [&](const auto& take) {
    for (int i = first; i < end; ++i) {
      const Curve& c = curves_[static_cast<std::size_t>(i)];
      for (const Vec3d& x : {c.start, c.start + c.along, far_end(c)}) take(x);
    }
  };
  each_point([&](const Vec3d& x) {
    low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
    high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
  });
  Ball ball{0.5 * (low + high), 0.0, first, end, -1, -1};
  each_point([&](const Vec3d& x) { ball.radius = std::max(ball.radius, length(x - ball.centre)); });
  balls_.push_back(ball);
  if (end - first > 2) {
    const int middle = (first + end) / 2, left = add_ball(first, middle), right = add_ball(middle, end);
    balls_[index].left = left;
    balls_[index].right = right;
  }
  return static_cast<int>(index);
}

Tube::Nearest Tube::nearest(const Vec3d& x) const {
  Nearest out;
  out.square = std::numeric_limits<double>::infinity();
  const auto look = [&](int index) {
    const Curve& c = curves_[static_cast<std::size_t>(index)];
    const auto slope = [&](double t) {
      return dot(c.start + t * (2.0 * c.along + t * c.bend) - x, c.along + t * c.bend);
    };
    double low = 0.0, high = 1.0, t = 0.0;
    if (slope(1.0) <= 0.0) {
      t = 1.0;
    } else if (slope(0.0) < 0.0) {
      // Newton's method between two bounds
      t = std::clamp(dot(x - c.start, c.along) / (2.0 * dot(c.along, c.along)), 0.0, 1.0);
      for (int i = 0; i < 60; ++i) {
        const double f = slope(t);
        (f > 0.0 ? high : low) = t;
        const Vec3d p = c.along + t * c.bend;
        const double change = 2.0 * dot(p, p) + dot(c.start + t * (2.0 * c.along + t * c.bend) - x, c.bend);
        double next = change > 0.0 ? t - f / change : -1.0;
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (std::abs(next - t) <= 1e-15) break;
        t = next;
      }
    }
    const Vec3d off = c.start + t * (2.0 * c.along + t * c.bend) - x;
    const double square = dot(off, off);
    if (square < out.square) out = {index, t, square};
  };
  std::array<int, 128> open;
  int count = 0;
  open[static_cast<std::size_t>(count++)] = 0;
  const auto bound = [&](int index) {
    const Ball& ball = balls_[static_cast<std::size_t>(index)];
    return std::max(0.0, length(x - ball.centre) - ball.radius);
  };
  while (count > 0) {
    const int index = open[static_cast<std::size_t>(--count)];
    const double least = bound(index);
    if (least * least > out.square) continue;
    const Ball& ball = balls_[static_cast<std::size_t>(index)];
    if (ball.left < 0) {
      for (int i = ball.first; i < ball.end; ++i) look(i);
      continue;
    }
    const bool left_first = bound(ball.left) < bound(ball.right);
    open[static_cast<std::size_t>(count++)] = left_first ? ball.right : ball.left;
    open[static_cast<std::size_t>(count++)] = left_first ? ball.left : ball.right;
  }
  return out;
}

ShapeDistance Tube::distance(const Vec3d& x) const {
  constexpr double kTiny = 1e-300;
  const Nearest near = nearest(x);
  const Curve& c = curves_[static_cast<std::size_t>(near.curve)];
  const double t = near.t, middle = inner_ + 0.5 * wall_;
  const Vec3d point = c.start + t * (2.0 * c.along + t * c.bend), slope = 2.0 * (c.along + t * c.bend);
  Vec3d way = x - point;
  const Vec3d tangent = (1.0 / length(slope)) * slope;
  const bool last = near.curve + 1 == static_cast<int>(curves_.size()) && t == 1.0, first = near.curve == 0 && t == 0.0;
  const double past = dot(way, tangent);
  ShapeDistance out;
  if ((last && past > 0.0) || (first && past < 0.0)) {
    way -= past * tangent;
    const double rho = length(way), over = rho - middle;
    const Vec3d e = (1.0 / std::max(rho, kTiny)) * way;
    out.distance = std::sqrt(over * over + past * past);
    const double inverse = 1.0 / std::max(out.distance, kTiny);
    out.normal = (over * inverse) * e + (past * inverse) * tangent;
    for (int k = 0; k < 3; ++k)
      out.change.row[k] = inverse * (e[k] * e + tangent[k] * tangent - out.normal[k] * out.normal);
    add_across(over * inverse / std::max(rho, kTiny), e, tangent, out.change);
    return out;
  }
  const double rho = length(way), inverse = 1.0 / std::max(rho, kTiny), side = rho < middle ? -1.0 : 1.0;
  const Vec3d e = inverse * way;
  out.distance = std::abs(rho - middle);
  out.normal = side * e;
  add_across(side * inverse, e, tangent, out.change);
  // Along the axis: |p'|^2 / f' for 1. Within a curve; between two curves it is that of one of them.
  const double square = dot(slope, slope), f = square - 2.0 * dot(way, c.bend);
  const double along = side * inverse * (1.0 - square / std::max(f, 1e-3 * square));
  for (int k = 0; k < 3; ++k) out.change.row[k] += (along * tangent[k]) * tangent;
  return out;
}

}  // namespace withe
