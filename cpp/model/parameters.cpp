#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/check.hpp"
#include "common/text.hpp"
#include "model/mass_matrix.hpp"
#include "model/parameter_index.hpp"
#include "model/stencil_numbers.hpp"

namespace withe {
namespace {

void require_turn(const Vector2& smooth, double voronoi) {
  const double phi = smooth.norm() * voronoi;
  // The message is made when it is needed: actuation comes here in every step.
  if (!(phi < std::numbers::pi))
    require(false, "natural curvature turns an edge by " + std::to_string(phi) +
                       " rad; it must stay below pi: use more nodes");
}

ArcOfStencil arc_of(const Model& model, std::pair<int, int> owner, double square) {
  if (!(square > 0.0) || owner.first < 0 || owner.second < 0) return {};
  const Vector2 k = model.description.rods[static_cast<std::size_t>(owner.first)].natural_curvature.row(owner.second);
  if (k.squaredNorm() == 0.0) return {};
  return {true, square, k.cwiseAbs2() / k.squaredNorm()};
}

double square_of_turn_of(const Model& model, int edge) {
  return square_of_turn(model.edge_length(edge), model.edge_arc(edge));
}

}  // namespace

Vector2 bend_of(const Model& model, const Parameters& p, int edge) {
  if (!model.planar()) return p.edge_bend.row(edge);
  const Vector2 b = p.edge_bend.row(edge);
  const Vector2 c = model.planar_components[at(model.edge_rod[at(edge)])];
  return {c(0) * c(0) * b(0) + c(1) * c(1) * b(1), 0.0};
}

ArcOfStencil arc_of_bend(const Model& model, Eigen::Index stencil) {
  const auto i = static_cast<std::size_t>(stencil);
  const int* edge = model.bend[i].edge;
  return arc_of(model, model.bend_owner[i],
                0.5 * (square_of_turn_of(model, edge[0]) + square_of_turn_of(model, edge[1])));
}

ArcOfStencil arc_of_half(const Model& model, Eigen::Index stencil) {
  const auto i = static_cast<std::size_t>(stencil);
  return arc_of(model, model.half_owner[i], 0.25 * square_of_turn_of(model, model.half[i].edge));
}

Vector2 discrete_curvature(const Vector2& smooth, double voronoi) {
  require_turn(smooth, voronoi);
  return discrete_over_smooth(smooth(0), smooth(1), voronoi) * smooth;
}

Vector2 smooth_curvature(const Vector2& discrete, double voronoi) {
  return smooth_over_discrete(discrete(0), discrete(1), voronoi) * discrete;
}

MatrixX2 smooth_curvatures(const MatrixX2& discrete, const VectorX& voronoi) {
  MatrixX2 out(discrete.rows(), 2);
  for (Eigen::Index i = 0; i < out.rows(); ++i) out.row(i) = smooth_curvature(discrete.row(i), voronoi(i));
  return out;
}

void check_turns(const Eigen::Map<const MatrixX>& smooth, const VectorX& voronoi,
                 const std::function<std::string()>& owner) {
  const Eigen::Index step = smooth.rows() == voronoi.size() ? 1 : 0;
  for (Eigen::Index i = 0; i < voronoi.size(); ++i) {
    const double* k = smooth.data() + 2 * step * i;
    const double square = (k[0] * k[0] + k[1] * k[1]) * voronoi(i) * voronoi(i);
    if (square < std::numbers::pi * std::numbers::pi) continue;
    require(false, owner() + " must turn the rod by less than pi at every node, got " + text(std::sqrt(square)) +
                       " rad at stencil " + std::to_string(i) + ": use more nodes");
  }
}

void set_rod(const Model& model, int rod, const RodDescription& description, Parameters& p) {
  const auto r = static_cast<std::size_t>(rod);
  const int first = model.rod_first_edge[r], count = model.rod_first_edge[r + 1] - first;
  p.edge_stretch.segment(first, count) = description.stretch_stiffness;
  p.edge_bend.middleRows(first, count) = description.bend_stiffness;
  p.edge_twist.segment(first, count) = description.twist_stiffness;
  p.edge_density.segment(first, count) = description.line_density;
  p.edge_rotary.segment(first, count) = description.rotary_inertia;
  p.edge_viscous_time.segment(first, count) = description.viscous_time;
  p.edge_drag.segment(first, count) = description.drag;
}

void set_contact(const ContactDescription& contact, Parameters& parameters) {
  SurfaceParameters& p = parameters.surfaces;
  p.friction = contact.friction;
  p.slip_tolerance = contact.slip_tolerance;
  p.restitution = contact.restitution;
  p.contact_stiffness = contact.stiffness;
  p.obstacle_friction = contact.obstacle_friction;
  p.obstacle_rolling = contact.obstacle_rolling;
  if (p.obstacle_rolling.size() == 0) p.obstacle_rolling.setZero(static_cast<Eigen::Index>(contact.obstacles.size()));
  p.obstacle_restitution = contact.obstacle_restitution;
  if (p.obstacle_restitution.size() == 0)
    p.obstacle_restitution.setOnes(static_cast<Eigen::Index>(contact.obstacles.size()));
  const auto pairs = static_cast<Eigen::Index>(contact.pairs.size());
  p.pair_friction.resize(pairs, 3);
  p.pair_shares.resize(contact.pairs.size());
  p.pair_restitution.resize(pairs);
  p.pair_contact_stiffness.resize(pairs);
  for (Eigen::Index i = 0; i < pairs; ++i) {
    const ContactPairDescription& pair = contact.pairs[static_cast<std::size_t>(i)];
    p.pair_friction.row(i) = pair.friction;
    p.pair_shares[static_cast<std::size_t>(i)] = pair.shares;
    p.pair_restitution(i) = pair.restitution;
    p.pair_contact_stiffness(i) = pair.stiffness;
  }
}

void describe_contact(const SurfaceParameters& p, ContactDescription& contact) {
  contact.friction = p.friction;
  contact.slip_tolerance = p.slip_tolerance;
  contact.restitution = p.restitution;
  contact.stiffness = p.contact_stiffness;
  contact.obstacle_friction = p.obstacle_friction;
  contact.obstacle_rolling = p.obstacle_rolling;
  contact.obstacle_restitution = p.obstacle_restitution;
  for (std::size_t i = 0; i < contact.pairs.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    contact.pairs[i].friction = p.pair_friction.row(row);
    contact.pairs[i].restitution = p.pair_restitution(row);
    contact.pairs[i].stiffness = p.pair_contact_stiffness(row);
  }
}

bool SurfaceParameters::operator==(const SurfaceParameters& other) const {
  const auto same = [](const auto& a, const auto& b) { return a.rows() == b.rows() && a == b; };
  return friction == other.friction && slip_tolerance == other.slip_tolerance && restitution == other.restitution &&
         contact_stiffness == other.contact_stiffness && same(obstacle_friction, other.obstacle_friction) &&
         same(obstacle_rolling, other.obstacle_rolling) && same(obstacle_restitution, other.obstacle_restitution) &&
         same(pair_friction, other.pair_friction) && same(pair_restitution, other.pair_restitution) &&
         same(pair_contact_stiffness, other.pair_contact_stiffness) &&
         std::equal(pair_shares.begin(), pair_shares.end(), other.pair_shares.begin(), other.pair_shares.end(), same);
}

bool is_there(const SceneDescription& scene, RodPass pass) {
  if (!pass.on_body())
    return pass.rod < static_cast<int>(scene.rods.size()) && pass.node >= 0 &&
           pass.node < static_cast<int>(scene.rods[at(pass.rod)].nodes.size());
  if (pass.body() >= static_cast<int>(scene.bodies.size())) return false;
  const BodyDescription& body = scene.bodies[at(pass.body())];
  return pass.node == body.node || std::find(body.carried.begin(), body.carried.end(), pass.node) != body.carried.end();
}

void check_load(const SceneDescription& scene, const LoadDescription& load) {
  require(is_there(scene, load.pass), "load at a node that is not there");
  const bool along = load.kind == LoadKind::distributed || load.kind == LoadKind::pressure;
  require(!load.pass.on_body() || (!along && !load.follower),
          "loads on bodies must be forces or moments that do not follow");
  require(load.values.rows() == 1 || (along && load.values.rows() == scene.rods[at(load.pass.rod)].rest_lengths.size()),
          "load must have one row, or, along a rod, one an edge");
  require(load.values.allFinite(), "load must be finite");
}

Parameters initial_parameters(const Model& model) {
  const SceneDescription& scene = model.description;
  Parameters p;
  static_cast<PartNumbers&>(p) = described_numbers(model);
  const Eigen::Index edges = model.edge_count;
  p.edge_stretch.resize(edges);
  p.edge_bend.resize(edges, 2);
  for (VectorX* v : {&p.edge_twist, &p.edge_density, &p.edge_rotary, &p.edge_viscous_time, &p.edge_drag})
    v->resize(edges);
  p.edge_natural_stretch.setOnes(edges);
  for (std::size_t r = 0; r < scene.rods.size(); ++r) {
    const RodDescription& rod = scene.rods[r];
    set_rod(model, static_cast<int>(r), rod, p);
    p.natural_curvature.push_back(rod.natural_curvature);
    p.natural_twist.push_back(rod.natural_twist);
  }
  p.added_mass = scene.added_mass;
  for (const BodyDescription& body : scene.bodies) p.body_inertia.push_back(body.inertia);
  p.gravity = scene.gravity;
  p.loads.resize(first_load_row(scene, scene.loads.size()), 3);
  for (std::size_t k = 0; k < scene.loads.size(); ++k)
    p.loads.middleRows(first_load_row(scene, k), scene.loads[k].values.rows()) = scene.loads[k].values;
  p.fluid_viscosity = scene.fluid.viscosity;
  p.fluid_regularization = scene.fluid.regularization;
  set_contact(scene.contact, p);
  if (scene.bending == Bending::tangent) p.measure = {0.0, 0.0};
  update_derived(model, p);
  return p;
}

namespace {

long next_version() {
  static std::atomic<long> versions{0};
  return ++versions;
}

/// Discrete natural strains of one rod's stencils.
class NaturalStrain {
 public:
  NaturalStrain(const Model& model, const Parameters& p, int rod)
      : curvature_(p.natural_curvature[at(rod)]),
        twist_(p.natural_twist[at(rod)]),
        measure_(p.measure),
        plane_(model.planar() ? std::optional(model.planar_components[at(rod)]) : std::nullopt) {}

