#include "contact/contact_adjoint.hpp"

#include <cmath>
#include <stdexcept>

#include "contact/contact_friction.hpp"

namespace withe {
namespace {

using ByStart = Dual<kContactUnknowns>;
using Rows = double[kContactUnknowns];

Vec3<ByStart> lifted(const Vec3d& v) { return {ByStart(v.x), ByStart(v.y), ByStart(v.z)}; }

int tail_of(const ContactPair& pair, int side) { return pair.curve() ? side : 2 * side; }

/// The start with its derivatives by itself, tangents among them.
SlipStart<ByStart> start_of(const FrictionSetting& f) {
  SlipStart<ByStart> start(f);
  for (int i = 0; i < kContactUnknowns; ++i) start.unknown[i].slope[i] = 1.0;
  const int edges = f.pair->curve() ? f.pair->piece.weights->edges : f.pair->rod_b < 0 ? 1 : 2;
  for (int b = 0; b < edges && f.spatial; ++b) {
    const int tail = tail_of(*f.pair, b);
    const Vec3<ByStart> e = start.point(tail + 1) - start.point(tail);
    start.source[b] = (1.0 / sqrt(dot(e, e))) * e;
  }
  return start;
}

/// By the slip tolerance nu, of a scalar that is proportional to tanh(c |S|) / |S|, c = K / (2 dt) ~ 1 / nu.
double by_tolerance(double scalar, double square, double rate, double tolerance) {
  const double share = std::tanh(rate * std::sqrt(square));
  return -scalar * (1.0 - share * share) / slip_factor(square, rate) * rate / tolerance;
}

void add_implicit_friction(const ContactProblem& problem, const Touching& t, const Rows& rows, ContactAdjoint& out) {
  const FrictionSetting f = friction_setting(problem, t, 1.0, nullptr);
  ByStart now[kContactUnknowns], gradient[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) now[i] = t.now[i];
  const SlippingSurfaces<ByStart> c = slipping_surfaces(f, start_of(f), now);
  add_friction_gradient(f, c, gradient);
  ByStart scalar;
  for (int i = 0; i < kContactUnknowns; ++i) scalar += rows[i] * gradient[i];
  for (int i = 0; i < kContactUnknowns; ++i) out.start[i] += scalar.slope[i];
  const double off = dot(c.way, c.normal).value, square = dot(c.way, c.way).value - off * off;
  out.slip_tolerance += by_tolerance(scalar.value, square, f.rate, problem.parameters->slip_tolerance);
  // Friction is linear in both coefficients.
  for (const bool along : {true, false}) {
    ContactPair pair = t.pair;
    pair.set_friction(along ? 1.0 : 0.0, along ? 0.0 : 1.0);
    FrictionSetting unit = f;
    unit.pair = &pair;
    double force[kContactUnknowns] = {};
    friction_gradient(unit, t.now, force);
    for (int i = 0; i < kContactUnknowns; ++i) (along ? out.along : out.across) += rows[i] * force[i];
  }
}

/// J times a way of the unknowns, J of surfaces that touch at the start: see `set_slip` of lagged_friction.cpp.
Vec3<ByStart> start_slip(const FrictionSetting& f, const SlippingSurfaces<ByStart>& c,
                         const ByStart (&way)[kContactUnknowns]) {
  const ContactPair& pair = *f.pair;
  const auto point = [&](int i) { return Vec3<ByStart>{way[3 * i], way[3 * i + 1], way[3 * i + 2]}; };
  Vec3<ByStart> slip{};
  for (int i = 0; i < 4; ++i) slip += c.w[i] * point(i);
  const int bodies = f.centreline ? 0 : pair.curve() ? pair.piece.weights->edges : pair.rod_b < 0 ? 1 : 2;
  for (int b = 0; b < bodies; ++b) {
    const int tail = tail_of(pair, b);
    const Vec3<ByStart>& edge = c.sides[b].edge;
    const ByStart inverse = 1.0 / sqrt(dot(edge, edge));
    const Vec3<ByStart> tangent = inverse * edge,
                        arm = pair.curve() ? piece_arm(pair, b, c.s, c.normal)
                                           : contact_arm(pair, b, c.normal, c.between);
    Vec3<ByStart> turn = inverse * cross(tangent, point(tail + 1) - point(tail));
    if (f.spatial) turn += way[12 + b] * tangent;
    slip += turn_sign(f, b) * cross(turn, arm);
  }
  return slip - dot(slip, c.normal) * c.normal;
}

/// F(S) . J rows, S = J (q1 - q0) and N at the start.
void add_lagged_friction(const ContactProblem& problem, const Touching& t, const Rows& rows, ContactAdjoint& out) {
  if (problem.description().friction_law == FrictionLaw::semi_explicit)
    throw std::invalid_argument("no gradient is known through semi-explicit friction: take friction_model='lagged'");
  const FrictionSetting f = friction_setting(problem, t, 1.0, nullptr);
  const SlipStart<ByStart> start = start_of(f);
  SlippingSurfaces<ByStart> c;
  const Vec3<ByStart> x[4] = {start.point(0), start.point(1), start.point(2), start.point(3)};
  for (int b = 0; b < 2; ++b) c.sides[b].edge = x[tail_of(t.pair, b) + 1] - x[tail_of(t.pair, b)];
  find_contact(f, start, x, c);
  ByStart moved[kContactUnknowns], multiplied[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) {
    moved[i] = t.now[i] - start.unknown[i];
    multiplied[i] = rows[i];
  }
  const Vec3<ByStart> slip =
      start_slip(f, c, moved) - lifted(problem.lagged_friction[static_cast<std::size_t>(t.lagged)].drift);
  const ByStart square = dot(slip, slip),
                share = c.pressing * slip_factor(square, f.rate) * dot(slip, start_slip(f, c, multiplied)),
                scalar = t.pair.friction * share;
  for (int i = 0; i < kContactUnknowns; ++i) out.start[i] += scalar.slope[i];
  out.slip_tolerance += by_tolerance(scalar.value, square.value, f.rate, problem.parameters->slip_tolerance);
  out.along += share.value;  // directions count the same
}

}  // namespace

ContactAdjoint contact_adjoint(const ContactProblem& problem, const Touching& t, const Rows& rows) {
  ContactAdjoint out;
  if (problem.anchored() && t.pair.friction > 0.0)
    throw std::invalid_argument(
        "no gradient is known through anchored friction: take friction_model='implicit' or 'lagged'");
  if (t.lagged >= 0)
    add_lagged_friction(problem, t, rows, out);
  else if (t.pair.friction > 0.0 && !problem.lags())
    add_implicit_friction(problem, t, rows, out);
  return out;
}

}  // namespace withe
