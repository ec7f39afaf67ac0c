#include "contact/plane_contact.hpp"

#include <algorithm>
#include <cmath>

#include "contact/pressing.hpp"

namespace withe {
namespace {

// A node's height and its place along the plane stand one after the other.
constexpr int kHeight = 0, kPlace = 1, kWays = 6;

/// Minus the forces of a contact by heights and places, and their derivative when asked for.
struct PlaneLocal {
  double gradient[kWays] = {};
  double hessian[kWays][kWays] = {};
  bool with_hessian;
};

/// Across and along a plane.
struct Axes {
  Vec3d normal, along;

  explicit Axes(const Obstacle& o) : normal(o.other), along{o.other.y, -o.other.x, 0.0} {}

  /// Adds what is by heights and places to what is by unknowns.
  void add(const PlaneLocal& local, ContactLocal& out) const {
    for (int i = 0; i < 3; ++i) {
      const double h = local.gradient[2 * i + kHeight], y = local.gradient[2 * i + kPlace];
      out.gradient[3 * i] += normal.x * h + along.x * y;
      out.gradient[3 * i + 1] += normal.y * h + along.y * y;
    }
    if (!local.with_hessian) return;
    for (int i = 0; i < 3; ++i) {
      const double (&heights)[kWays] = local.hessian[2 * i + kHeight], (&places)[kWays] = local.hessian[2 * i + kPlace];
      double (&out_x)[kContactUnknowns] = out.hessian[3 * i], (&out_y)[kContactUnknowns] = out.hessian[3 * i + 1];
      for (int j = 0; j < 3; ++j) {
        const double xh = normal.x * heights[2 * j] + along.x * places[2 * j];
        const double xy = normal.x * heights[2 * j + 1] + along.x * places[2 * j + 1];
        const double yh = normal.y * heights[2 * j] + along.y * places[2 * j];
        const double yy = normal.y * heights[2 * j + 1] + along.y * places[2 * j + 1];
        out_x[3 * j] += xh * normal.x + xy * along.x;
        out_x[3 * j + 1] += xh * normal.y + xy * along.y;
        out_y[3 * j] += yh * normal.x + yy * along.x;
        out_y[3 * j + 1] += yh * normal.y + yy * along.y;
      }
    }
  }
};

/// Derivatives of a piece's distance by heights, and of the place s where it touches.
struct HeightSlopes {
  double distance[3], s[3];

