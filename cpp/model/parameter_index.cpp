#include "model/parameter_index.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "common/check.hpp"
#include "common/text.hpp"

namespace withe {
namespace {

using enum ParameterKind;

constexpr std::array<ParameterInfo, 33> kIndex{{
    {stretch_stiffness, "stretch_stiffness", Extent::edge, 1, "N", Range::positive, Derived::nothing},
    {bend_stiffness, "bend_stiffness", Extent::edge, 2, "N m^2", Range::positive, Derived::stiffness},
    {twist_stiffness, "twist_stiffness", Extent::edge, 1, "N m^2", Range::positive, Derived::stiffness},
    {line_density, "line_density", Extent::edge, 1, "kg/m", Range::positive, Derived::masses},
    {rotary_inertia, "rotary_inertia", Extent::edge, 1, "kg m", Range::non_negative, Derived::masses},
    {viscous_time, "viscous_time", Extent::edge, 1, "s", Range::non_negative, Derived::viscous_times},
    {drag, "drag", Extent::edge, 1, "Pa s", Range::non_negative, Derived::masses},
    {natural_curvature, "natural_curvature", Extent::stencil, 2, "1/m", Range::any, Derived::natural_strains},
    {natural_twist, "natural_twist", Extent::stencil, 1, "rad/m", Range::any, Derived::natural_strains},
    {natural_stretch, "natural_stretch", Extent::edge, 1, "-", Range::positive, Derived::natural_strains},
    {added_mass, "added_mass", Extent::node, 1, "kg", Range::non_negative, Derived::masses},
    {gravity, "gravity", Extent::scene, 3, "m/s^2", Range::any, Derived::nothing},
    {fluid_viscosity, "fluid_viscosity", Extent::scene, 1, "Pa s", Range::positive, Derived::nothing},
    {fluid_regularization, "fluid_regularization", Extent::scene, 1, "m", Range::positive, Derived::nothing},
    {ParameterKind::load, "load", Extent::load, 3, "N, N m or N/m", Range::any, Derived::nothing},
    {spring_stiffness, "spring_stiffness", Extent::spring, 1, "N/m", Range::non_negative, Derived::nothing},
    {spring_rest_length, "spring_rest_length", Extent::spring, 1, "m", Range::non_negative, Derived::nothing},
    {spring_damping, "spring_damping", Extent::spring, 1, "N s/m", Range::non_negative, Derived::nothing},
    {joint_stiffness, "joint_stiffness", Extent::joint, 1, "N m/rad", Range::non_negative, Derived::nothing},
    {joint_rest_angle, "joint_rest_angle", Extent::joint, 1, "rad", Range::any, Derived::nothing},
    {joint_damping, "joint_damping", Extent::joint, 1, "N m s/rad", Range::non_negative, Derived::nothing},
    {joint_moment, "joint_moment", Extent::joint, 1, "N m", Range::any, Derived::nothing},
    {tendon_tension, "tendon_tension", Extent::tendon, 1, "N", Range::non_negative, Derived::nothing},
    {friction, "friction", Extent::scene, 1, "-", Range::non_negative, Derived::nothing},
    {slip_tolerance, "slip_tolerance", Extent::scene, 1, "m/s", Range::positive, Derived::nothing},
    {restitution, "restitution", Extent::scene, 1, "-", Range::non_negative, Derived::nothing},
    {contact_stiffness, "contact_stiffness", Extent::scene, 1, "N/m", Range::non_negative, Derived::nothing},
    {obstacle_friction, "obstacle_friction", Extent::obstacle, 3, "-", Range::non_negative, Derived::nothing},
    {obstacle_rolling, "obstacle_rolling", Extent::obstacle, 1, "-", Range::non_negative, Derived::nothing},
    {obstacle_restitution, "obstacle_restitution", Extent::obstacle, 1, "-", Range::non_negative, Derived::nothing},
    {pair_friction, "pair_friction", Extent::pair, 3, "-", Range::any, Derived::nothing},
    {pair_restitution, "pair_restitution", Extent::pair, 1, "-", Range::any, Derived::nothing},
    {pair_contact_stiffness, "pair_contact_stiffness", Extent::pair, 1, "N/m", Range::non_negative, Derived::nothing},
}};

constexpr bool in_order() {
  for (std::size_t i = 0; i < kIndex.size(); ++i)
    if (static_cast<std::size_t>(kIndex[i].kind) != i) return false;
  return true;
}
static_assert(in_order());

std::string owned(const Model& model, const ParameterInfo& info, int rod) {
  std::string words(info.name);
  std::replace(words.begin(), words.end(), '_', info.of_rod() ? '_' : ' ');
  return info.of_rod() ? words + " of rod '" + model.description.rods[at(rod)].name + "'" : words;
}

std::string shape(Eigen::Index rows, Eigen::Index columns) {
  std::string out("(");
  out.append(std::to_string(rows)).append(", ").append(std::to_string(columns)).append(")");
  return out;
}

Eigen::Index rows_of(const Model& model, const ParameterInfo& info, int rod) {
  switch (info.extent) {
    case Extent::node:
      return model.node_count;
    case Extent::edge:
      return model.rod_first_edge[at(rod) + 1] - model.rod_first_edge[at(rod)];
    case Extent::stencil:
      return model.rod_voronoi[at(rod)].size();
    case Extent::spring:
      return static_cast<Eigen::Index>(model.description.springs.size());
    case Extent::joint:
      return static_cast<Eigen::Index>(model.joint_angles.size());
    case Extent::tendon:
      return static_cast<Eigen::Index>(model.description.tendons.size());
    case Extent::load:
      return first_load_row(model.description, model.description.loads.size());
    case Extent::obstacle:
      return static_cast<Eigen::Index>(model.description.contact.obstacles.size());
    case Extent::pair:
      return static_cast<Eigen::Index>(model.description.contact.pairs.size());
    case Extent::scene:
      break;
  }
  return 1;
}

/// The first number that is out of range, or nothing.
const double* out_of_range(const ParameterValues& values, Range range) {
  const auto bad = [range](double x) {
    return !std::isfinite(x) || (range == Range::positive && !(x > 0.0)) || (range == Range::non_negative && x < 0.0);
  };
  const double* found = std::find_if(values.data(), values.data() + values.size(), bad);
  return found == values.data() + values.size() ? nullptr : found;
}

}  // namespace

std::span<const ParameterInfo> parameter_index() { return kIndex; }

const ParameterInfo& info_of(ParameterKind kind) { return kIndex[static_cast<std::size_t>(kind)]; }

const ParameterInfo& parameter_named(std::string_view name) {
  const auto* const found =
      std::find_if(kIndex.begin(), kIndex.end(), [&](const auto& info) { return info.name == name; });
  if (found == kIndex.end()) require(false, "no such parameter: " + std::string(name));
  return *found;
}

ParameterView parameter_view(const Model& model, Parameters& p, ParameterKind kind, int rod) {
  const ParameterInfo& info = info_of(kind);
  const auto all = [&]() -> double* {
    switch (kind) {
      case stretch_stiffness:
        return p.edge_stretch.data();
      case bend_stiffness:
        return p.edge_bend.data();
      case twist_stiffness:
        return p.edge_twist.data();
      case line_density:
        return p.edge_density.data();
      case rotary_inertia:
        return p.edge_rotary.data();
      case viscous_time:
        return p.edge_viscous_time.data();
      case ParameterKind::drag:
        return p.edge_drag.data();
      case natural_curvature:
        return p.natural_curvature[at(rod)].data();
      case natural_twist:
        return p.natural_twist[at(rod)].data();
      case natural_stretch:
        return p.edge_natural_stretch.data();
      case added_mass:
        return p.added_mass.data();
      case gravity:
        return p.gravity.data();
      case ParameterKind::load:
        return p.loads.data();
      case spring_stiffness:
        return p.spring_stiffness.data();
      case spring_rest_length:
        return p.spring_rest_length.data();
      case spring_damping:
        return p.spring_damping.data();
      case joint_stiffness:
        return p.joint_stiffness.data();
      case joint_rest_angle:
        return p.joint_rest_angle.data();
      case joint_damping:
        return p.joint_damping.data();
      case joint_moment:
        return p.joint_moment.data();
      case tendon_tension:
        return p.tendon_tension.data();
      case friction:
        return &p.surfaces.friction;
      case slip_tolerance:
        return &p.surfaces.slip_tolerance;
      case restitution:
        return &p.surfaces.restitution;
      case contact_stiffness:
        return &p.surfaces.contact_stiffness;
      case obstacle_friction:
        return p.surfaces.obstacle_friction.data();
      case obstacle_rolling:
        return p.surfaces.obstacle_rolling.data();
      case obstacle_restitution:
        return p.surfaces.obstacle_restitution.data();
      case pair_friction:
        return p.surfaces.pair_friction.data();
      case pair_restitution:
        return p.surfaces.pair_restitution.data();
      case pair_contact_stiffness:
        return p.surfaces.pair_contact_stiffness.data();
      case fluid_regularization:
        return &p.fluid_regularization;
      case fluid_viscosity:
        break;
    }
    return &p.fluid_viscosity;
  };
  const Eigen::Index before = info.extent == Extent::edge ? model.rod_first_edge[at(rod)] : 0;
  return {all() + before * info.columns, rows_of(model, info, rod), info.columns};
}

void check_setting(const Model& model, const ParameterSetting& setting) {
  const auto& [kind, rod, values] = setting;
  const ParameterInfo& info = info_of(kind);
  if (info.of_rod() && !(rod >= 0 && rod < static_cast<int>(model.place.size())))
    require(false, "no such rod: " + std::to_string(rod));
  const Eigen::Index rows = rows_of(model, info, rod);
  if ((values.rows() != rows && values.rows() != 1) || values.cols() != info.columns)
    require(false, owned(model, info, rod) + " must have shape " + shape(rows, info.columns) + ", got " +
                       shape(values.rows(), values.cols()));
  if (const double* bad = out_of_range(values, info.range))
    require(false, owned(model, info, rod) + " must be " +
                       (info.range == Range::any            ? "finite"
                        : info.range == Range::non_negative ? "finite and not negative"
                                                            : "positive and finite") +
                       ", got " + text(*bad, 6));
  if (kind == natural_curvature)
    check_turns(values, model.rod_voronoi[at(rod)], [&] { return owned(model, info, rod); });
}

namespace {

bool changes(const ParameterView& now, const ParameterValues& wanted) {
  for (Eigen::Index from = 0; from < now.size(); from += wanted.size())
    if (!std::equal(wanted.data(), wanted.data() + wanted.size(), now.data() + from)) return true;
  return false;
}

}  // namespace

bool set_parameters(const Model& model, std::span<const ParameterSetting> settings, Parameters& p) {
  bool changed = false;
  std::optional<std::pair<Derived, int>> pending;  // settings that follow each other often share what derives from them
  const auto derive = [&](std::optional<std::pair<Derived, int>> next) {
    if (pending && pending != next) update_derived(model, pending->first, pending->second, p);
    pending = next;
  };
  for (const auto& [kind, rod, values] : settings) {
    ParameterView now = parameter_view(model, p, kind, rod);
    if (!changes(now, values)) continue;
    changed = true;
    derive(std::pair(info_of(kind).derived, rod));
    if (values.rows() == now.rows())
      now = values;
    else
      now.rowwise() = values.row(0);
  }
  derive(std::nullopt);
  return changed;
}

}  // namespace withe
