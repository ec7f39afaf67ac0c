#include "model/parameter_index.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/check.hpp"
#include "common/text.hpp"

namespace withe {
namespace {

using enum ParameterKind;

/// Address of the first number: that of a table, or of the table of one rod where each rod has its own.
double* begin_of(double& number, int) { return &number; }
template <class Table>
double* begin_of(Table& table, int) {
  return table.data();
}
template <class Table>
double* begin_of(std::vector<Table>& tables, int rod) {
  return tables[at(rod)].data();
}

template <auto member>
double* number_of_part(Parameters& p, int part) {
  return &(p.*member)[part];
}

template <auto member>
double* number(Parameters& p, int rod) {
  return begin_of(p.*member, rod);
}
template <auto member>
double* surface(Parameters& p, int) {
  return &(p.surfaces.*member);
}
template <auto member>
double* surface_row(Parameters& p, int row) {
  return (p.surfaces.*member).row(row).data();
}

/// Number of a part as a scene describes it.
template <auto parts, auto member>
double drawn(const SceneDescription& scene, int part) {
  return (scene.*parts)[at(part)].*member;
}
template <auto member>
double drawn_joint(const SceneDescription& scene, int joint) {
  for (const JointDescription& d : scene.joints) {
    const auto links = static_cast<int>(d.links.size());
    if (joint < links) return d.links[at(joint)].*member;
    joint -= links;
  }
  return 0.0;
}

template <auto member, auto described>
constexpr ParameterInfo number_of_parts(ParameterKind kind, std::string_view name, Extent extent, std::string_view unit,
                                        Range range) {
  return {kind, name, extent, 1, unit, range, Derived::nothing, number_of_part<member>, member, described};
}

constexpr ParameterInfo kIndex[]{
    {stretch_stiffness, "stretch_stiffness", Extent::edge, 1, "N", Range::positive, Derived::nothing,
     number<&Parameters::edge_stretch>},
    {bend_stiffness, "bend_stiffness", Extent::edge, 2, "N m^2", Range::positive, Derived::stiffness,
     number<&Parameters::edge_bend>},
    {twist_stiffness, "twist_stiffness", Extent::edge, 1, "N m^2", Range::positive, Derived::stiffness,
     number<&Parameters::edge_twist>},
    {line_density, "line_density", Extent::edge, 1, "kg/m", Range::positive, Derived::masses,
     number<&Parameters::edge_density>},
    {rotary_inertia, "rotary_inertia", Extent::edge, 1, "kg m", Range::non_negative, Derived::masses,
     number<&Parameters::edge_rotary>},
    {viscous_time, "viscous_time", Extent::edge, 1, "s", Range::non_negative, Derived::viscous_times,
     number<&Parameters::edge_viscous_time>},
    {drag, "drag", Extent::edge, 1, "Pa s", Range::non_negative, Derived::masses, number<&Parameters::edge_drag>},
    {natural_curvature, "natural_curvature", Extent::stencil, 2, "1/m", Range::any, Derived::natural_strains,
     number<&Parameters::natural_curvature>},
    {natural_twist, "natural_twist", Extent::stencil, 1, "rad/m", Range::any, Derived::natural_strains,
     number<&Parameters::natural_twist>},
    {natural_stretch, "natural_stretch", Extent::edge, 1, "-", Range::positive, Derived::natural_strains,
     number<&Parameters::edge_natural_stretch>},
    {added_mass, "added_mass", Extent::node, 1, "kg", Range::non_negative, Derived::masses,
     number<&Parameters::added_mass>},
    {gravity, "gravity", Extent::scene, 3, "m/s^2", Range::any, Derived::nothing, number<&Parameters::gravity>},
    {fluid_viscosity, "fluid_viscosity", Extent::scene, 1, "Pa s", Range::positive, Derived::nothing,
     number<&Parameters::fluid_viscosity>},
    {fluid_regularization, "fluid_regularization", Extent::scene, 1, "m", Range::positive, Derived::nothing,
     number<&Parameters::fluid_regularization>},
    {ParameterKind::load, "load", Extent::load, 3, "N, N m or N/m", Range::any, Derived::nothing,
     number<&Parameters::loads>},
    number_of_parts<&PartNumbers::spring_stiffness, drawn<&SceneDescription::springs, &SpringDescription::stiffness>>(
        spring_stiffness, "spring_stiffness", Extent::spring, "N/m", Range::non_negative),
    number_of_parts<&PartNumbers::spring_rest_length,
                    drawn<&SceneDescription::springs, &SpringDescription::rest_length>>(
        spring_rest_length, "spring_rest_length", Extent::spring, "m", Range::non_negative),
    number_of_parts<&PartNumbers::spring_damping, drawn<&SceneDescription::springs, &SpringDescription::damping>>(
        spring_damping, "spring_damping", Extent::spring, "N s/m", Range::non_negative),
    number_of_parts<&PartNumbers::joint_stiffness, drawn_joint<&JointLink::stiffness>>(
        joint_stiffness, "joint_stiffness", Extent::joint, "N m/rad", Range::non_negative),
    number_of_parts<&PartNumbers::joint_rest_angle, drawn_joint<&JointLink::rest_angle>>(
        joint_rest_angle, "joint_rest_angle", Extent::joint, "rad", Range::any),
    number_of_parts<&PartNumbers::joint_damping, drawn_joint<&JointLink::damping>>(
        joint_damping, "joint_damping", Extent::joint, "N m s/rad", Range::non_negative),
    number_of_parts<&PartNumbers::joint_moment, drawn_joint<&JointLink::moment>>(joint_moment, "joint_moment",
                                                                                 Extent::joint, "N m", Range::any),
    number_of_parts<&PartNumbers::joint_max_torque, drawn_joint<&JointLink::max_torque>>(
        joint_max_torque, "joint_max_torque", Extent::joint, "N m", Range::limit),
    number_of_parts<&PartNumbers::joint_max_speed, drawn_joint<&JointLink::max_speed>>(
        joint_max_speed, "joint_max_speed", Extent::joint, "rad/s", Range::limit),
    number_of_parts<&PartNumbers::tendon_tension, drawn<&SceneDescription::tendons, &TendonDescription::tension>>(
        tendon_tension, "tendon_tension", Extent::tendon, "N", Range::non_negative),
    number_of_parts<&PartNumbers::torsion_stiffness,
                    drawn<&SceneDescription::torsions, &TorsionDescription::stiffness>>(
        torsion_stiffness, "torsion_stiffness", Extent::torsion, "N m/rad", Range::non_negative),
    number_of_parts<&PartNumbers::torsion_rest_angle,
                    drawn<&SceneDescription::torsions, &TorsionDescription::rest_angle>>(
        torsion_rest_angle, "torsion_rest_angle", Extent::torsion, "rad", Range::any),
    {friction, "friction", Extent::scene, 1, "-", Range::non_negative, Derived::nothing,
     surface<&SurfaceParameters::friction>},
    {slip_tolerance, "slip_tolerance", Extent::scene, 1, "m/s", Range::positive, Derived::nothing,
     surface<&SurfaceParameters::slip_tolerance>},
    {restitution, "restitution", Extent::scene, 1, "-", Range::share, Derived::nothing,
     surface<&SurfaceParameters::restitution>},
    {contact_stiffness, "contact_stiffness", Extent::scene, 1, "N/m", Range::non_negative, Derived::nothing,
     surface<&SurfaceParameters::contact_stiffness>},
    {obstacle_friction, "obstacle_friction", Extent::obstacle, 3, "-", Range::non_negative, Derived::nothing,
     surface_row<&SurfaceParameters::obstacle_friction>},
    {obstacle_rolling, "obstacle_rolling", Extent::obstacle, 1, "-", Range::non_negative, Derived::nothing,
     surface_row<&SurfaceParameters::obstacle_rolling>},
    {obstacle_restitution, "obstacle_restitution", Extent::obstacle, 1, "-", Range::share, Derived::nothing,
     surface_row<&SurfaceParameters::obstacle_restitution>},
    {pair_friction, "pair_friction", Extent::pair, 3, "-", Range::any, Derived::nothing,
     surface_row<&SurfaceParameters::pair_friction>},
    {pair_restitution, "pair_restitution", Extent::pair, 1, "-", Range::any, Derived::nothing,
     surface_row<&SurfaceParameters::pair_restitution>},
    {pair_contact_stiffness, "pair_contact_stiffness", Extent::pair, 1, "N/m", Range::non_negative, Derived::nothing,
     surface_row<&SurfaceParameters::pair_contact_stiffness>},
};

constexpr bool in_order() {
  for (std::size_t i = 0; i < std::size(kIndex); ++i)
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
    case Extent::load:
      return first_load_row(model.description, model.description.loads.size());
    default:
      return 1;
  }
}

/// The first number that is out of range, or nothing.
const double* out_of_range(const ParameterValues& values, Range range) {
  const auto bad = [range](double x) {
    if (range == Range::limit) return !(x > 0.0);
    return !std::isfinite(x) || (range == Range::positive && x <= 0.0) ||
           ((range == Range::non_negative || range == Range::share) && x < 0.0) || (range == Range::share && x > 1.0);
  };
  const double* found = std::find_if(values.data(), values.data() + values.size(), bad);
  return found == values.data() + values.size() ? nullptr : found;
}

/// Refuses numbers that are out of range.
void check_range(const Model& model, const ParameterInfo& info, int rod, const ParameterValues& values) {
  if (const double* bad = out_of_range(values, info.range))
    require(false, owned(model, info, rod) + " must be " +
                       (info.range == Range::any            ? "finite"
                        : info.range == Range::share        ? "from 0 to 1"
                        : info.range == Range::non_negative ? "finite and not negative"
                        : info.range == Range::limit        ? "positive"
                                                            : "positive and finite") +
                       ", got " + text(*bad, 6));
}

}  // namespace