  int stencils() const { return static_cast<int>(twist_.size()); }

  Vector3 operator()(int stencil, double voronoi) const {
    require_turn(curvature_.row(stencil), voronoi);
    const Vec3d strain =
        natural_strain(measure_, curvature_(stencil, 0), curvature_(stencil, 1), twist_(stencil), voronoi);
    if (plane_) return {plane_->dot(Vector2(strain.x, strain.y)), 0.0, 0.0};
    return {strain.x, strain.y, strain.z};
  }

 private:
  const MatrixX2& curvature_;
  const VectorX& twist_;
  BendMeasure measure_;
  std::optional<Vector2> plane_;
};

/// Natural strain of a stencil across two rods: each rod's nearest natural strain over its half of the length.
void update_natural_across(const Model& model, Parameters& p, int stencil) {
  p.bend_natural.row(stencil) = model.bend_offset.row(stencil);
  for (const int edge : model.bend[at(stencil)].edge) {
    const int rod = model.edge_rod[at(edge)];
    const NaturalStrain strain(model, p, rod);
    if (strain.stencils() == 0 || model.bend_owner[at(stencil)].second < -1) continue;
    const int nearest = edge == model.rod_first_edge[at(rod)] ? 0 : strain.stencils() - 1;
    p.bend_natural.row(stencil) += strain(nearest, 0.5 * model.edge_arc(edge));
  }
}

/// Masses that edges give to their nodes, and to the frames that they are attached to.
void update_masses(const Model& model, Parameters& p) {
  p.node_mass = p.added_mass;
  p.node_drag = VectorX::Zero(model.node_count);
  p.edge_inertia.resize(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const double half = 0.5 * model.edge_arc(e);
    for (int node : {model.edge_tail[at(e)], model.edge_head[at(e)]}) {
      p.node_mass(node) += half * p.edge_density(e);
      p.node_drag(node) += half * p.edge_drag(e);
    }
    p.edge_inertia(e) = model.edge_arc(e) * p.edge_rotary(e);
  }
  p.dragged = (p.node_drag.array() != 0.0).any();
  p.frame_inertia = VectorX::Zero(model.frame_count);
  p.hinge_inertia = VectorX::Zero(static_cast<Eigen::Index>(model.hinges.size()));
  for (const FrameStencil& s : model.half) {
    const double share = kFrameShare * model.edge_arc(s.edge) * p.edge_rotary(s.edge);
    p.edge_inertia(s.edge) -= share;
    p.frame_inertia(s.frame) += share;
    if (s.hinge >= 0) p.hinge_inertia(s.hinge) += share;
  }
}

void update_viscous_times(const Model& model, Parameters& p) {
  p.viscous = (p.edge_viscous_time.array() != 0.0).any();
  p.bend_viscous_time.resize(static_cast<Eigen::Index>(model.bend.size()));
  for (Eigen::Index i = 0; i < p.bend_viscous_time.size(); ++i) {
    const auto& [a, b] = model.bend[static_cast<std::size_t>(i)].edge;
    const double la = model.edge_arc(a), lb = model.edge_arc(b);
    p.bend_viscous_time(i) = (la * p.edge_viscous_time(a) + lb * p.edge_viscous_time(b)) / (la + lb);
  }
  p.half_viscous_time.resize(static_cast<Eigen::Index>(model.half.size()));
  for (Eigen::Index i = 0; i < p.half_viscous_time.size(); ++i)
    p.half_viscous_time(i) = p.edge_viscous_time(model.half[static_cast<std::size_t>(i)].edge);
}

/// `square`: of what the arc turns by [rad^2].
double stiffness_of_twist(const Model& model, double twist, const Vector2& bend, std::pair<int, int> owner,
                          double square) {
  const ArcOfStencil arc = arc_of(model, owner, square);
  if (!arc.turns || twist == 0.0 || bend.minCoeff() <= 0.0) return twist;
  return twist_of_arc(twist, bend(0), bend(1), arc.square_of_turn, arc.share);
}

/// Stiffness of bend stencils: two parts of edges in series, V / K = V0 / K0 + V1 / K1. The part of an edge that the
/// stencil before it ended with is kept, since divisions are most of the work.
class BendStiffness {
 public:
  BendStiffness(const Model& model, const Parameters& p) : model_(model), p_(p) {}

