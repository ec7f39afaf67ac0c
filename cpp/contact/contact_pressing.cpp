#include <algorithm>
#include <cmath>

#include "contact/contact.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

/// What surfaces that press do. On a plane the end's direction is also the mean one.
void Contact::press(const Touching& t, bool with_hessian, ContactLocal& out) const {
  if (!conserving_ || pairs_[at(t.pair)].plane()) {
    add_pressing(t, with_hessian, out);
    return;
  }
  add_mean_pressing(t, with_hessian && geometric_, out);
  if (!with_hessian || geometric_) return;
  ContactLocal straight{};
  add_pressing(t, true, straight);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) out.hessian[i][j] += straight.hessian[i][j];
}

/// The gradient of k E(D) at the end of the step.
void Contact::add_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = pairs_[at(t.pair)];
  double w[4], g[12];
  end_weights(t.points.s, t.points.t, w);
  if (pair.plane()) w[2] = w[3] = 0.0;
  // dD = sum w_i (between / D) . dx_i: |between| differs from D by the weights of closest_points.
  const Vec3d direction = pair.plane() ? t.normal : (1.0 / t.distance) * t.points.between;
  const double n[3] = {direction.x, direction.y, direction.z};
  for (int i = 0; i < 12; ++i) {
    g[i] = w[i / 3] * n[i % 3];
    out.gradient[i] += t.energy.first * g[i];
  }
  if (!with_hessian) return;
  if (pair.plane()) {
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) out.hessian[i][j] += t.energy.second * g[i] * g[j];
    return;
  }
  Vec3d x[4];
  end_points(pair, q1_, x);
  double H[12][12];
  half_square_hessian(t.points, x[1] - x[0], x[3] - x[2], pair.weight_a, pair.weight_b, H);
  const double turn = geometric_ ? t.energy.first / t.distance : 0.0;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) out.hessian[i][j] += turn * H[i][j] + (t.energy.second - turn) * g[i] * g[j];
}

/// In an energy-momentum step the force k E'(D1) pushes along the mean of the way d1 between the closest points at the
/// end and the way d0 between those same points of both rods at the start,
///   k E'(D1) w_i (d0 + d1) / (D0 + D1),   D0 = sqrt(|d0|^2 + D1^2 - |d1|^2),
/// whose work over the step is k E'(D1) (D1 - D0). As no points were closer at the start than the closest, and E is
/// convex, that is never more than what the contact gave: pressing gains no energy, however far surfaces slide. And the
/// force points along the way between the points in the middle of the step: it turns nothing there.
void Contact::add_mean_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = pairs_[at(t.pair)];
  double w[4];
  end_weights(t.points.s, t.points.t, w);
  Vec3d x[4], start[4];
  end_points(pair, q1_, x);
  end_points(pair, state_->q, start);
  const Vec3d shift = shift_of(pair), &d1 = t.points.between;
  start[2] -= shift;
  start[3] -= shift;
  Vec3d d0{};
  for (int i = 0; i < 4; ++i) d0 += w[i] * start[i];
  const double before = std::sqrt(std::max(dot(d0, d0) + t.distance * t.distance - dot(d1, d1), 0.0));
  const double sum = before + t.distance, force = t.energy.first / sum;
  const Vec3d mean = d0 + d1;
  for (int i = 0; i < 12; ++i) out.gradient[i] += force * w[i / 3] * mean[i % 3];
  if (!with_hessian) return;
  const Vec3d u = x[1] - x[0], v = x[3] - x[2], u0 = start[1] - start[0], v0 = start[3] - start[2];
  const double ws[4] = {-1, 1, 0, 0}, wt[4] = {0, 0, 1, -1};
  double K[2][2];
  parameter_inverse(t.points.s_free, t.points.t_free, u, v, pair.weight_a, pair.weight_b, K);
  for (int j = 0; j < 12; ++j) {
    const int n = j / 3, k = j % 3;
    const double by_s = ws[n] * d1[k] + w[n] * u[k], by_t = wt[n] * d1[k] - w[n] * v[k];
    const double ds = -K[0][0] * by_s - K[0][1] * by_t, dt = -K[1][0] * by_s - K[1][1] * by_t;
    const Vec3d moved0 = ds * u0 - dt * v0, moved1 = ds * u - dt * v;
    const double spread = pair.weight_a * (t.points.s - 0.5) * ds + pair.weight_b * (t.points.t - 0.5) * dt;
    const double distance = w[n] * d1[k] / t.distance;
    const double change = (t.energy.second * distance - force * (distance + (dot(d0, moved0) + spread) / before)) / sum;
    for (int i = 0; i < 12; ++i) {
      const double share = ws[i / 3] * ds + wt[i / 3] * dt;
      const double turned = moved0[i % 3] + moved1[i % 3] + (i % 3 == k ? w[n] : 0.0);
      out.hessian[i][j] += (w[i / 3] * change + force * share) * mean[i % 3] + force * w[i / 3] * turned;
    }
  }
}

}  // namespace withe
