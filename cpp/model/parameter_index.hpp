#pragma once
/// The index of what users set while a scene runs: every number of `Parameters` that acts, by its name.

#include <span>
#include <string_view>

#include "model/model.hpp"

namespace withe {

enum class ParameterKind {
  stretch_stiffness,
  bend_stiffness,
  twist_stiffness,
  line_density,
  rotary_inertia,
  viscous_time,
  drag,
  natural_curvature,
  natural_twist,
  natural_stretch,
  added_mass,
  gravity,
  fluid_viscosity,
  fluid_regularization,
  load,
  spring_stiffness,
  spring_rest_length,
  spring_damping,
  joint_stiffness,
  joint_rest_angle,
  joint_damping,
  joint_moment,
  joint_max_torque,
  joint_max_speed,
  tendon_tension,
  torsion_stiffness,
  torsion_rest_angle,
  friction,
  slip_tolerance,
  restitution,
  contact_stiffness,
  obstacle_friction,
  obstacle_rolling,
  obstacle_restitution,
  pair_friction,
  pair_restitution,
  pair_contact_stiffness,
};

/// Extent of a parameter: the objects that have one row of numbers each. `load` stands for every load or each of its
/// edges, and `pair` for every pair of bodies with values of its own. Edges and stencils are those of a rod. A spring,
/// a revolute joint, a tendon and a torsion spring own one number each.
enum class Extent { scene, node, edge, stencil, spring, joint, tendon, torsion, load, obstacle, pair };

enum class Range { any, non_negative, positive, share, limit };  ///< share: from 0 to 1; limit: positive or infinite

/// Quantities that derive from a parameter.
enum class Derived { nothing, masses, stiffness, viscous_times, natural_strains };

struct ParameterInfo {
  ParameterKind kind;
  std::string_view name;
  Extent extent;
  int columns;
  std::string_view unit;
  Range range;
  Derived derived;
  double* (*first)(Parameters& parameters, int owner);  ///< first number of all rods, or of one owner
  VectorX PartNumbers::* number = nullptr;              ///< numbers of all parts, where a part owns one number
  double (*described)(const SceneDescription& scene, int part) = nullptr;  ///< number of such a part as drawn

  /// True if it belongs to surfaces, whose numbers decide about the form of the equations.
  bool of_contact() const { return kind >= ParameterKind::friction; }
  /// True if `World::set` may ramp it to its value.
  bool is_ramped() const { return derived == Derived::natural_strains || number != nullptr; }
  bool of_rod() const { return extent == Extent::edge || extent == Extent::stencil; }
};

/// Number of owners of a parameter: rods, parts that own one number each, or the scene alone.
int owners_of(const Model& model, const ParameterInfo& info);
/// Raises std::invalid_argument unless a parameter has such an owner.
void check_owner(const Model& model, const ParameterInfo& info, int owner);

/// All of them, in the order of their kinds.
std::span<const ParameterInfo> parameter_index();
const ParameterInfo& info_of(ParameterKind kind);
/// Throws std::invalid_argument where there is none of the name.
const ParameterInfo& parameter_named(std::string_view name);

using ParameterView = Eigen::Map<MatrixX>;
using ParameterValues = Eigen::Map<const MatrixX>;

/// The numbers of one owner: rows as `Extent` says. Change them through `set_parameter`, or follow with
/// `update_derived`.
ParameterView parameter_view(const Model& model, Parameters& parameters, ParameterKind kind, int owner);

/// Wanted numbers: all rows, or one that holds for every one of them.
struct ParameterSetting {
  ParameterKind kind;
  int owner = 0;  ///< rod or part that the numbers belong to
  ParameterValues values;
};

/// Refuses what does not fit, is not finite or out of range; std::invalid_argument says what.
void check_setting(const Model& model, const ParameterSetting& setting);
/// Sets those of the settings, which fit, that are not what already holds, and what derives from them; whether there
/// were any.
bool set_parameters(const Model& model, std::span<const ParameterSetting> settings, Parameters& parameters);

/// True if all numbers are finite and within a range.
bool in_range(const VectorX& values, Range range);

/// Numbers of parts as drawn. A number out of range raises std::invalid_argument.
PartNumbers described_numbers(const Model& model);
/// A zero for each number of a part.
PartNumbers zero_numbers(const Model& model);

/// Update the quantities that derive from parameters, for one rod if the parameters belong to it.
void update_derived(const Model& model, Derived derived, int rod, Parameters& parameters);

}  // namespace withe