  Vector3 operator()(int stencil) {
    const auto& [a, b] = model_.bend[at(stencil)].edge;
    const double share_a = model_.bend_share(stencil, 0), share_b = model_.bend_share(stencil, 1);
    const Part before = a == edge_ && share_a == share_ ? part_ : part(a, share_a);
    edge_ = b;
    share_ = share_b;
    part_ = part(b, share_b);
    const Vector2 bending(in_series(before.bend1, part_.bend1), in_series(before.bend2, part_.bend2));
    const double twist = in_series(before.twist, part_.twist), square = 0.5 * (before.square + part_.square);
    return {bending(0), bending(1), stiffness_of_twist(model_, twist, bending, model_.bend_owner[at(stencil)], square)};
  }

 private:
  /// V / K of a share of an edge, in twisting always of half of it; square of the edge's turn.
  struct Part {
    double bend1, bend2, twist, square;
  };
  Part part(int edge, double share) const {
    const double length = model_.edge_arc(edge), chord = model_.edge_length(edge), bent = share * length;
    const Vector2 k = bend_of(model_, p_, edge);
    return {flexibility(bent, k(0)), flexibility(bent, k(1)), flexibility(0.5 * length, p_.edge_twist(edge)),
            length == chord ? 0.0 : square_of_turn(chord, length)};
  }

