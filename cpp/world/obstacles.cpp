/// Obstacles that move.

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "common/check.hpp"
#include "run/checks.hpp"
#include "run/drive.hpp"
#include "world/implementation.hpp"

namespace withe {

void World::move_obstacle(int obstacle, const std::optional<Vector3>& position, const std::optional<Vector3>& turn,
                          double over) {
  Implementation& self = *implementation_;
  require(std::isfinite(over) && over >= 0.0, "over must be finite and not negative");
  const Vector3 from = obstacle_position(obstacle);
  const ObstacleWay before = obstacle_way(self.model, self.state, obstacle);
  prescribe_obstacle(obstacle, position, turn);
  ObstacleMotion& m = self.obstacle_motions[at(obstacle)];
  const Span way{self.state.time, self.state.time + over};
  if (position) {
    m.from.shift = from - self.description.contact.obstacles[at(obstacle)].point;
    m.shift = way;
  }
  if (turn) {
    m.from.turn = before.turn;
    m.turn = way;
  }
}

void World::prescribe_obstacle(int obstacle, const std::optional<Vector3>& position,
                               const std::optional<Vector3>& turn) {
  Implementation& self = *implementation_;
  const Vector3 way = position.value_or(obstacle_position(obstacle)) - obstacle_position(obstacle);
  require(way.allFinite(), "position must be finite");
  if (turn) check_turn(self.model, obstacle, *turn);
  const ObstacleDescription& drawn = self.description.contact.obstacles[at(obstacle)];
  // An obstacle plane that moves along itself, out of the rods' plane, pulls the rods out of it by friction.
  if (self.model.planar()) {
    const Vector3& n = self.model.plane->normal;
    if (std::abs(way.dot(n)) > 1e-9 * self.model.length_scale || (turn && n.cross(*turn).norm() > 1e-9 * turn->norm()))
      self.leave_plane("a moving obstacle");
  }
  if (self.obstacle_motions.empty()) {
    self.obstacle_motions.resize(self.description.contact.obstacles.size());
    for (std::size_t o = 0; o < self.obstacle_motions.size(); ++o)
      self.obstacle_motions[o].from = self.obstacle_motions[o].to =
          obstacle_way(self.model, self.state, static_cast<int>(o));
  }
  ObstacleMotion& m = self.obstacle_motions[at(obstacle)];
  const Span now{self.state.time, self.state.time};
  if (position) {
    m.from.shift = m.to.shift = *position - drawn.point;
    m.shift = now;
  }
  if (turn) {
    m.from.turn = m.to.turn = *turn;
    m.turn = now;
  }
  self.state.acceleration_current = false;
}

Vector3 World::obstacle_position(int obstacle) const {
  const Implementation& self = *implementation_;
  require(obstacle >= 0 && obstacle < static_cast<int>(self.description.contact.obstacles.size()),
          "no such obstacle: " + std::to_string(obstacle));
  return self.description.contact.obstacles[at(obstacle)].point + obstacle_way(self.model, self.state, obstacle).shift;
}

Vector3 World::obstacle_turn(int obstacle) const {
  (void)obstacle_position(obstacle);  // refuses one that is not there
  return obstacle_way(implementation_->model, implementation_->state, obstacle).turn;
}

}  // namespace withe