int owners_of(const Model& model, const ParameterInfo& info) {
  const SceneDescription& scene = model.description;
  switch (info.extent) {
    case Extent::edge:
    case Extent::stencil:
      return static_cast<int>(scene.rods.size());
    case Extent::spring:
      return static_cast<int>(scene.springs.size());
    case Extent::joint:
      return static_cast<int>(model.joint_angles.size());
    case Extent::tendon:
      return static_cast<int>(scene.tendons.size());
    case Extent::torsion:
      return static_cast<int>(scene.torsions.size());
    case Extent::obstacle:
      return static_cast<int>(scene.contact.obstacles.size());
    case Extent::pair:
      return static_cast<int>(scene.contact.pairs.size());
    default:
      return 1;
  }
}

void check_owner(const Model& model, const ParameterInfo& info, int owner) {
  if (!(owner >= 0 && owner < owners_of(model, info)))
    require(false, "no such " + std::string(info.of_rod() ? "rod: " : "part: ") + std::to_string(owner));
}

std::span<const ParameterInfo> parameter_index() { return kIndex; }

const ParameterInfo& info_of(ParameterKind kind) { return kIndex[static_cast<std::size_t>(kind)]; }

const ParameterInfo& parameter_named(std::string_view name) {
  const auto* const found =
      std::find_if(std::begin(kIndex), std::end(kIndex), [&](const auto& info) { return info.name == name; });
  if (found == std::end(kIndex)) require(false, "no such parameter: " + std::string(name));
  return *found;
}

