/// Obstacles that move.

#include <algorithm>
#include <cmath>

#include "common/check.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Vector3 way_at(const ObstacleMotion& m, double time) {
  const double share = time >= m.end ? 1.0 : std::clamp((time - m.start) / (m.end - m.start), 0.0, 1.0);
  return (1.0 - share) * m.from + share * m.to;
}

}  // namespace

/// How far an obstacle is from where it is drawn [m]; in a plane, within it.
Vector3 World::Implementation::obstacle_way(int obstacle) const {
  const Vec3d way =
      state.obstacles[at(obstacle)].point - drawn_place(model, description.contact.obstacles[at(obstacle)]).point;
  if (!model.planar()) return to_eigen(way);
  return way.x * model.plane->first + way.y * model.plane->second;
}

/// Places of all obstacles, each as far from where it is drawn as `way` says.
std::vector<ObstaclePlace> World::Implementation::obstacle_places(const std::function<Vector3(int)>& way) const {
  std::vector<ObstaclePlace> places;
  for (const ObstacleDescription& drawn : description.contact.obstacles) {
    ObstacleDescription moved = drawn;
    const Vector3 shift = way(static_cast<int>(places.size()));
    moved.point += shift;
    if (moved.kind != ObstacleKind::plane) moved.other += shift;
    places.push_back(drawn_place(model, moved));
  }
  return places;
}

void World::Implementation::aim_obstacles(Equations& system, double time) const {
  if (obstacle_motions.empty()) return;
  system.contact()->aim(obstacle_places([&](int o) { return way_at(obstacle_motions[at(o)], time); }));
}

void World::Implementation::release_obstacles(Equations& system) {
  if (system.contact()) system.contact()->aim({});
}

void World::move_obstacle(int obstacle, const Vector3& position, double over) {
  Implementation& self = *implementation_;
  require(std::isfinite(over) && over >= 0.0, "over must be finite and not negative");
  const Vector3 from = obstacle_position(obstacle);
  prescribe_obstacle(obstacle, position);
  ObstacleMotion& m = self.obstacle_motions[at(obstacle)];
  m.from = from - self.description.contact.obstacles[at(obstacle)].point;
  m.end = self.state.time + over;
}

void World::prescribe_obstacle(int obstacle, const Vector3& position) {
  Implementation& self = *implementation_;
  const Vector3 way = position - obstacle_position(obstacle);
  require(position.allFinite(), "position must be finite");
  const ObstacleDescription& drawn = self.description.contact.obstacles[at(obstacle)];
  // What a plane moves along itself out of the rods' plane, no rod sees without friction; with it, it pulls them out.
  if (self.model.planar() && std::abs(way.dot(self.model.plane->normal)) > 1e-9 * self.model.length_scale)
    self.leave_plane("a moving obstacle");
  if (self.obstacle_motions.empty()) {
    self.obstacle_motions.resize(self.description.contact.obstacles.size());
    for (std::size_t o = 0; o < self.obstacle_motions.size(); ++o)
      self.obstacle_motions[o].from = self.obstacle_motions[o].to = self.obstacle_way(static_cast<int>(o));
  }
  ObstacleMotion& m = self.obstacle_motions[at(obstacle)];
  m.from = m.to = position - drawn.point;
  m.start = m.end = self.state.time;
  self.state.acceleration_current = false;
}

Vector3 World::obstacle_position(int obstacle) const {
  const Implementation& self = *implementation_;
  require(obstacle >= 0 && obstacle < static_cast<int>(self.description.contact.obstacles.size()),
          "no such obstacle: " + std::to_string(obstacle));
  return self.description.contact.obstacles[at(obstacle)].point + self.obstacle_way(obstacle);
}

}  // namespace withe
