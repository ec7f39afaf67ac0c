#pragma once
/// Checks of what a user sets in a running scene; each throws std::invalid_argument.

#include <optional>
#include <string>

#include "contact/contact.hpp"
#include "integrators/options.hpp"
#include "model/parameter_index.hpp"
#include "run/running.hpp"

namespace withe {

/// Refuses impacts that lose energy under the explicit scheme.
void check_impacts(const Options& options, const ContactDescription& contact);
/// Name of a part of the scene that dissipates energy and so cannot be run backwards, drag aside; null if there is
/// none.
const char* dissipation_of(const Model& model, const Parameters& p);
/// Refuses forces that cannot be run backwards under a scheme that steps back in time.
void check_reversible(const Model& model, const Options& options, const Parameters& p);
/// Throws ConvergenceFailure for natural curvatures that strain a fibre of a rod by -1 or more at its present shape,
/// where the section is known. The strain of the fibre at a distance r from the axis is r times the change of curvature
/// [Euler and Bernoulli].
void check_fibre_strain(const Model& model, const Parameters& parameters, const Configuration& now, double time);
/// Refuses friction of a pair that has not one share for each node and edge of the rod.
void check_shares(const Model& model, const ContactPairDescription& pair);
/// Refuses a turn that moves the shape of an obstacle.
void check_turn(const Model& model, int obstacle, const Vector3& turn);
/// Refuses a pose that a support cannot take.
void check_pose(const Model& model, const SupportMotion& now, int support, const std::optional<Vector3>& position,
                const std::optional<Matrix3>& rotation);
/// Refuses a drawing in which surfaces are inside each other. A step may press bodies together: those that touched are
/// allowed.
void check_overlap(const Model& model, const Parameters& parameters, const State& state, const Contact* contact);

/// True if a pose of a support lies outside of the plane of a planar scene.
bool leaves_plane(const Model& model, const SupportMotion& now, int support, const std::optional<Vector3>& position,
                  const std::optional<Matrix3>& rotation);
/// True if a load points, or turns, out of the plane of a planar scene.
bool leaves_plane(const Model& model, LoadKind kind, const Eigen::Ref<const MatrixX3>& values);
/// Name of a parameter whose value leads out of the plane of a planar scene; else empty.
std::string leaving_plane(const Model& model, const ParameterSetting& setting);

}  // namespace withe