ParameterView parameter_view(const Model& model, Parameters& p, ParameterKind kind, int owner) {
  const ParameterInfo& info = info_of(kind);
  const Eigen::Index before = info.extent == Extent::edge ? model.rod_first_edge[at(owner)] : 0;
  return {info.first(p, owner) + before * info.columns, rows_of(model, info, owner), info.columns};
}

bool in_range(const VectorX& values, Range range) {
  return out_of_range({values.data(), values.size(), 1}, range) == nullptr;
}

PartNumbers described_numbers(const Model& model) {
  PartNumbers out = zero_numbers(model);
  for (const ParameterInfo& info : kIndex) {
    if (!info.number) continue;
    VectorX& values = out.*info.number;
    for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = info.described(model.description, static_cast<int>(i));
    check_range(model, info, 0, {values.data(), values.size(), 1});
  }
  return out;
}

PartNumbers zero_numbers(const Model& model) {
  PartNumbers out;
  for (const ParameterInfo& info : kIndex)
    if (info.number) (out.*info.number).setZero(owners_of(model, info));
  return out;
}

void check_setting(const Model& model, const ParameterSetting& setting) {
  const auto& [kind, owner, values] = setting;
  const ParameterInfo& info = info_of(kind);
  check_owner(model, info, owner);
  const Eigen::Index rows = rows_of(model, info, owner);
  if ((values.rows() != rows && values.rows() != 1) || values.cols() != info.columns)
    require(false, owned(model, info, owner) + " must have shape " + shape(rows, info.columns) + ", got " +
                       shape(values.rows(), values.cols()));
  check_range(model, info, owner, values);
  if (kind == natural_curvature)
    check_turns(values, model.rod_voronoi[at(owner)], [&] { return owned(model, info, owner); });
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
  for (const auto& [kind, owner, values] : settings) {
    ParameterView now = parameter_view(model, p, kind, owner);
    if (!changes(now, values)) continue;
    changed = true;
    derive(std::pair(info_of(kind).derived, owner));
    if (values.rows() == now.rows())
      now = values;
    else
      now.rowwise() = values.row(0);
  }
  derive(std::nullopt);
  return changed;
}

}  // namespace withe