  HeightSlopes(const CurveWeights& w, const CurveDistance<double>& d) {
    const double share = d.bend_share(), half = 0.5 * d.s * d.s * share, by_s = d.free ? -1.0 / d.stiff : 0.0;
    for (int i = 0; i < 3; ++i) {
      distance[i] = w.middle[i] + d.s * w.slope[i] + half * w.bend[i];
      s[i] = by_s * (w.slope[i] + d.s * share * w.bend[i]);
    }
  }
};

/// From the gradient by heights at the end of the step to the mean with that at its start, see pressing.cpp.
void add_height_start(const ContactProblem& problem, const Touching& t, const Axes& axes, bool geometric,
                      double (&along)[3], double (*derivative)[3]) {
  const ContactPair& pair = t.pair;
  Vec3d x0[4];
  const CurveDistance<double> start = problem.curve_at_start(pair, x0);
  const double shift = dot(axes.normal, problem.shift_of(pair));
  double way[3] = {};
  for (int i = 0; i < pair.piece.weights->nodes; ++i) {
    const Vec3d moved = Vec3d{t.now[3 * i], t.now[3 * i + 1], 0.0} - x0[i];
    way[i] = dot(axes.normal, moved) - shift;
  }
  add_start_direction(HeightSlopes(*pair.piece.weights, start).distance, way, t.proximity.distance - start.distance,
                      geometric, along, derivative);
}

/// An edge of a piece, and how it turns.
struct PlaneEdge {
  double across, along;    ///< parts of it [m]
  double across0, along0;  ///< as the step began
  double inverse_square;   ///< of its length [1/m^2]
  double turn;             ///< phi
};

/// How far such a surface has slipped, and the friction on that.
class PlaneSlip {
 public:
  // Called, it would go through memory.
  [[gnu::always_inline]] PlaneSlip(const ContactProblem& problem, const Touching& t, double rate)
      : pair_(t.pair), w_(*t.pair.piece.weights), axes_(problem.bodies.obstacle(t.pair)), s_(t.proximity.curve.s) {
    for (int i = 0; i < w_.nodes; ++i) {
      const Vec3d x{t.now[3 * i], t.now[3 * i + 1], 0.0};
      const Vec3d x0 = local_position(problem.model(), problem.start->q, pair_.piece.node[i]);
      height_[i] = dot(axes_.normal, x);
      height0_[i] = dot(axes_.normal, x0);
      place_[i] = dot(axes_.along, x);
      place0_[i] = dot(axes_.along, x0);
      weight_[i] = w_.at(i, s_);
      weight_slope_[i] = w_.slope[i] + w_.bend[i] * s_;
      slip_ += weight_[i] * (place_[i] - place0_[i]);
    }
    slip_ -= dot(axes_.along, problem.shift_of(pair_));
    if (problem.anchored()) slip_ += dot(axes_.along, t.stick);
    edges_ = problem.description().centreline_friction ? 0 : w_.edges;
    for (int b = 0; b < edges_; ++b) {
      PlaneEdge& e = edge_[b];
      e = {height_[b + 1] - height_[b],
           place_[b + 1] - place_[b],
           height0_[b + 1] - height0_[b],
           place0_[b + 1] - place0_[b],
           0.0,
           0.0};
      e.inverse_square = 1.0 / (e.across * e.across + e.along * e.along);
      e.turn = e.inverse_square * (e.across * e.along0 - e.along * e.across0);
      lever_[b] = pair_.radius_a * (w_.share[b] + w_.share_slope[b] * s_);
      slip_ += lever_[b] * e.turn;
    }
    find_force(problem, t, rate);
  }

  const Axes& axes() const { return axes_; }
  double force() const { return force_; }
  double slip() const { return slip_; }
  double limit() const { return limit_; }
  const ForceLaw& law() const { return law_; }
  bool sticking() const { return sticking_; }
  double stick() const { return stick_; }

  /// Its derivative by heights and places.
  void slope(const HeightSlopes& d, double (&out)[kWays]) const {
    double by_s = 0.0;
    for (int i = 0; i < w_.nodes; ++i) by_s += weight_slope_[i] * (place_[i] - place0_[i]);
    for (int b = 0; b < edges_; ++b) by_s += pair_.radius_a * w_.share_slope[b] * edge_[b].turn;
    for (int i = 0; i < 3; ++i) {
      out[2 * i + kHeight] = by_s * d.s[i];
      out[2 * i + kPlace] = i < w_.nodes ? weight_[i] : 0.0;
    }
    for (int b = 0; b < edges_; ++b) {
      const PlaneEdge& e = edge_[b];
      const double factor = lever_[b] * e.inverse_square;
      const double by_across = factor * (e.along0 - 2.0 * e.turn * e.across),
                   by_along = -factor * (e.across0 + 2.0 * e.turn * e.along);
      out[2 * (b + 1) + kHeight] += by_across;
      out[2 * (b + 1) + kPlace] += by_along;
      out[2 * b + kHeight] -= by_across;
      out[2 * b + kPlace] -= by_along;
    }
  }

  void add_gradient(double (&ways)[kWays]) const {
    for (int i = 0; i < w_.nodes; ++i) ways[2 * i + kPlace] += weight_[i] * force_;
    for (int b = 0; b < edges_; ++b) {
      const PlaneEdge& e = edge_[b];
      const double couple = lever_[b] * force_ * e.inverse_square;
      ways[2 * (b + 1) + kHeight] += couple * e.along;
      ways[2 * (b + 1) + kPlace] -= couple * e.across;
      ways[2 * b + kHeight] -= couple * e.along;
      ways[2 * b + kPlace] += couple * e.across;
    }
  }

