#include "contact/surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

#include "geometry/segment_distance.hpp"
#include "model/rod_rows.hpp"

namespace withe {
namespace {

double norm(const Vec3d& v) { return std::sqrt(dot(v, v)); }

bool obstacle_order(const ContactKey& a, const ContactKey& b) {
  return std::tie(b.b, a.a, a.end) < std::tie(a.b, b.a, b.end);
}

double parallel_weight(double length, double radii) {
  const double size = std::min(length, radii);
  return kParallelWeight * size * size;
}

// Length of the edge of a ball over its radius, at most.
constexpr double kBall = 1e-2;
// Weight of the middle of a ball over the squared sum of radii: its closest point is the middle.
constexpr double kMiddleWeight = 100.0;

}  // namespace

bool comes_before(const ContactKey& a, const ContactKey& b) {
  if (a.b < 0 || b.b < 0) return a.b < 0 && (b.b >= 0 || obstacle_order(a, b));
  return a < b;
}

FaceAxes axes_of(const Model& model, const VectorX& q, const Face& face) {
  return {local_vector(model, q, model.tail_dof[at(face.edge)]), local_vector(model, q, model.head_dof[at(face.edge)]),
          local_position(model, q, face.aside)};
}

Surfaces::Surfaces(const Model& model) : model_(model) {
  const ContactDescription& contact = model.description.contact;
  Parameters drawn;
  set_contact(contact, drawn);
  parameters_ = drawn.surfaces;
  for (const RodDescription& rod : model.description.rods)
    for (Eigen::Index e = 0; e < rod.rest_lengths.size(); ++e)
      radius_.push_back(rod.contact_radius.size() > 0 ? rod.contact_radius(e) : 0.0);
  held_.resize(at(model.edge_count));
  for (const CarriedPart& part : model.carried)
    if (part.edge >= 0) held_[at(part.edge)] = part.is_held;
  if (contact.rods) {
    for (int e = 0; e < model.edge_count; ++e)
      if (radius(e) > 0.0) edges_.push_back(e);
    for (int e : edges_) {
      greatest_reach_ = std::max(greatest_reach_, 2.0 * radius(e) + tolerance(e));
      greatest_tolerance_ = std::max(greatest_tolerance_, tolerance(e));
    }
  }
  add_points();
  if (contact.rods) {
    add_faces();
    find_neighbours();
  }
  add_obstacles();
  note_frictional();
}

/// Varying friction counts, also if it is zero for the time being: the form of the equations stays.
void Surfaces::note_frictional() {
  const bool rods = model_.description.contact.rods;
  const SurfaceParameters& p = parameters_;
  const auto& bodies = model_.description.rods;
  frictional_ =
      rods && (p.friction > 0.0 || (p.pair_friction.col(0).array() > 0.0).any() ||
               std::any_of(bodies.begin(), bodies.end(), [](const auto& body) { return body.friction > 0.0; }));
  int rod = -1, other = 0;
  for (const ContactPair& pair : obstacle_pairs_) {
    if (frictional_) return;
    if (pair.rod_a == rod && pair.key.b == other) continue;
    rod = pair.rod_a;
    other = pair.key.b;
    const BodyFriction f = friction_of(rod, other);
    frictional_ = f.coefficients.maxCoeff() > 0.0 || p.obstacle_rolling(-1 - other) > 0.0;
  }
}

bool Surfaces::set_parameters(const SurfaceParameters& parameters) {
  if (parameters_ == parameters) return false;
  parameters_ = parameters;
  for (ContactPair& pair : obstacle_pairs_) set_parameters(pair);
  note_frictional();
  return true;
}

Surfaces::BodyFriction Surfaces::friction_of(int rod, int other) const {
  const SurfaceParameters& p = parameters_;
  const auto& bodies = model_.description.rods;
  const double own = std::max(bodies[at(rod)].friction, other < 0 ? -1.0 : bodies[at(other)].friction);
  BodyFriction f{Eigen::RowVector3d::Constant(own < 0.0 ? p.friction : own), -1};
  if (other < 0) f.coefficients = p.obstacle_friction.row(-1 - other).cwiseMax(own);
  const auto& pairs = model_.description.contact.pairs;
  for (Eigen::Index i = 0; i < p.pair_friction.rows(); ++i) {
    if (!pairs[static_cast<std::size_t>(i)].is_of(rod, other)) continue;
    if (p.pair_friction(i, 0) >= 0.0) f.coefficients = p.pair_friction.row(i);
    if (p.pair_shares[static_cast<std::size_t>(i)].size() > 0) f.given = static_cast<int>(i);
  }
  return f;
}

Eigen::Index Surfaces::place_along(const ContactPair& pair) const {
  const auto rod = at(pair.rod_a);
  const int edge = pair.key.a - model_.rod_first_edge[rod];
  const auto nodes = static_cast<int>(model_.description.rods[rod].nodes.size());
  if (!pair.curve()) return nodes + edge;
  const bool first = pair.piece.weights->edges == 1 && pair.key.end == 0;
  return (edge + (first ? 0 : 1)) % nodes;
}

void Surfaces::set_parameters(ContactPair& pair) const {
  const SurfaceParameters& p = parameters_;
  const bool obstacle = pair.key.b < 0;
  const int other = obstacle ? pair.key.b : pair.rod_b;
  const BodyFriction f = friction_of(pair.rod_a, other);
  const double share = f.given < 0 || !obstacle ? 1.0 : p.pair_shares[at(f.given)](place_along(pair));
  const Eigen::RowVector3d friction = share * f.coefficients;
  pair.set_friction(friction(0), friction(1), friction(2));
  pair.rolling = obstacle ? p.obstacle_rolling(-1 - other) : 0.0;
  pair.restitution = obstacle ? p.obstacle_restitution(-1 - other) : p.restitution;
  for (int body : {pair.rod_a, pair.rod_b})
    if (const double own = body < 0 ? -1.0 : model_.description.rods[at(body)].restitution; own >= 0.0)
      pair.restitution = std::min(pair.restitution, own);
  pair.stiffness = 0.0;
  const auto& pairs = model_.description.contact.pairs;
  for (Eigen::Index i = 0; i < p.pair_restitution.size(); ++i) {
    if (!pairs[static_cast<std::size_t>(i)].is_of(pair.rod_a, other)) continue;
    if (p.pair_restitution(i) >= 0.0) pair.restitution = p.pair_restitution(i);
    pair.stiffness = p.pair_contact_stiffness(i);
  }
}

double Surfaces::given_stiffness(int rod, int other) const {
  double given = 0.0;
  const auto& pairs = model_.description.contact.pairs;
  for (Eigen::Index i = 0; i < parameters_.pair_contact_stiffness.size(); ++i)
    if (pairs[static_cast<std::size_t>(i)].is_of(rod, other)) given = parameters_.pair_contact_stiffness(i);
  return given > 0.0 ? given : parameters_.contact_stiffness;
}

FrictionOwner Surfaces::friction_owner(const ContactPair& pair) const {
  FrictionOwner out;
  if (pair.key.b < 0) out.obstacle = -1 - pair.key.b;
  const int other = pair.key.b < 0 ? pair.key.b : pair.rod_b;
  const MatrixX3& own = parameters_.pair_friction;
  const auto& pairs = model_.description.contact.pairs;
  for (Eigen::Index i = 0; i < own.rows(); ++i)
    if (pairs[static_cast<std::size_t>(i)].is_of(pair.rod_a, other) && own(i, 0) >= 0.0) out.pair = i;
  return out;
}

double Surfaces::tolerance(int edge) const {
  const double given = model_.description.contact.distance_tolerance;
  return given > 0.0 ? given : 0.1 * scale(edge);
}

bool Surfaces::may_meet(int first, int second) const {
  const auto& pairs = model_.description.contact.pairs;
  const auto last = std::find_if(pairs.rbegin(), pairs.rend(), [&](const auto& p) { return p.is_of(first, second); });
  return last == pairs.rend() || !last->ignored;
}

void Surfaces::add_points() {
  points_.resize(at(model_.edge_count));
  std::vector<int> edges_of(at(model_.node_count), 0);
  for (int e = 0; e < model_.edge_count; ++e)
    for (int node : {model_.edge_tail[at(e)], model_.edge_head[at(e)]}) edges_of[at(node)] += body_of(e) < 0;
  std::vector<bool> known(at(model_.node_count), false);
  std::set<std::array<double, 4>> corners;  // of bodies, where ends of edges lie in one place
  for (int e = 0; e < model_.edge_count; ++e) {
    if (!(radius(e) > 0.0)) continue;
    if (ball(e)) {
      points_[at(e)].push_back({0.5, 2, 1.0});
      continue;
    }
    for (int end : {0, 1}) {
      const int node = end == 0 ? model_.edge_tail[at(e)] : model_.edge_head[at(e)];
      const Vec3d x = local_position(model_, model_.initial_q, node);
      if (body_of(e) >= 0 ? !corners.insert({static_cast<double>(body_of(e)), x.x, x.y, x.z}).second : known[at(node)])
        continue;
      known[at(node)] = true;
      points_[at(e)].push_back({static_cast<double>(end), end, edges_of[at(node)] == 1 ? 0.5 : 1.0});
    }
  }
}

void Surfaces::add_faces() {
  const auto& rods = model_.description.rods;
  for (std::size_t r = 0; r < rods.size(); ++r)
    for (const FaceDescription& face : rods[r].faces) {
      const int edge = model_.rod_first_edge[r] + face.edge;
      faces_.emplace_back(face, edge, rods[r].nodes[at(face.aside)], model_.edge_length(edge));
    }
  if (faces_.empty()) return;
  edge_faces_.resize(at(model_.edge_count));
  std::size_t first = 0;
  for (std::size_t r = 0; r < rods.size(); ++r) {
    const auto face = [&](int index) { return index < 0 ? nullptr : &faces_[first + at(index)]; };
    for (std::size_t e = 0; e < rods[r].edge_faces.size(); ++e) {
      const auto [left, right] = rods[r].edge_faces[e];
      edge_faces_[at(model_.rod_first_edge[r]) + e] = {face(left), face(right)};
    }
    first += rods[r].faces.size();
  }
}

void Surfaces::add_face_pairs(int edge, const Face& face, std::vector<ContactPair>& pairs) const {
  if (points_[at(edge)].empty() || !may_touch(edge, face.edge)) return;
  ContactPair p;
  p.face = &face;
  p.rod_a = model_.edge_rod[at(edge)];
  p.rod_b = model_.edge_rod[at(face.edge)];
  p.radius_a = radius(edge);
  p.radius_b = face.depth;
  p.tolerance = tolerance(edge);
  p.scale = scale(edge);
  p.of_body = true;
  set_parameters(p);
  for (const TouchingPoint& point : points_[at(edge)]) {
    p.key = {edge, face.edge, point.end};
    p.point = point.along;
    p.share = point.share;
    pairs.push_back(p);
  }
}

std::vector<Surfaces::SurfaceNode> Surfaces::surface_nodes() const {
  std::vector<SurfaceNode> out;
  const auto place = [&](int node) { return local_position(model_, model_.initial_q, node); };
  const auto& rods = model_.description.rods;
  std::vector<bool> drawn(at(model_.node_count), false);  // nodes of surfaces
  for (const RodDescription& rod : rods)
    for (int node : rod.nodes) drawn[at(node)] = drawn[at(node)] || rod.is_surface();
  for (const CarriedPart& surface : model_.carried) {
    if (surface.edge < 0 || surface.edge != model_.rod_first_edge[at(model_.edge_rod[at(surface.edge)])]) continue;
    const int rod = model_.edge_rod[at(surface.edge)];
    const auto add = [&](int node) {
      const Vec3d x = place(node);
      // Distances are negative inside of the body, which the nearest face shows.
      double nearest = INFINITY, sign = 1.0;
      std::vector<std::pair<int, double>> distances;  // edges, and how far they are
      for (const Face& face : faces_) {
        if (model_.edge_rod[at(face.edge)] != rod) continue;
        const FaceDistance d = distance_from(face, axes_of(model_, model_.initial_q, face), x);
        distances.emplace_back(face.edge, d.distance);
        if (d.distance >= nearest) continue;
        nearest = d.distance;
        sign = d.height < 0.0 ? -1.0 : 1.0;
      }
      for (int e = surface.edge; e < model_.rod_first_edge[at(rod + 1)]; ++e) {
        if (!(radius(e) > 0.0)) continue;
        const Vec3d tail = place(model_.edge_tail[at(e)]), way = place(model_.edge_head[at(e)]) - tail,
                    apart = x - tail;
        const double s = std::clamp(dot(apart, way) / dot(way, way), 0.0, 1.0);
        distances.emplace_back(e, std::max(0.0, norm(apart - s * way) - radius(e)));
      }
      for (const auto& [edge, distance] : distances) out.push_back({edge, node, sign * distance});
    };
    add(surface.base);
    for (const CarriedPart& part : model_.carried)
      if (part.is_node() && part.frame == surface.frame && !drawn[at(part.node)]) add(part.node);
  }
  return out;
}

/// Edges that a walk along rods, through joints too, reaches before it has gone too far for a rod to touch itself.
void Surfaces::find_neighbours() {
  std::vector<std::vector<int>> edges_at(at(model_.node_count));
  for (int e = 0; e < model_.edge_count; ++e) {
    edges_at[at(model_.edge_tail[at(e)])].push_back(e);
    edges_at[at(model_.edge_head[at(e)])].push_back(e);
  }
  neighbours_.resize(at(model_.edge_count));
  std::vector<std::vector<SurfaceNode>> surfaces_at(at(model_.node_count)), nodes_of(at(model_.edge_count));
  double inside = 0.0;  // how deep in their bodies nodes are
  for (const SurfaceNode& each : surface_nodes()) {
    inside = std::max(inside, -each.distance);
    surfaces_at[at(each.node)].push_back(each);
    nodes_of[at(each.edge)].push_back(each);
  }
  std::vector<double> distance(at(model_.node_count), INFINITY);
  using Visit = std::pair<double, int>;
  for (int e : edges_) {
    const double limit = 0.5 * std::numbers::pi * (2.0 * radius(e) + tolerance(e));
    std::priority_queue<Visit, std::vector<Visit>, std::greater<>> queue;
    std::vector<int> seen;
    const auto reach = [&](int node, double d) {
      if (d >= limit + inside || d >= distance[at(node)]) return;
      if (!std::isfinite(distance[at(node)])) seen.push_back(node);
      distance[at(node)] = d;
      queue.emplace(d, node);
    };
    reach(model_.edge_tail[at(e)], 0.0);
    reach(model_.edge_head[at(e)], 0.0);
    for (const SurfaceNode& own : nodes_of[at(e)]) reach(own.node, own.distance);
    std::vector<int>& found = neighbours_[at(e)];
    while (!queue.empty()) {
      const auto [d, node] = queue.top();
      queue.pop();
      if (d > distance[at(node)]) continue;
      for (const SurfaceNode& surface : surfaces_at[at(node)])
        if (d + surface.distance < limit) found.push_back(surface.edge);
      for (int other : edges_at[at(node)]) {
        if (d < limit) found.push_back(other);
        reach(model_.edge_tail[at(other)], d + model_.edge_length(other));
        reach(model_.edge_head[at(other)], d + model_.edge_length(other));
      }
    }
    for (int node : seen) distance[at(node)] = INFINITY;
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
  }
}

bool Surfaces::may_touch(int a, int b) const {
  if (a == b || std::binary_search(neighbours_[at(a)].begin(), neighbours_[at(a)].end(), b) ||
      std::binary_search(neighbours_[at(b)].begin(), neighbours_[at(b)].end(), a))
    return false;
  if ((held(a) && held(b)) || (body_of(a) >= 0 && body_of(a) == body_of(b))) return false;
  return may_meet(model_.edge_rod[at(a)], model_.edge_rod[at(b)]);
}

bool Surfaces::ball(int edge) const {
  return model_.is_surface(edge) && model_.edge_length(edge) < kBall * radius(edge);
}

double Surfaces::weight(int edge, double radii) const {
  return ball(edge) ? kMiddleWeight * radii * radii : parallel_weight(model_.edge_length(edge), radii);
}

ContactPair Surfaces::pair(int a, int b) const {
  ContactPair p;
  p.key = {a, b, -1};
  p.rod_a = model_.edge_rod[at(a)];
  p.rod_b = model_.edge_rod[at(b)];
  p.radius_a = radius(a);
  p.radius_b = radius(b);
  p.tolerance = std::min(tolerance(a), tolerance(b));
  p.scale = scale(p.key);
  p.of_body = model_.is_surface(a) || model_.is_surface(b);
  p.weight_a = weight(a, p.radii());
  p.weight_b = weight(b, p.radii());
  if (!edge_faces_.empty() && edge_faces_[at(a)].left != nullptr && edge_faces_[at(b)].left != nullptr) {
    p.beside_a = edge_faces_[at(a)];
    p.beside_b = edge_faces_[at(b)];
  }
  set_parameters(p);
  return p;
}

void Surfaces::add_obstacles() {
  const ContactDescription& contact = model_.description.contact;
  for (std::size_t o = 0; o < contact.obstacles.size(); ++o) {
    const ObstacleDescription& d = contact.obstacles[o];
    const ObstaclePlace place = obstacle_place(model_, d);
    obstacles_.push_back({d.kind, place.point, place.other, d.shape ? d.shape->radius() : d.radius, d.shape.get()});
    ContactPair p;
    p.key.b = -1 - static_cast<int>(o);
    p.radius_b = obstacles_.back().radius;
    for (int rod = 0; rod < static_cast<int>(model_.description.rods.size()); ++rod) {
      p.rod_a = rod;
      p.of_body = model_.description.rods[at(rod)].is_surface();
      if (!may_meet(rod, p.key.b) || held(model_.rod_first_edge[at(rod)])) continue;
      add_edges(p, obstacles_.back());
      add_pieces(p, obstacles_.back(), rod);
    }
  }
  std::sort(obstacle_pairs_.begin(), obstacle_pairs_.end(),
            [](const ContactPair& a, const ContactPair& b) { return obstacle_order(a.key, b.key); });
  for (ContactPair& pair : obstacle_pairs_) set_parameters(pair);
}

const ContactPair& Surfaces::obstacle_pair(const ContactKey& key) const {
  return *std::lower_bound(obstacle_pairs_.begin(), obstacle_pairs_.end(), key,
                           [](const ContactPair& pair, const ContactKey& k) { return obstacle_order(pair.key, k); });
}

void Surfaces::unknowns(const ContactPair& pair, int (&dofs)[kContactUnknowns]) const {
  if (!pair.curve()) {
    unknowns_of_edges(pair.key, dofs);
    return;
  }
  std::fill(std::begin(dofs), std::end(dofs), -1);
  const CurveWeights& w = *pair.piece.weights;
  for (int i = 0; i < w.nodes; ++i)
    for (int k = 0; k < model_.dimension; ++k) dofs[3 * i + k] = model_.node_dof[at(pair.piece.node[i])] + k;
  for (int b = 0; b < w.edges && frictional_ && !model_.planar(); ++b)
    dofs[12 + b] = model_.edge_dof[at(pair.piece.edge[b])];
}

void Surfaces::plane_unknowns(const ContactPair& pair, int (&dofs)[kPlaneUnknowns]) const {
  for (int i = 0; i < 3; ++i) {
    const int node = pair.piece.node[i];
    const int first = node < 0 ? -1 : model_.node_dof[at(node)];
    dofs[2 * i] = first;
    dofs[2 * i + 1] = node < 0 ? -1 : first + 1;
  }
}

void Surfaces::unknowns(const ContactKey& key, int (&dofs)[kContactUnknowns]) const {
  if (key.b < 0)
    unknowns(obstacle_pair(key), dofs);
  else
    unknowns_of_edges(key, dofs);
}

void Surfaces::unknowns_of_edges(const ContactKey& key, int (&dofs)[kContactUnknowns]) const {
  std::fill(std::begin(dofs), std::end(dofs), -1);
  const bool obstacle = key.b < 0;
  for (int side = 0; side < (obstacle ? 1 : 2); ++side) {
    const auto edge = at(side == 0 ? key.a : key.b);
    for (int k = 0; k < model_.dimension; ++k) {
      dofs[6 * side + k] = model_.tail_dof[edge] + k;
      dofs[6 * side + 3 + k] = model_.head_dof[edge] + k;
    }
    if (frictional_ && !model_.planar()) dofs[12 + side] = model_.edge_dof[edge];
  }
}

/// The distance from a point to a smaller one is no parabola along an edge.
bool Surfaces::smooth(const Obstacle& obstacle, int edge) const {
  return radius(edge) > 0.0 && (ball(edge) || obstacle.kind != ObstacleKind::capsule ||
                                obstacle.radius + radius(edge) >= model_.edge_length(edge));
}

void Surfaces::add_edges(const ContactPair& prototype, const Obstacle& obstacle) {
  for (int e = model_.rod_first_edge[at(prototype.rod_a)]; e < model_.rod_first_edge[at(prototype.rod_a + 1)]; ++e) {
    if (!(radius(e) > 0.0) || smooth(obstacle, e)) continue;
    ContactPair p = prototype;
    p.key.a = e;
    p.radius_a = radius(e);
    p.tolerance = tolerance(e);
    p.scale = scale(e);
    p.weight_a = parallel_weight(model_.edge_length(e), p.radii());
    p.weight_b = parallel_weight(norm(obstacle.other - obstacle.point), p.radii());
    if (p.weight_b == 0.0) p.weight_b = p.weight_a;  // a sphere: any point of its segment is the same
    obstacle_pairs_.push_back(p);
  }
}

void Surfaces::add_pieces(const ContactPair& prototype, const Obstacle& obstacle, int rod) {
  const int first = model_.rod_first_edge[at(rod)], end = model_.rod_first_edge[at(rod + 1)];
  const bool closed = model_.description.rods[at(rod)].closed, surface = model_.description.rods[at(rod)].is_surface();
  const auto add = [&](const CurveWeights& weights, int before, int behind, int which) {
    ContactPair p = prototype;
    p.key.a = before;
    p.key.end = which;
    p.radius_a = 0.5 * (radius(before) + radius(behind));
    p.tolerance = std::min(tolerance(before), tolerance(behind));
    p.scale = 0.5 * (scale(before, obstacle) + scale(behind, obstacle));
    if (p.scale < 0.5 * (scale(before) + scale(behind))) p.tolerance = std::min(p.tolerance, 0.1 * p.scale);
    p.piece = {&weights,
               {model_.edge_tail[at(before)], model_.edge_head[at(before)], -1},
               {before, -1},
               12.0 * kDepth * std::min({p.radius_a, p.scale, model_.edge_length(before)})};
    if (before != behind) {
      p.piece.node[2] = model_.edge_head[at(behind)];
      p.piece.edge[1] = behind;
    } else if (&weights != &kCurveMiddle) {  // half as long
      p.share = 0.5;
      p.piece.least_bend *= 0.25;
    }
    obstacle_pairs_.push_back(p);
  };
  const auto neighbour = [&](int edge, bool behind) {
    const int next = behind ? edge + 1 : edge - 1;
    if (!surface && next >= first && next < end) return next;
    if (closed) return behind ? first : end - 1;
    if (surface) return -1;
    // The rod that continues this one, if it may touch the obstacle. The piece between both has the friction of the rod
    // before it.
    const int in_row = next_in_row(model_, edge, behind);
    return in_row >= 0 && may_meet(model_.edge_rod[at(in_row)], prototype.key.b) ? in_row : -1;
  };
  const bool flat = obstacle.kind == ObstacleKind::plane;
  for (int e = first; e < end; ++e) {
    if (!smooth(obstacle, e)) continue;
    if (ball(e)) {
      add(kCurveMiddle, e, e, 0);
      continue;
    }
    // The edges of a body share its corners.
    const auto has_corner = [&](int which) {
      return std::any_of(points_[at(e)].begin(), points_[at(e)].end(),
                         [&](const TouchingPoint& point) { return point.end == which; });
    };
    if (surface && flat) {
      if (has_corner(0)) add(kCurveFirst, e, e, 0);
      if (has_corner(1)) add(kCurveLast, e, e, 1);
      continue;
    }
    const int before = neighbour(e, false), behind = neighbour(e, true);
    if (before < 0 || !smooth(obstacle, before)) add(flat ? kCurveFirst : kCurveStart, e, e, 0);
    if (behind < 0 || !smooth(obstacle, behind))
      add(flat ? kCurveLast : kCurveEnd, e, e, 1);
    else
      add(kCurveInside, e, behind, 1);
  }
}

}  // namespace withe
