#include "model/rod_curve.hpp"

#include <algorithm>

namespace withe {

SplinePiece RodCurve::piece(int i) const {
  const int count = pieces();
  if (!closed) {
    const auto k = static_cast<std::size_t>(i);
    SplinePiece out;
    out.arc = arc[k];
    out.node[1] = nodes[k];
    if (i > 0) out.node[0] = nodes[k - 1], out.length[0] = length[k - 1];
    if (i + 1 < count) out.node[2] = nodes[k + 1], out.length[1] = length[k];
    return out;
  }
  const int turn = i >= 0 ? i / count : -((count - 1 - i) / count), own = i - turn * count;
  const auto here = static_cast<std::size_t>(own), before = static_cast<std::size_t>((own + count - 1) % count),
             after = static_cast<std::size_t>((own + 1) % count);
  return {{nodes[before], nodes[here], nodes[after]}, arc[here] + turn * whole, {length[before], length[here]}};
}

SplinePlace RodCurve::place(double at) const {
  // Piece i ends half an edge after its node.
  int i = 0;
  while (i + 1 < pieces() && at > arc[static_cast<std::size_t>(i)] + 0.5 * length[static_cast<std::size_t>(i)]) ++i;
  if (closed && i + 1 == pieces() && at > arc.back() + 0.5 * length.back()) ++i;
  const SplinePiece own = piece(i);
  return {i, std::clamp(spline_along(own, at), own.low(), own.high()), false};
}

double RodCurve::arc_between(const SplinePlace& from, const SplinePlace& to) const {
  const bool ahead = from.piece != to.piece ? from.piece < to.piece : from.along < to.along;
  double way = 0.0;
  SplinePlace now = from;
  for (;;) {
    const SplinePiece own = piece(now.piece);
    const double end = now.piece == to.piece ? to.along : ahead ? own.high() : own.low();
    way += (end - now.along) * spline_arc_slope(own, 0.5 * (now.along + end));
    if (now.piece == to.piece) return way;
    now.piece += ahead ? 1 : -1;
    now.along = ahead ? piece(now.piece).low() : piece(now.piece).high();
  }
}

}  // namespace withe
