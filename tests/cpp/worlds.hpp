#pragma once
/// Worlds to run, and how to compare them bit for bit.

#include <cstring>

#include "scenes.hpp"
#include "world/world.hpp"

namespace withe::testing {

/// Rubber-like: half a metre long, 1 cm thick, 1 MPa.
inline RodMaterial rubber() {
  const double radius = 5e-3, area = kPi * radius * radius, second = 0.25 * kPi * std::pow(radius, 4);
  RodMaterial m;
  m.stretch = 1e6 * area;
  m.bend1 = m.bend2 = 1e6 * second;
  m.twist = 1e6 / 3.0 * 2.0 * second;
  m.density = 1200.0 * area;
  m.rotary = 1200.0 * 2.0 * second;
  return m;
}

inline Options options(Integrator integrator, double time_step = 5e-3) {
  Options o;
  o.integrator = integrator;
  o.time_step = time_step;
  return o;
}

/// One that holds a node, which may slide along what `free` projects onto.
inline SupportDescription support(SupportKind kind, const RodPass& pass, const Matrix3& free = Matrix3::Zero()) {
  SupportDescription s;
  s.kind = kind;
  s.pass = pass;
  s.free = free;
  return s;
}

/// A bent arm in space, clamped at its start, that hangs and swings.
inline SceneBuilder hanging_arm(int nodes = 12, const RodMaterial& material = rubber()) {
  SceneBuilder builder;
  builder.add_rod(0.15 * helix(nodes), material);
  builder.scene.gravity = Vector3(0, 0, -9.81);
  builder.support(SupportKind::clamp, {0, 0});
  return builder;
}

/// A horizontal cantilever that stays in the xz plane.
inline SceneBuilder cantilever(int nodes = 12, const RodMaterial& material = rubber()) {
  SceneBuilder builder;
  builder.add_rod(line(Vector3::Zero(), Vector3(0.3, 0, 0), nodes), material, false, Vector3::UnitY());
  builder.scene.gravity = Vector3(0, 0, -9.81);
  builder.support(SupportKind::clamp, {0, 0});
  return builder;
}

template <class Matrix>
bool same_bits(const Matrix& a, const Matrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(double)) == 0;
}

/// Everything that a world knows about where it is and how it moves.
inline bool same_state(const World& a, const World& b) {
  bool same =
      a.time() == b.time() && same_bits(a.positions(), b.positions()) && same_bits(a.velocities(), b.velocities());
  for (std::size_t r = 0; r < a.description().rods.size(); ++r) {
    const int rod = static_cast<int>(r);
    same = same && same_bits(a.directors(rod), b.directors(rod)) && same_bits(a.twists(rod), b.twists(rod)) &&
           same_bits(a.spins(rod), b.spins(rod)) && same_bits(a.natural_curvature(rod), b.natural_curvature(rod));
  }
  const Energy x = a.energy(), y = b.energy();
  return same && x.total == y.total && x.work == y.work && x.dissipated == y.dissipated;
}

}  // namespace withe::testing