  const Model& model_;
  const Parameters& p_;
  int edge_ = -1;
  double share_ = 0;
  Part part_{};
};

void update_half_stiffness(const Model& model, Parameters& p, int half) {
  const int edge = model.half[at(half)].edge;
  const Vector2 bending = bend_of(model, p, edge) / (model.half_share(half) * model.edge_arc(edge));
  const double twist = p.edge_twist(edge) / model.half_voronoi(half);
  const double square = 0.25 * square_of_turn(model.edge_length(edge), model.edge_arc(edge));
  p.half_stiffness.row(half) << bending.transpose(),
      stiffness_of_twist(model, twist, bending, model.half_owner[at(half)], square);
}

/// Calls `own(row of a bend stencil, its stencil of the rod)` for those of a rod, `across(row)` for those across it
/// and another one.
template <class Own, class Across>
void for_stencils_of(const Model& model, int rod, const Own& own, const Across& across) {
  const auto& places = model.place[at(rod)];
  for (std::size_t s = 0; s < places.size(); ++s)
    if (places[s].bend >= 0) own(places[s].bend, static_cast<int>(s));
  for (const int b : model.bend_across) {
    const auto& edge = model.bend[at(b)].edge;
    if (model.edge_rod[at(edge[0])] == rod || model.edge_rod[at(edge[1])] == rod) across(b);
  }
}

void update_stiffness_of(const Model& model, Parameters& p, int rod) {
  BendStiffness stiffness(model, p);
  const auto update = [&](int b) { p.bend_stiffness.row(b) = stiffness(b); };
  for_stencils_of(model, rod, [&](int b, int) { update(b); }, update);
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h)
    if (model.edge_rod[at(model.half[at(h)].edge)] == rod) update_half_stiffness(model, p, h);
}

void update_natural_of(const Model& model, Parameters& p, int rod) {
  const NaturalStrain strain(model, p, rod);
  for_stencils_of(
      model, rod,
      [&](int b, int s) {
        p.bend_natural.row(b) = model.bend_offset.row(b) + strain(s, model.bend_voronoi(b)).transpose();
      },
      [&](int b) { update_natural_across(model, p, b); });
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    const auto& [owner, stencil] = model.half_owner[at(h)];
    if (owner == rod && stencil >= 0)
      p.half_natural.row(h) = model.half_offset.row(h) + strain(stencil, model.half_voronoi(h)).transpose();
  }
}

}  // namespace

