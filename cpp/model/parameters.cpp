#include <atomic>
#include <cmath>
#include <numbers>

#include "common/check.hpp"
#include "model/model.hpp"
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
  const double k = discrete.norm();
  if (k == 0.0) return Vector2::Zero();
  return (2.0 * std::atan(0.5 * k) / (k * voronoi)) * discrete;
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

void set_spring(int spring, const SpringDescription& d, Parameters& p) {
  for (double x : {d.stiffness, d.rest_length, d.damping})
    require(std::isfinite(x) && x >= 0.0,
            "stiffness, rest length and damping of a spring must be finite and not negative, got " + std::to_string(x));
  p.spring_stiffness[spring] = d.stiffness;
  p.spring_rest_length[spring] = d.rest_length;
  p.spring_damping[spring] = d.damping;
}

Parameters initial_parameters(const Model& model) {
  const SceneDescription& scene = model.description;
  Parameters p;
  const Eigen::Index edges = model.edge_count;
  p.edge_stretch.resize(edges);
  p.edge_bend.resize(edges, 2);
  for (VectorX* v : {&p.edge_twist, &p.edge_density, &p.edge_rotary, &p.edge_viscous_time, &p.edge_drag})
    v->resize(edges);
  for (std::size_t r = 0; r < scene.rods.size(); ++r) {
    const RodDescription& rod = scene.rods[r];
    set_rod(model, static_cast<int>(r), rod, p);
    p.natural_curvature.push_back(rod.natural_curvature);
    p.natural_twist.push_back(rod.natural_twist);
  }
  for (VectorX* v : {&p.spring_stiffness, &p.spring_rest_length, &p.spring_damping})
    v->resize(static_cast<Eigen::Index>(scene.springs.size()));
  for (std::size_t s = 0; s < scene.springs.size(); ++s) set_spring(static_cast<int>(s), scene.springs[s], p);
  p.added_mass = scene.added_mass;
  p.gravity = scene.gravity;
  p.fluid_viscosity = scene.fluid.viscosity;
  if (scene.bending == Bending::tangent) p.measure = {0.0, 0.0};
  update_derived(model, p);
  return p;
}

void update_natural(const Model& model, Parameters& p) {
  static std::atomic<long> versions{0};
  p.version = ++versions;
  const bool planar = model.planar();
  const auto strain = [&](int rod, int stencil, double voronoi) -> Vector3 {
    if (rod < 0 || stencil < 0) return Vector3::Zero();
    const auto r = static_cast<std::size_t>(rod);
    const Vector2 k = p.natural_curvature[r].row(stencil);
    require_turn(k, voronoi);
    const Vec3d out = natural_strain(p.measure, k(0), k(1), p.natural_twist[r](stencil), voronoi);
    if (planar) return {model.planar_components[r].dot(Vector2(out.x, out.y)), 0.0, 0.0};
    return {out.x, out.y, out.z};
  };
  p.bend_natural = model.bend_offset;
  for (std::size_t r = 0; r < model.place.size(); ++r)
    for (std::size_t s = 0; s < model.place[r].size(); ++s) {
      const StencilPlace& place = model.place[r][s];
      if (place.bend >= 0)
        p.bend_natural.row(place.bend) +=
            strain(static_cast<int>(r), static_cast<int>(s), model.bend_voronoi(place.bend));
    }
  // Stencils across two rods: each rod's nearest natural strain over its half of the length.
  for (std::size_t b = 0; b < model.bend.size(); ++b) {
    if (model.bend_owner[b].first >= 0) continue;
    for (int i = 0; i < 2; ++i) {
      const int edge = model.bend[b].edge[i];
      const int rod = model.edge_rod[static_cast<std::size_t>(edge)];
      const int stencils = static_cast<int>(p.natural_twist[static_cast<std::size_t>(rod)].size());
      if (stencils == 0 || model.bend_owner[b].second < -1) continue;
      const int nearest = edge == model.rod_first_edge[static_cast<std::size_t>(rod)] ? 0 : stencils - 1;
      p.bend_natural.row(static_cast<Eigen::Index>(b)) += strain(rod, nearest, 0.5 * model.edge_arc(edge));
    }
  }
  p.half_natural.resize(static_cast<Eigen::Index>(model.half.size()), 3);
  for (std::size_t h = 0; h < model.half.size(); ++h)
    p.half_natural.row(static_cast<Eigen::Index>(h)) =
        strain(model.half_owner[h].first, model.half_owner[h].second, model.half_voronoi(static_cast<Eigen::Index>(h)));
}

