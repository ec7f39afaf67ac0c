#include "run/crossings.hpp"

#include <algorithm>
#include <cmath>

#include "common/text.hpp"
#include "geometry/segment_distance.hpp"
#include "model/edge_vectors.hpp"

namespace withe {
namespace {

constexpr double kCrossed = 0.5;         // nearness at which surfaces count as passed through, over the sum of radii
constexpr double kOverlaps = 1.0;        // the same of rods that are drawn in each other
constexpr double kSampleSpacing = 0.25;  // way of edges past each other between two looks, over the sum of radii
constexpr int kMaxSamples = 64;
constexpr double kStrictlyConvex = 1e-9;  // weights of closest_points, over the square of the sum of radii

double contact_radius(const Model& model, int edge) {
  const int rod = model.edge_rod[at(edge)];
  const VectorX& radius = model.description.rods[at(rod)].contact_radius;
  return radius.size() > 0 ? radius(edge - model.rod_first_edge[at(rod)]) : 0.0;
}

void set_positions(const Model& model, const VectorX& q, std::vector<Vec3d>& out) {
  out.resize(at(model.node_count));
  for (int i = 0; i < model.node_count; ++i) out[at(i)] = to_vec3(node_position(model, q, i));
}

}  // namespace

CrossingWatch::CrossingWatch(const Model& model) {
  const auto& rods = model.description.rods;
  std::vector<std::vector<int>> rods_at(at(model.node_count));
  const auto add = [&](int rod, int node) {
    for (int other : rods_at[at(node)]) allowed_.emplace_back(other, rod);
    rods_at[at(node)].push_back(rod);
  };
  for (int r = 0; r < static_cast<int>(rods.size()); ++r) {
    for (int node : rods[at(r)].nodes) add(r, node);
    if (!rods[at(r)].is_surface()) continue;
    // Rods may lie in the bodies that they are joined to, and bodies in each other.
    const BodyDescription& body = model.description.bodies[at(rods[at(r)].body)];
    add(r, body.node);
    for (int node : body.carried) add(r, node);
  }
  for (const ContactPairDescription& pair : model.description.contact.pairs)
    if (pair.ignored) allowed_.emplace_back(std::min(pair.first, pair.second), std::max(pair.first, pair.second));
  std::sort(allowed_.begin(), allowed_.end());
}

void CrossingWatch::begin(const Model& model, const VectorX& q) {
  set_positions(model, q, first_);
  if (began_) return;
  began_ = true;
  last_ = first_;
  set_boxes(model);
  for (const BroadPhase::Pair& rods : broad_phase_.find(boxes_))
    if (nearest_edges(model, rods, kOverlaps).first >= 0) allowed_.emplace_back(rods.a, rods.b);
  std::sort(allowed_.begin(), allowed_.end());
}

std::pair<int, int> CrossingWatch::find(const Model& model, const VectorX& q) {
  set_positions(model, q, last_);
  set_boxes(model);
  for (const BroadPhase::Pair& rods : broad_phase_.find(boxes_)) {
    if (std::binary_search(allowed_.begin(), allowed_.end(), std::pair(rods.a, rods.b))) continue;
    if (const std::pair<int, int> found = nearest_edges(model, rods, kCrossed); found.first >= 0) return found;
  }
  return {-1, -1};
}

void CrossingWatch::set_boxes(const Model& model) {
  const auto& rods = model.description.rods;
  boxes_.resize(rods.size());
  for (std::size_t r = 0; r < rods.size(); ++r) {
    const VectorX& radius = rods[r].contact_radius;
    const double margin = radius.size() > 0 ? radius.maxCoeff() : 0.0;
    boxes_[r] = Box::around(first_[at(rods[r].nodes[0])], last_[at(rods[r].nodes[0])], margin);
    for (int node : rods[r].nodes) boxes_[r].include(Box::around(first_[at(node)], last_[at(node)], margin));
  }
}

std::pair<int, int> CrossingWatch::nearest_edges(const Model& model, BroadPhase::Pair rods, double share) {
  const int pair[2] = {rods.a, rods.b};
  for (int side = 0; side < 2; ++side) {
    edges_[side].clear();
    const Box& other = boxes_[at(pair[1 - side])];
    for (int e = model.rod_first_edge[at(pair[side])]; e < model.rod_first_edge[at(pair[side]) + 1]; ++e) {
      const int tail = model.edge_tail[at(e)], head = model.edge_head[at(e)];
      Box box = Box::around(first_[at(tail)], last_[at(tail)], contact_radius(model, e));
      box.include(Box::around(first_[at(head)], last_[at(head)], contact_radius(model, e)));
      if (contact_radius(model, e) > 0.0 && box.overlaps(other)) edges_[side].push_back(e);
    }
  }
  for (int a : edges_[0])
    for (int b : edges_[1])
      if (come_near(model, a, b, share)) return {a, b};
  return {-1, -1};
}

bool CrossingWatch::come_near(const Model& model, int a, int b, double share) const {
  const double radii = contact_radius(model, a) + contact_radius(model, b);
  const int nodes[4] = {model.edge_tail[at(a)], model.edge_head[at(a)], model.edge_tail[at(b)], model.edge_head[at(b)]};
  Vec3d x[4], way[4];
  for (int i = 0; i < 4; ++i) {
    x[i] = first_[at(nodes[i])];
    way[i] = last_[at(nodes[i])] - x[i];
  }
  double farthest = 0.0;
  for (int i = 0; i < 2; ++i)
    for (int j = 2; j < 4; ++j) {
      const Vec3d past = way[i] - way[j];
      farthest = std::max(farthest, std::sqrt(dot(past, past)));
    }
  const double weight = kStrictlyConvex * radii * radii;
  const auto distance = [&](double time) {
    const Vec3d y[4] = {x[0] + time * way[0], x[1] + time * way[1], x[2] + time * way[2], x[3] + time * way[3]};
    const Vec3d between = closest_points(y[0], y[1], y[2], y[3], weight, weight).between;
    return std::sqrt(dot(between, between));
  };
  const double end = distance(1.0), wanted = share * radii;
  if (end < wanted) return true;
  if (end - farthest >= wanted) return false;
  const int looks = std::clamp(static_cast<int>(std::ceil(farthest / (kSampleSpacing * radii))), 1, kMaxSamples);
  for (int k = 1; k < looks; ++k)
    if (distance(static_cast<double>(k) / looks) < wanted) return true;
  return false;
}

}  // namespace withe
