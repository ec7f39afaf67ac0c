#include "contact/candidates.hpp"

#include <algorithm>
#include <cmath>

namespace withe {
namespace {

// Depth by which surfaces may pass through each other between two states, over the smaller radius: deeper ones should
// have met.
constexpr double kMaxGrazingDepth = 0.1;
// Lower bound of a distance to go, over its rounded value: sums of coordinates lose a few of their sixteen digits.
constexpr double kRoundedDown = 1.0 - 1e-9;

/// Distance of a coordinate outside of two bounds; NaN if it is NaN.
double outside(double x, double low, double high) { return x < low ? low - x : x - std::min(x, high); }

double way_between(const std::vector<Obstacle>& from, const std::vector<Obstacle>& to) {
  double square = 0.0;
  for (std::size_t o = 0; o < to.size(); ++o)
    for (const Vec3d& way : {to[o].point - from[o].point, to[o].other - from[o].other})
      square = std::max(square, dot(way, way));
  return std::sqrt(square);
}

// Share of the distance of a body that an iteration must leave. Half of it would bring the middle of a ball between two
// rods in a few iterations, without any centrelines that cross.
constexpr double kMinDistanceOfBody = 0.98;

/// Least allowed distance of centrelines: `share` times their distance at the start of a motion, or `nearest`,
/// whichever is less.
struct Limit {
  double share, nearest;  ///< [-], [m]
};
Limit apart(const ContactPair& pair) { return {pair.narrow() ? kMinDistanceOfBody : kMinDistance, pair.nearest()}; }

/// Allowed share of a motion, by conservative advancement: the distance, a function of that much, falls no faster
/// than by `speed`.
template <class Distance>
double advance(const Limit& limit, double speed, const Distance& distance_at) {
  const double start = distance_at(0.0);
  const double least = std::min(limit.share * start, limit.nearest);
  double tau = 0.0, distance = start;
  for (int k = 0; k < 100; ++k) {
    tau += (distance - 0.99 * least) / speed;
    if (tau >= 1.0) return 1.0;
    distance = distance_at(tau);
    if (distance <= least) break;
  }
  return tau;
}

/// Allowed share of the motion of a piece of a curve.
double allowed_of_piece(const Bodies& bodies, const ContactPair& pair, const VectorX& q, const VectorX* change,
                        const Vec3d& shift, const Limit& limit) {
  Vec3d x[4], d[4] = {};
  bodies.end_points(pair, q, x);
  if (change) bodies.end_points(pair, *change, d);
  double speed = 0.0;
  for (int i = 0; i < pair.piece.weights->nodes; ++i) {
    d[i] -= shift;
    speed = std::max(speed, dot(d[i], d[i]));
  }
  // Shares of nodes in points, and of points in the distance, add up to no more than 7/6 and 5/4, each taken as
  // positive.
  speed = 1.5 * std::sqrt(speed);
  if (speed == 0.0) return 1.0;
  return advance(limit, speed, [&](double tau) {
    Vec3d moved[3];
    for (int i = 0; i < 3; ++i) moved[i] = x[i] + tau * d[i];
    return curve_distance(pair.piece, bodies.obstacle(pair), moved).distance;
  });
}

/// Allowed share of the motion of a point beside a face. Points of the face move no faster than its tail does, and by
/// how much its axes turn.
double allowed_beside(const Bodies& bodies, const ContactPair& pair, const VectorX& q, const VectorX* change,
                      const Vec3d (&x)[4], const Vec3d (&d)[4], const Limit& limit) {
  const Face& face = *pair.face;
  const Vec3d aside = local_position(*bodies.model, q, face.aside),
              way = change ? local_position(*bodies.model, *change, face.aside) : Vec3d{},
              point = x[0] + pair.point * (x[1] - x[0]), moved = d[0] + pair.point * (d[1] - d[0]) - d[2];
  const auto size = [](const Vec3d& v) { return std::sqrt(dot(v, v)); };
  const double turned = 2.0 * size(d[3] - d[2]) / face.length + size(way - d[2]) / size(aside - x[2]),
               speed = size(moved) + 2.0 * turned * face.size;
  if (speed == 0.0) return 1.0;
  const auto place = [&](double tau) {
    const FaceAxes axes(x[2] + tau * d[2], x[3] + tau * d[3], aside + tau * way);
    return distance_from(face, axes, point + tau * (d[0] + pair.point * (d[1] - d[0])));
  };
  if (place(0.0).height < 0.0 && place(1.0).height < 0.0) return 1.0;  // behind the face, beside another one
  return advance(limit, speed, [&](double tau) { return place(tau).distance; });
}

/// Allowed share for straight lines, whose distance falls no faster than their ends approach each other. `change` is
/// the change of q; null: rods stay. `shift` is that of the obstacle.
double allowed_of(const Bodies& bodies, const ContactPair& pair, const VectorX& q, const VectorX* change,
                  const Vec3d& shift, const Limit& limit) {
  if (pair.curve()) return allowed_of_piece(bodies, pair, q, change, shift, limit);
  Vec3d x[4], d[4] = {Vec3d{}, Vec3d{}, shift, shift};
  bodies.end_points(pair, q, x);
  const int edges[2] = {pair.key.a, pair.key.b};
  for (int side = 0; change && side < (pair.key.b < 0 ? 1 : 2); ++side) {
    d[2 * side] = local_vector(*bodies.model, *change, bodies.model->tail_dof[at(edges[side])]);
    d[2 * side + 1] = local_vector(*bodies.model, *change, bodies.model->head_dof[at(edges[side])]);
  }
  if (pair.face != nullptr) return allowed_beside(bodies, pair, q, change, x, d, limit);
  double speed = 0.0;
  for (int a = 0; a < 2; ++a)
    for (int b = 2; b < 4; ++b) speed = std::max(speed, dot(d[a] - d[b], d[a] - d[b]));
  speed = std::sqrt(speed);
  const Vec3d middle = 0.5 * (x[0] + x[1] - x[2] - x[3]), u = x[1] - x[0], v = x[3] - x[2];
  const double bound =
      std::sqrt(dot(middle, middle)) - 0.5 * (std::sqrt(dot(u, u)) + std::sqrt(dot(v, v))) - limit.nearest;
  if (speed <= bound) return 1.0;
  return advance(limit, speed, [&](double tau) {
    const ClosestPoints c = closest_points(x[0] + tau * d[0], x[1] + tau * d[1], x[2] + tau * d[2], x[3] + tau * d[3],
                                           pair.weight_a, pair.weight_b);
    return std::sqrt(dot(c.between, c.between));
  });
}

/// Distance of centrelines, from an obstacle where it was before its shift.
double distance_of(const Bodies& bodies, const ContactPair& pair, const VectorX& q, const Vec3d& shift) {
  if (pair.curve()) return bodies.piece_distance(pair, q, shift).distance;
  Vec3d x[4];
  bodies.end_points(pair, q, x);
  if (pair.face != nullptr) return bodies.proximity(pair, q).apart();
  const Vec3d between = closest_points(x[0], x[1], x[2] - shift, x[3] - shift, pair.weight_a, pair.weight_b).between;
  return std::sqrt(dot(between, between));
}

}  // namespace

Candidates::Candidates(const Model& model, const Surfaces& surfaces)
    : model_(model), surfaces_(surfaces), pairs_(surfaces.obstacle_pairs()) {}

void Candidates::forget() {
  pairs_ = surfaces_.obstacle_pairs();
  reference_.resize(0);
  bounds_.clear();
  last_.resize(0);
}

/// By how much less than before two bodies may be apart, over two, since bounds were last looked at.
double Candidates::way_from_last(const VectorX& q, const Bodies& bodies) const {
  if (last_.size() != q.size() || last_obstacles_.size() != bodies.obstacles.size()) return INFINITY;
  return farthest(model_, q - last_) + 2.0 * way_between(last_obstacles_, bodies.obstacles);
}

/// Updates the candidates for q, and the bounds of their distances there.
void Candidates::reach(const VectorX& q, const Bodies& bodies) {
  moved_ += way_from_last(q, bodies);
  if (outgrown(q, nullptr)) find_pairs(q, q);
  if (!std::isfinite(moved_)) {
    moved_ = 0.0;
    bounds_.clear();
  }
  last_ = q;
  last_obstacles_ = bodies.obstacles;
  bounds_.resize(pairs_.size());
}

/// A distance changes by no more than both edges move.
void Candidates::set_bounds(double distance, std::size_t p) {
  const ContactPair& pair = pairs_[p];
  const auto above = [&](double least) { return moved_ + kRoundedDown * 0.5 * (distance - least); };
  // The weights of closest_points make this distance greater than that of the points themselves.
  const double weights = 0.25 * (pair.weight_a + pair.weight_b);
  bounds_[p] = {above(pair.reach()), above(std::sqrt(pair.nearest() * pair.nearest() + weights))};
}

/// True if a node has left, or would leave, the margin of the candidates.
bool Candidates::outgrown(const VectorX& q, const VectorX* change) const {
  if (surfaces_.edges().empty()) return false;
  if (reference_.size() != q.size()) return true;
  const double most = 0.25 * margin_ * margin_;
  for (int dof : model_.node_dof) {
    double square = 0.0, later = 0.0;
    for (int k = dof; k < dof + model_.dimension; ++k) {
      const double d = outside(q(k), low_(k), high_(k));
      square += d * d;
      if (!change) continue;
      const double then = outside(q(k) + (*change)(k), low_(k), high_(k));
      later += then * then;
    }
    if (!(std::max(square, later) <= most)) return true;
  }
  return false;
}

/// Boxes of all edges that may touch others, on a way, grown by half of the tolerance and by `more` than that.
template <class More>
void Candidates::set_boxes(const VectorX& from, const VectorX& to, const More& more, std::vector<Box>& out) const {
  out.clear();
  for (int e : surfaces_.edges()) {
    const int tail = model_.edge_tail[at(e)], head = model_.edge_head[at(e)];
    const double grow = surfaces_.radius(e) + 0.5 * surfaces_.tolerance(e) + more(e);
    Box box = Box::around(local_position(model_, from, tail), local_position(model_, from, head), grow);
    if (&from != &to)
      box.include(Box::around(local_position(model_, to, tail), local_position(model_, to, head), grow));
    out.push_back(box);
  }
  for (const Face& face : surfaces_.faces()) {
    const auto around = [&](const VectorX& q) {
      const FaceAxes axes = axes_of(model_, q, face);
      const auto corner = [&](double x, double y) { return axes.origin + x * axes.first + y * axes.second; };
      const double grow = face.depth + 0.5 * surfaces_.greatest_tolerance() + more(face.edge);
      Box box = Box::around(corner(face.low[0], face.low[1]), corner(face.high[0], face.high[1]), grow);
      box.include(Box::around(corner(face.low[0], face.high[1]), corner(face.high[0], face.low[1]), grow));
      return box;
    };
    Box box = around(from);
    if (&from != &to) box.include(around(to));
    out.push_back(box);
  }
}

/// Pairs that are near at q, with edges thicker by a number of radii.
void Candidates::find_near(const VectorX& q, double radii, CandidateSearch& search) const {
  search.boxes.clear();
  if (q.size() > 0) set_boxes(q, q, [&](int e) { return radii * surfaces_.radius(e); }, search.boxes);
  add_near(search.broad_phase.find(search.boxes), search.pairs);
}

/// Candidates for the way from one configuration to another, and beyond by a margin that grows with the last travel.
void Candidates::find_pairs(const VectorX& from, const VectorX& to) {
  if (surfaces_.edges().empty()) return;
  double travel = 0.0;
  if (reference_.size() == to.size())
    for (int dof : model_.node_dof)
      travel = std::max(travel, (to.segment(dof, model_.dimension) - reference_.segment(dof, model_.dimension)).norm());
  const double reach = surfaces_.greatest_reach();
  margin_ = std::clamp(4.0 * travel, 0.25 * reach, 2.0 * reach);
  set_boxes(from, to, [&](int) { return 0.5 * margin_; }, boxes_);
  add_near(broad_phase_.find(boxes_), pairs_);
  // Iterates go to and fro on a way whose candidates are all known.
  low_ = from.cwiseMin(to);
  high_ = from.cwiseMax(to);
  reference_ = to;
  bounds_.assign(pairs_.size(), {});
}

/// Pairs with obstacles, and pairs of edges with overlapping boxes, sorted by key.
void Candidates::add_near(const std::vector<BroadPhase::Pair>& found, std::vector<ContactPair>& pairs) const {
  const std::vector<ContactPair>& fixed = surfaces_.obstacle_pairs();
  const int edges = static_cast<int>(surfaces_.edges().size());
  pairs.assign(fixed.begin(), fixed.end());
  for (const BroadPhase::Pair& boxes : found) {
    if (boxes.a >= edges) continue;  // faces do not touch each other
    const int a = surfaces_.edges()[at(boxes.a)];
    if (boxes.b >= edges) {
      surfaces_.add_face_pairs(a, surfaces_.faces()[at(boxes.b - edges)], pairs);
      continue;
    }
    const int b = surfaces_.edges()[at(boxes.b)];
    if (surfaces_.may_touch(a, b)) pairs.push_back(surfaces_.pair(a, b));
  }
  if (!surfaces_.faces().empty())
    std::sort(pairs.begin() + static_cast<std::ptrdiff_t>(fixed.size()), pairs.end(),
              [](const ContactPair& a, const ContactPair& b) { return a.key < b.key; });
}

std::vector<ContactKey> Candidates::near(const VectorX& q, const Bodies& bodies) const {
  CandidateSearch search;
  find_near(q, kMaxPatternDistance, search);
  std::vector<ContactKey> keys;
  for (const ContactPair& pair : search.pairs)
    if (pair.key.b < 0 || bodies.proximity(pair, q).distance < pair.reach() + kMaxPatternDistance * pair.radii())
      keys.push_back(pair.key);
  std::sort(keys.begin(), keys.end());
  return keys;
}

double Candidates::allowed(const VectorX& q, const Bodies& bodies, const VectorX& change) {
  if (outgrown(q, &change)) {
    end_ = q + change;
    find_pairs(q, end_);
  }
  double least = 1.0;
  bounds_.resize(pairs_.size());
  const double here = moved_ + way_from_last(q, bodies), coming = farthest(model_, change);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    if (bounds_[p].open - here >= coming || bodies.flat(pairs_[p])) continue;
    least = std::min(least, allowed_of(bodies, pairs_[p], q, &change, Vec3d{}, apart(pairs_[p])));
  }
  return least;
}

