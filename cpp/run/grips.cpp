#include "run/grips.hpp"

#include <algorithm>

#include "model/edge_vectors.hpp"
#include "run/frames.hpp"

namespace withe {
namespace {

Vector3 point_on(const Model& model, const VectorX& q, int edge, double place) {
  return (1.0 - place) * node_position(model, q, model.edge_tail[at(edge)]) +
         place * node_position(model, q, model.edge_head[at(edge)]);
}

Vector3 curve_point(const Model& model, const VectorX& q, const RodCurve& curve, const SplinePlace& place) {
  const auto position = [&](int node) { return node_position(model, q, node); };
  return to_eigen(point_at(curve, place, position, Vector3::Zero()).across);
}

}  // namespace

SupportMotion standing(const Model& model, const State& state, const Configuration& c, const Support& support) {
  SupportMotion m;
  m.position = node_position(model, state.q, support.node);
  if (support.frame >= 0) {
    m.rotation = frame_rotation(model, state, support.frame);
  } else if (support.edge >= 0) {
    const Vector3 t = to_eigen(model.initial_tangent[at(support.edge)]),
                  d1 = to_eigen(model.initial_director[at(support.edge)]);
    Matrix3 drawn;
    drawn << d1, t.cross(d1), t;
    m.rotation = edge_directors(model, c, support.edge) * drawn.transpose();
    const auto& x = model.description.positions;
    m.stretch = c.length(support.edge) / (x.row(support.other_node) - x.row(support.node)).norm();
  }
  m.from_position = m.to_position = m.position;
  m.from_rotation = m.to_rotation = m.rotation;
  m.shift = m.turn = {state.time, state.time};
  return m;
}

void grasp(const Model& model, const Configuration& c, int hand, State& state, std::vector<SupportMotion>& motions) {
  const Support& s = model.supports[at(hand)];
  SupportMotion& m = motions[at(hand)];
  const HandDescription& own = s.description.hand;
  m = SupportMotion{};
  const RingState ring = s.slides() ? RingState{s.curve.place(own.at), own.at, 0.0, 0.0, false} : RingState{};
  const Vector3 taken =
      s.slides() ? curve_point(model, state.q, s.curve, ring.place) : point_on(model, state.q, s.at_edge, s.at_place);
  m.position = own.posed ? own.position : taken;
  if (own.node >= 0) m.position = node_position(model, state.q, own.node);
  m.feed_rate = own.feed_rate;
  m.feeds_since = state.time;
  m.rotation = own.posed ? own.rotation : edge_directors(model, c, s.at_edge);
  m.from_position = m.to_position = m.position;
  m.from_rotation = m.to_rotation = m.rotation;
  m.shift = m.turn = {state.time, state.time};
  HandState& held = state.hands[at(hand)];
  held = HandState{m.position, m.rotation, {}, {}, {}, {}, ring};
  const Matrix3 into = m.rotation.transpose();
  for (const TouchedEdge& touched : s.touched) held.edges.push_back(into * edge_directors(model, c, touched.edge));
  if (!s.yields()) {
    for (int node : s.span) held.points.push_back(into * (node_position(model, state.q, node) - m.position));
    return;
  }
  if (s.slides()) {
    held.points = {own.node >= 0 ? Vector3(Vector3::Zero()) : Vector3(into * (taken - m.position))};
    return;
  }
  for (const TouchedEdge& touched : s.touched)
    held.points.push_back(into * (point_on(model, state.q, touched.edge, touched.place) - m.position));
  held.slip.assign(s.touched.size(), Vector3::Zero());
  held.twist.setZero(static_cast<Eigen::Index>(s.touched.size()));
}

void regrip(const Model& model, const std::vector<std::vector<int>>& held_before,
            const std::vector<SupportMotion>& motions, State& state) {
  for (std::size_t h = 0; h < model.supports.size(); ++h) {
    const Support& s = model.supports[h];
    if (!s.active || !s.is_hand() || state.hands[h].points.size() != s.span.size() || h >= held_before.size()) continue;
    for (int node : s.nodes) {
      if (std::find(held_before[h].begin(), held_before[h].end(), node) != held_before[h].end()) continue;
      const auto i = std::find(s.span.begin(), s.span.end(), node) - s.span.begin();
      state.hands[h].points[static_cast<std::size_t>(i)] =
          motions[h].rotation.transpose() * (node_position(model, state.q, node) - motions[h].position);
    }
  }
}

}  // namespace withe