void update_derived(const Model& model, Parameters& p) {
  const auto at = [](int i) { return static_cast<Eigen::Index>(i); };
  p.node_mass = p.added_mass;
  p.node_drag = VectorX::Zero(model.node_count);
  p.edge_inertia.resize(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const double half = 0.5 * model.edge_arc(e);
    for (int node : {model.edge_tail[static_cast<std::size_t>(e)], model.edge_head[static_cast<std::size_t>(e)]}) {
      p.node_mass(node) += half * p.edge_density(e);
      p.node_drag(node) += half * p.edge_drag(e);
    }
    p.edge_inertia(e) = model.edge_arc(e) * p.edge_rotary(e);
  }
  p.dragged = (p.node_drag.array() != 0.0).any();
  p.viscous = (p.edge_viscous_time.array() != 0.0).any();

  // In a plane the one bending stiffness stands in the first column.
  const auto bend_of = [&](int e) -> Vector2 {
    if (!model.planar()) return p.edge_bend.row(e);
    const Vector2 c = model.planar_components[static_cast<std::size_t>(model.edge_rod[static_cast<std::size_t>(e)])];
    const Vector2 b = p.edge_bend.row(e);
    return Vector2(c(0) * c(0) * b(0) + c(1) * c(1) * b(1), 0.0);
  };
  const auto twist_stiffness = [&](double twist, const Vector2& bend, const ArcOfStencil& arc) {
    if (!arc.turns || twist == 0.0 || bend.minCoeff() <= 0.0) return twist;
    return twist_of_arc(twist, bend(0), bend(1), arc.square_of_turn, arc.share);
  };
  const auto n = static_cast<Eigen::Index>(model.bend.size());
  p.bend_stiffness.resize(n, 3);
  p.bend_viscous_time.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const BendStencil& s = model.bend[static_cast<std::size_t>(i)];
    const int a = s.edge[0], b = s.edge[1];
    const double la = model.edge_arc(a), lb = model.edge_arc(b);
    const Vector2 ba = bend_of(a), bb = bend_of(b);
    const double va = model.bend_share(i, 0) * la, vb = model.bend_share(i, 1) * lb;
    const Vector2 bending(in_series(ba(0), va, bb(0), vb), in_series(ba(1), va, bb(1), vb));
    const double twist = in_series(p.edge_twist(a), 0.5 * la, p.edge_twist(b), 0.5 * lb);
    p.bend_stiffness.row(i) << bending.transpose(), twist_stiffness(twist, bending, arc_of_bend(model, i));
    p.bend_viscous_time(i) = (la * p.edge_viscous_time(a) + lb * p.edge_viscous_time(b)) / (la + lb);
  }
  const auto m = static_cast<Eigen::Index>(model.half.size());
  p.half_stiffness.resize(m, 3);
  p.half_viscous_time.resize(m);
  p.frame_inertia = VectorX::Zero(model.frame_count);
  p.hinge_inertia = VectorX::Zero(at(static_cast<int>(model.hinges.size())));
  for (Eigen::Index i = 0; i < m; ++i) {
    const FrameStencil& s = model.half[static_cast<std::size_t>(i)];
    const Vector2 bending = bend_of(s.edge) / (model.half_share(i) * model.edge_arc(s.edge));
    const double twist = p.edge_twist(s.edge) / model.half_voronoi(i);
    p.half_stiffness.row(i) << bending.transpose(), twist_stiffness(twist, bending, arc_of_half(model, i));
    p.half_viscous_time(i) = p.edge_viscous_time(s.edge);
    // A frame carries the rotary inertia of the half edges attached to it.
    (s.hinge < 0 ? p.frame_inertia(s.frame) : p.hinge_inertia(s.hinge)) += 0.5 * p.edge_inertia(s.edge);
    if (s.hinge >= 0) p.frame_inertia(s.frame) += 0.5 * p.edge_inertia(s.edge);
  }
  update_natural(model, p);
}

}  // namespace withe