  /// `by_end`: of what presses, by the distance.
  void add_hessian(const Touching& t, const HeightSlopes& d, const Vec3d* predicted,
                   double (&matrix)[kWays][kWays]) const {
    double turned[kWays], change[kWays];
    slope(d, turned);
    const Vec3d known = predicted ? *predicted : Vec3d{};
    const double dual = predicted && law_.factor > 0.0 ? limit_ / law_.factor * dot(axes_.along, known) : slip_;
    const double by_slip = law_.factor + 2.0 * law_.by_square * slip_ * dual;
    for (int k = 0; k < kWays; ++k) change[k] = by_slip * turned[k];
    for (int i = 0; i < 3; ++i) change[2 * i + kHeight] -= law_.by_pressing * slip_ * t.pressing.by_end * d.distance[i];
    for (int i = 0; i < w_.nodes; ++i) {
      for (int k = 0; k < kWays; ++k) matrix[2 * i + kPlace][k] += weight_[i] * change[k];
      for (int k = 0; k < 3; ++k) matrix[2 * i + kPlace][2 * k + kHeight] += weight_slope_[i] * force_ * d.s[k];
    }
    for (int b = 0; b < edges_; ++b) add_couple(b, change, d, matrix);
  }

 private:
  void find_force(const ContactProblem& problem, const Touching& t, double rate) {
    const double mu = pair_.friction, pressing = -t.pressing.first;
    limit_ = mu * pressing;
    if (!problem.anchored()) {
      law_ = tanh_law(mu, pressing, slip_ * slip_, rate);
      force_ = law_.factor * slip_;
      sticking_ = rate * std::abs(slip_) < 7.5;
      return;
    }
    const double stiffness = tangential_stiffness(pair_, t.stiffness), most = std::max(limit_ / stiffness, 0.0);
    sticking_ = holds(slip_ * slip_, most);
    const double size = std::abs(slip_);
    law_ = sticking_ ? ForceLaw{stiffness, 0.0, 0.0}
                     : ForceLaw{limit_ / size, -0.5 * limit_ / (size * size * size), mu / size};
    force_ = law_.factor * slip_;
    stick_ = force_ / stiffness;
  }

  /// What the moment r m_b F does to the ends of an edge, F r m_b (b, -a) / |e|^2.
  void add_couple(int b, const double (&change)[kWays], const HeightSlopes& d, double (&matrix)[kWays][kWays]) const {
    const PlaneEdge& e = edge_[b];
    const double arm[2] = {e.inverse_square * e.along, -e.inverse_square * e.across};
    double rows[2][kWays];
    const double grown = pair_.radius_a * w_.share_slope[b] * force_;
    for (int k = 0; k < kWays; ++k) {
      const double moment = lever_[b] * change[k] + (k % 2 == kHeight ? grown * d.s[k / 2] : 0.0);
      rows[kHeight][k] = arm[0] * moment;
      rows[kPlace][k] = arm[1] * moment;
    }
    const double moment = lever_[b] * force_;
    const double both = 2.0 * arm[0] * arm[1], own[2][2] = {{both, e.inverse_square - 2.0 * arm[0] * arm[0]},
                                                            {2.0 * arm[1] * arm[1] - e.inverse_square, -both}};
    for (int r = 0; r < 2; ++r) {
      rows[r][2 * (b + 1) + kHeight] += moment * own[r][kHeight];
      rows[r][2 * (b + 1) + kPlace] += moment * own[r][kPlace];
      rows[r][2 * b + kHeight] -= moment * own[r][kHeight];
      rows[r][2 * b + kPlace] -= moment * own[r][kPlace];
      for (int k = 0; k < kWays; ++k) {
        matrix[2 * (b + 1) + r][k] += rows[r][k];
        matrix[2 * b + r][k] -= rows[r][k];
      }
    }
  }