bool Candidates::blocked(const VectorX& q, const Bodies& bodies, const std::vector<Vec3d>& shift) const {
  for (const ContactPair& pair : surfaces_.obstacle_pairs())
    if (!bodies.flat(pair) && allowed_of(bodies, pair, q, nullptr, shift[at(-1 - pair.key.b)], apart(pair)) < 1.0)
      return true;
  return false;
}

bool Candidates::missed(const VectorX& before, const VectorX& q, const Bodies& bodies,
                        const std::vector<Vec3d>& shift) {
  double farthest_shift = 0.0;
  for (const Vec3d& s : shift) farthest_shift = std::max(farthest_shift, std::sqrt(dot(s, s)));
  back_ = before - q;
  const double way = 2.0 * (farthest(model_, back_) + farthest_shift);
  const double here = moved_ + way_from_last(q, bodies);
  for (std::size_t p = 0; p < bounds_.size(); ++p) {
    const ContactPair& pair = pairs_[p];
    // Who is as deep on the way, and apart at its ends, has gone farther than a radius.
    if (way < pair.scale || bounds_[p].clear - here >= way || bodies.flat(pair)) continue;
    const Vec3d moved = pair.key.b < 0 && !shift.empty() ? shift[at(-1 - pair.key.b)] : Vec3d{};
    const double touching = pair.radii();
    if (distance_of(bodies, pair, q, Vec3d{}) < touching || distance_of(bodies, pair, before, moved) < touching)
      continue;
    if (allowed_of(bodies, pair, q, &back_, -moved, {1.0, touching - kMaxGrazingDepth * pair.scale}) < 1.0) return true;
  }
  return false;
}

}  // namespace withe