void update_natural(const Model& model, Parameters& p) {
  p.natural_version = next_version();
  p.bend_natural = model.bend_offset;
  p.half_natural = model.half_offset;
  for (int r = 0; r < static_cast<int>(model.place.size()); ++r) update_natural_of(model, p, r);
}

void update_natural(const Model& model, Parameters& p, int rod) {
  p.natural_version = next_version();
  update_natural_of(model, p, rod);
}

void update_derived(const Model& model, Parameters& p) {
  update_masses(model, p);
  update_viscous_times(model, p);
  p.bend_stiffness.resize(static_cast<Eigen::Index>(model.bend.size()), 3);
  p.half_stiffness.resize(static_cast<Eigen::Index>(model.half.size()), 3);
  BendStiffness stiffness(model, p);
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) p.bend_stiffness.row(b) = stiffness(b);
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) update_half_stiffness(model, p, h);
  p.version = next_version();
  update_natural(model, p);
}

void update_derived(const Model& model, Derived derived, int rod, Parameters& p) {
  switch (derived) {
    case Derived::stiffness:
      update_stiffness_of(model, p, rod);
      break;
    case Derived::masses:
      update_masses(model, p);
      break;
    case Derived::viscous_times:
      update_viscous_times(model, p);
      break;
    case Derived::natural_strains:
      update_natural(model, p, rod);
      return;
    case Derived::nothing:
      break;
  }
  p.version = next_version();
}

}  // namespace withe
