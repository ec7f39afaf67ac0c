#pragma once
/// Decisions that were taken when a scene was built, in words.

#include <string>
#include <vector>

#include "integrators/options.hpp"
#include "steps/equations.hpp"

namespace withe {

/// Decisions of `build`.
struct Plan {
  bool planar = false;
  Vector3 plane_normal = Vector3::Zero();  ///< of a planar scene
  int unknowns = 0;
  std::string solver;              ///< LinearSolver::name()
  double stable_step = 0;          ///< of the explicit scheme [s]; 0 when not computed
  std::vector<std::string> notes;  ///< one line per thing that was skipped or decided, and why
};

/// History that a plan reports.
struct PlanHistory {
  bool left_plane = false;    ///< true if the scene left its plane while it ran
  std::string plane_left_by;  ///< what left the plane; empty where nothing did
  double separated = 0;       ///< how far overlapping rods were moved before the start [m]
  double stable_step = 0;     ///< of the explicit scheme [s]; 0 when not computed
};

Plan plan_of(const Model& model, const Options& options, const Parameters& parameters, const Equations& scheme,
             const PlanHistory& history);

}  // namespace withe
