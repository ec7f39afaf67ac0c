#pragma once
/// Quantities that are prescribed to a scene at a time: natural shapes, poses of supports and places of
/// obstacles.

#include <vector>

#include "run/running.hpp"

namespace withe {

bool are_active(const Ramps& ramps);
/// Sets the parameters that are on a ramp to their values at a time.
void apply_ramps(const Model& model, const Ramps& ramps, double time, Parameters& parameters);
/// Does the same in a configuration at q that stays, and returns by how much the elastic energy changes [J].
double apply_ramps(const Model& model, const Ramps& ramps, double time, const VectorX& q, const Configuration& c,
                   Parameters& parameters, EnergyScratch& scratch);

/// Supports and obstacles that are to be elsewhere at once move there evenly in the course of a time step. Each part of
/// the step then contains a part of the jump, so that a subdivision helps.
void spread_jumps(const Model& model, const State& state, double duration, std::vector<SupportMotion>& motions,
                  std::vector<ObstacleMotion>& obstacle_motions);
/// True if supports in space may turn rods about their axes in the coming step. `prescribes`: a callback may move them.
bool turns_rods(const Model& model, const std::vector<SupportMotion>& motions, double time, bool prescribes);

/// Finds the poses of supports, the held unknowns and the places of obstacles at a time. No custom forces.
void prescribe(const Model& model, const Settings& settings, const Moving& now, double time, Prescribed& out);

/// Way of an obstacle from where it is drawn; in a plane, within it.
ObstacleWay obstacle_way(const Model& model, const State& state, int obstacle);
/// Longest way of an obstacle between two states [m].
double farthest_obstacle(const State& from, const State& to);

}  // namespace withe
