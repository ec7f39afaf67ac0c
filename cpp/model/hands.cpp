#include "model/hands.hpp"

#include <algorithm>
#include <cmath>

#include "common/check.hpp"

namespace withe {
namespace {

constexpr double kTouched = 1e-9;  // smallest touched length, over that of the edge; below it is rounding

RodCurve curve_of(const Model& model, int rod) {
  const RodDescription& description = model.description.rods[at(rod)];
  RodCurve curve;
  curve.nodes = description.nodes;
  curve.closed = description.closed;
  const int first = model.rod_first_edge[at(rod)], count = model.rod_first_edge[at(rod) + 1] - first;
  for (int i = 0; i < count; ++i) {
    curve.arc.push_back(curve.whole);
    curve.length.push_back(model.edge_arc(first + i));
    curve.whole += curve.length.back();
  }
  if (!curve.closed) curve.arc.push_back(curve.whole);
  return curve;
}

}  // namespace

void find_touched(const Model& model, Support& hand) {
  const HandDescription& own = hand.description.hand;
  const auto rod = static_cast<std::size_t>(hand.description.pass.rod);
  const RodDescription& description = model.description.rods[rod];
  const int first = model.rod_first_edge[rod], count = model.rod_first_edge[rod + 1] - first;
  const double whole = model.edge_arc.segment(first, count).sum(), slack = kTouched * whole;
  require(own.length >= 0.0 && std::isfinite(own.at) && own.length <= whole + slack,
          "a hand must be no longer than its rod");
  const double from = own.at - 0.5 * own.length, to = own.at + 0.5 * own.length;
  require(own.node < 0 || (own.slides && own.node < model.node_count), "only a ring may be on a body");
  require(description.closed || (from >= -slack && to <= whole + slack), "a hand must be on its rod");
  hand.touched.clear();
  hand.at_edge = -1;
  double begin = description.closed ? -whole : 0.0;
  for (int i = description.closed ? -count : 0; i < (description.closed ? 2 * count : count); ++i) {
    const int edge = first + (i + count) % count;
    const double length = model.edge_arc(edge), end = begin + length;
    const double low = std::max(from, begin), high = std::min(to, end);
    if (high - low > kTouched * length)
      hand.touched.push_back({edge, (0.5 * (low + high) - begin) / length, high - low});
    // A point at a node is on the edge that begins there; at the end of the rod, on the last one.
    if (hand.at_edge < 0 && (own.at < end - kTouched * length || i == count - 1)) {
      hand.at_edge = edge;
      hand.at_place = std::clamp((own.at - begin) / length, 0.0, 1.0);
    }
    begin = end;
  }
  if (hand.touched.empty()) hand.touched.push_back({hand.at_edge, hand.at_place, 1.0});
  double touched = 0.0;
  for (const TouchedEdge& t : hand.touched) touched += t.share;
  for (TouchedEdge& t : hand.touched) t.share /= touched;
  hand.span = {model.edge_tail[at(hand.touched.front().edge)]};
  for (const TouchedEdge& t : hand.touched) {
    const int head = model.edge_head[at(t.edge)];
    if (head != hand.span.front()) hand.span.push_back(head);
  }
  hand.node = hand.span.front();
  if (own.slides) hand.curve = curve_of(model, static_cast<int>(rod));
}

}  // namespace withe
