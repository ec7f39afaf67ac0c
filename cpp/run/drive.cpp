#include "run/drive.hpp"

#include <algorithm>
#include <cmath>

#include "run/hold.hpp"
#include "steps/terms.hpp"

namespace withe {

namespace {

Eigen::VectorBlock<VectorX> natural_stretch(const Model& model, Parameters& parameters, int rod) {
  const int first = model.rod_first_edge[at(rod)];
  return parameters.edge_natural_stretch.segment(first, model.rod_first_edge[at(rod) + 1] - first);
}

}  // namespace

bool are_active(const Ramps& ramps) {
  for (const NaturalRamp& ramp : ramps.natural)
    if (ramp.curvature.active || ramp.twist.active || ramp.stretch.active) return true;
  return !ramps.numbers.empty();
}

void apply_ramps(const Model& model, const Ramps& ramps, double time, Parameters& parameters) {
  for (std::size_t r = 0; r < ramps.natural.size(); ++r) {
    const auto& [curvature, twist, stretch] = ramps.natural[r];
    const bool bent = curvature.apply(time, parameters.natural_curvature[r]),
               twisted = twist.apply(time, parameters.natural_twist[r]),
               stretched = stretch.apply(time, natural_stretch(model, parameters, static_cast<int>(r)));
    if (bent || twisted || stretched) update_natural(model, parameters, static_cast<int>(r));
  }
  for (const NumberRamp& ramp : ramps.numbers) {
    const double s = ramp.span.fraction(time);
    parameter_view(model, parameters, ramp.kind, ramp.part)(0, 0) = (1.0 - s) * ramp.from + s * ramp.to;
  }
  if (!ramps.numbers.empty()) update_derived(model, Derived::nothing, 0, parameters);
}

double apply_ramps(const Model& model, const Ramps& ramps, double time, const VectorX& q, const Configuration& c,
                   Parameters& parameters, EnergyScratch& scratch) {
  EnergyCoefficients& before = scratch.coefficients;
  before.set(model, parameters);
  apply_ramps(model, ramps, time, parameters);
  const double work = natural_change_energy(model, before.elastic, parameters, c);
  if (ramps.numbers.empty()) return work;
  return work + (stored_energy(model, parameters, q, c) - stored_energy(model, before.numbers, q, c));
}

ObstacleWay obstacle_way(const Model& model, const State& state, int obstacle) {
  return way_from_drawn(model, model.description.contact.obstacles[at(obstacle)], state.obstacles[at(obstacle)]);
}

double farthest_obstacle(const State& from, const State& to) {
  double square = 0.0;
  for (std::size_t o = 0; o < to.obstacles.size(); ++o) {
    const Vec3d way = to.obstacles[o].point - from.obstacles[o].point;
    square = std::max(square, dot(way, way));
  }
  return std::sqrt(square);
}

void spread_jumps(const Model& model, const State& state, double duration, std::vector<SupportMotion>& motions,
                  std::vector<ObstacleMotion>& obstacle_motions) {
  const Span step{state.time, state.time + duration};
  for (SupportMotion& m : motions) {
    if (m.jumps()) {
      m.from_position = m.position;
      m.shift = step;
    }
    if (m.turn.start == m.turn.end && m.rotation != m.to_rotation) {
      m.from_rotation = m.rotation;
      m.turn = step;
    }
  }
  // One that has come there already, in an equilibrium say, is not where it set out from.
  const auto jumps = [&](const Span& way, const Vector3& now, const Vector3& from, const Vector3& to) {
    return way.start == way.end && way.end == state.time && (now - from).norm() < 0.5 * (to - from).norm();
  };
  for (std::size_t o = 0; o < obstacle_motions.size(); ++o) {
    ObstacleMotion& m = obstacle_motions[o];
    const ObstacleWay now = obstacle_way(model, state, static_cast<int>(o));
    if (jumps(m.shift, now.shift, m.from.shift, m.to.shift)) m.shift = step;
    if (jumps(m.turn, now.turn, m.from.turn, m.to.turn)) m.turn = step;
  }
}

bool turns_rods(const Model& model, const std::vector<SupportMotion>& motions, double time, bool prescribes) {
  if (model.planar() && !prescribes) return false;  // a pose from a function may leave the plane
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    const SupportMotion& motion = motions[s];
    if (support.active && (support.frame >= 0 || !support.edges.empty()) && (prescribes || time < motion.turn.end))
      return true;
  }
  return false;
}

void prescribe(const Model& model, const Settings& settings, const Moving& now, double time, Prescribed& out) {
  out.supports.clear();
  for (const SupportMotion& motion : now.motions) out.supports.push_back(motion.pose_at(time));
  hold(model, now, out.supports, out.held);
  out.obstacles.clear();
  if (!settings.obstacle_motions.empty())
    for (const ObstacleDescription& drawn : model.description.contact.obstacles)
      out.obstacles.push_back(obstacle_place(model, drawn, settings.obstacle_motions[out.obstacles.size()].at(time)));
  out.custom = {};
  out.respond = nullptr;
}

}  // namespace withe
