#pragma once
/// Description, choices and model of a running scene, and its state as drawn.

#include <string>

#include "integrators/options.hpp"
#include "run/running.hpp"

namespace withe {

/// Description, choices and model of a scene. A support that is added or released, or a plane that is left, makes
/// another model; all else stays while the scene runs.
struct Built {
  SceneDescription description;
  ContactDescription drawn_contact;  ///< which holds until it is set
  Options options;
  Model model;
  bool spatial = false;             ///< left its plane while running
  std::string plane_left_by;        ///< what left the plane, where something did
  double separated = 0;             ///< how far overlapping rods were moved before the start [m]
  double stable_explicit_step = 0;  ///< [s]; 0 when not computed
};

Built built_of(SceneDescription scene, const Options& options);

/// Model for the supports that are active. Released ones keep their row until another takes it, but hold nothing. Where
/// the scene is `running`, one that was spatial stays spatial.
Model model_of_active(Built& built, bool running);

/// Sets the values of the scene as it is drawn. `c` becomes its configuration.
void begin_as_drawn(const Built& built, Running& running, Configuration& c);

}  // namespace withe