  const ContactPair& pair_;
  const CurveWeights& w_;
  Axes axes_;
  double s_;
  double height_[3] = {}, height0_[3] = {}, place_[3] = {}, place0_[3] = {};
  double weight_[3] = {}, weight_slope_[3] = {};
  int edges_ = 0;  ///< with an arm
  PlaneEdge edge_[2];
  double lever_[2] = {};  ///< r m_b
  double slip_ = 0, limit_ = 0, force_ = 0, stick_ = 0;
  bool sticking_ = false;
  ForceLaw law_;
};

void add_pressing_to(PlaneLocal& out, const ContactProblem& problem, const Touching& t, const Axes& axes,
                     const HeightSlopes& slopes, bool geometric) {
  const CurvePiece& piece = t.pair.piece;
  const CurveDistance<double>& end = t.proximity.curve;
  double along[3], derivative[3][3] = {};
  std::copy(slopes.distance, slopes.distance + 3, along);
  if (out.with_hessian && geometric) {
    // See add_curve_hessian: d^2 D = -phi ds^2 + (s^2 / 2) phi'' dg2^2.
    const double bent = 0.5 * end.s * end.s * end.bend_change(piece.least_bend);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        derivative[i][j] =
            bent * piece.weights->bend[i] * piece.weights->bend[j] - end.stiff * slopes.s[i] * slopes.s[j];
  }
  if (problem.means_direction())
    add_height_start(problem, t, axes, geometric, along, out.with_hessian ? derivative : nullptr);
  for (int i = 0; i < 3; ++i) out.gradient[2 * i + kHeight] += t.pressing.first * along[i];
  for (int i = 0; i < 3 && out.with_hessian; ++i)
    for (int j = 0; j < 3; ++j)
      out.hessian[2 * i + kHeight][2 * j + kHeight] +=
          t.pressing.first * derivative[i][j] + t.pressing.by_end * along[i] * slopes.distance[j];
}

void add_friction_to(PlaneLocal& out, const ContactProblem& problem, const Touching& t, const HeightSlopes& slopes,
                     const ContactLinearisation& linearisation) {
  const PlaneSlip slip(problem, t, slip_rate(problem, linearisation.regularisation));
  slip.add_gradient(out.gradient);
  if (out.with_hessian) slip.add_hessian(t, slopes, linearisation.friction.of(t.pair.key), out.hessian);
}

}  // namespace

bool beside_plane(const ContactProblem& problem, const Touching& t) {
  if (!t.pair.curve() || !problem.model().planar() || t.lagged >= 0) return false;
  return problem.bodies.flat(t.pair) && t.pair.isotropic() && problem.turn.empty();
}

void add_plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                       const ContactLinearisation& linearisation, bool with_hessian, ContactLocal& out) {
  const Axes axes(problem.bodies.obstacle(t.pair));
  const HeightSlopes slopes(*t.pair.piece.weights, t.proximity.curve);
  PlaneLocal local{.with_hessian = with_hessian};
  if (which != PlaneForces::friction) add_pressing_to(local, problem, t, axes, slopes, linearisation.geometric);
  if (which != PlaneForces::pressing && rubs(problem, t)) add_friction_to(local, problem, t, slopes, linearisation);
  axes.add(local, out);
}

FrictionForce<double> plane_friction(const ContactProblem& problem, const Touching& t, double rate) {
  const PlaneSlip slip(problem, t, rate);
  return {slip.force() * slip.axes().along, slip.stick() * slip.axes().along, slip.sticking()};
}

Slipping plane_slipping(const ContactProblem& problem, const Touching& t, double rate, const VectorX& change) {
  const PlaneSlip slip(problem, t, rate);
  const Vec3d &normal = slip.axes().normal, &along = slip.axes().along;
  double slope[kWays], moved = 0.0;
  slip.slope(HeightSlopes(*t.pair.piece.weights, t.proximity.curve), slope);
  for (int i = 0; i < t.pair.piece.weights->nodes; ++i) {
    const Vec3d by = local_position(problem.model(), change, t.pair.piece.node[i]);
    moved += slope[2 * i + kHeight] * dot(normal, by) + slope[2 * i + kPlace] * dot(along, by);
  }
  return {slip.slip() * along, moved * along, slip.law(), slip.limit()};
}

}  // namespace withe
