#include "contact/curve.hpp"

namespace withe {
namespace {

/// Weights of the three distances in D.
void sample_weights(const CurveWeights& weights, const CurveDistance<double>& d, double (&w)[3]) {
  const double half = 0.5 * d.s * d.s * d.bend_share();
  for (int j = 0; j < 3; ++j) w[j] = weights.value_by[j] + d.s * weights.slope_by[j] + half * kBendBy[j];
}

}  // namespace

CurveSlopes curve_slopes(const CurvePiece& piece, const CurveDistance<double>& d) {
  CurveSlopes out{};
  double w[3];
  sample_weights(*piece.weights, d, w);
  for (int j = 0; j < 3; ++j) {
    const Vec3d& n = d.sample[j].normal;
    for (int i = 0; i < 3; ++i) {
      const double share = piece.weights->at(i, piece.weights->sample(j));
      for (int k = 0; k < 3; ++k) {
        const double by = share * n[k];
        out.distance[3 * i + k] += w[j] * by;
        out.slope[3 * i + k] += piece.weights->slope_by[j] * by;
        out.bend[3 * i + k] += kBendBy[j] * by;
      }
    }
  }
  if (!d.free) return out;
  const double inverse = -1.0 / d.stiff, bent = d.s * d.bend_share();
  for (int i = 0; i < 9; ++i) out.s[i] = inverse * (out.slope[i] + bent * out.bend[i]);
  return out;
}

/// d^2 D = sum_j w_j d^2 delta_j - phi ds^2 + (s^2 / 2) phi'' dg2^2
void add_curve_hessian(const CurvePiece& piece, const Obstacle& o, const CurveDistance<double>& d,
                       const CurveSlopes& slopes, double factor, int stride, double* hessian) {
  const double moved = -factor * d.stiff, bent = 0.5 * factor * d.s * d.s * d.bend_change(piece.least_bend);
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j)
      hessian[i * stride + j] += moved * slopes.s[i] * slopes.s[j] + bent * slopes.bend[i] * slopes.bend[j];
  if (o.kind == ObstacleKind::plane) return;
  double w[3];
  sample_weights(*piece.weights, d, w);
  for (int p = 0; p < 3; ++p) {
    const double place = piece.weights->sample(p);
    const NormalChange change(o, d.sample[p]);
    for (int k = 0; k < 3; ++k) {
      const Vec3d turned = (factor * w[p]) * change.of_normal(kUnitVectors[k]);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double share = piece.weights->at(i, place) * piece.weights->at(j, place);
          for (int l = 0; l < 3; ++l) hessian[(3 * i + l) * stride + 3 * j + k] += share * turned[l];
        }
    }
  }
}

}  // namespace withe
