#include "contact/rebound.hpp"

#include <algorithm>
#include <cmath>

#include "contact/contact_friction.hpp"
#include "contact/pressing.hpp"

namespace withe {
namespace {

// Greatest change of a velocity in the last sweep over contacts, over the greatest rate that contacts change.
constexpr double kTolerance = 1e-12;
constexpr int kMaxSweeps = 1000;

/// Two directions across a unit vector.
void across(const Vec3d& normal, Vec3d (&out)[2]) {
  const Vec3d& least = kUnitVectors[std::abs(normal.x) < 0.6 ? 0 : 1];
  const Vec3d first = cross(normal, least);
  out[0] = (1.0 / std::sqrt(dot(first, first))) * first;
  out[1] = cross(normal, out[0]);
}

ReboundContact rebound_of(const ContactProblem& problem, const Touching& t) {
  ReboundContact out;
  problem.surfaces->unknowns(t.pair, out.dofs);
  double slope[12];
  distance_slope(t, slope);
  std::fill(std::begin(out.rows[0]), std::end(out.rows[0]), 0.0);
  std::copy(std::begin(slope), std::end(slope), out.rows[0]);
  const Vec3d moved = problem.velocity_of(t.pair);
  const int own = t.pair.curve() ? 9 : 6;
  out.drift[0] = 0.0;
  for (int i = 0; i < own; ++i) out.drift[0] -= slope[i] * moved[i % 3];
  out.speed = t.strike.speed;
  out.friction = t.pair.friction;
  const LaggedFriction slip = lag_friction(problem, t);
  Vec3d direction[2];
  across(t.proximity.normal, direction);
  for (int k = 0; k < 2; ++k) {
    for (int i = 0; i < kContactUnknowns; ++i) out.rows[k + 1][i] = dot(direction[k], slip.column(i));
    out.drift[k + 1] = -dot(direction[k], slip.drift) / problem.duration;
  }
  if (!t.struck()) return out;
  ContactRecord record;
  record_friction(problem, t, record);
  out.given[0] = -problem.duration * t.pressing.first;
  for (std::size_t k = 0; k < 2; ++k) out.given[k + 1] = problem.duration * dot(direction[k], record.friction);
  return out;
}

}  // namespace

double SparseRow::dot(const VectorX& v) const {
  double sum = 0.0;
  for (const auto& [i, value] : entries) sum += value * v[i];
  return sum;
}

void SparseRow::add_to(double by, VectorX& v) const {
  for (const auto& [i, value] : entries) v[i] += by * value;
}

std::vector<ReboundContact> rebound_contacts(const ContactProblem& problem, const ContactSet& set) {
  std::vector<ReboundContact> out;
  if (std::none_of(set.begin(), set.end(), [](const Touching& t) { return t.struck(); })) return out;
  for (const Touching& t : set)
    if (t.lagged < 0 && t.pair.restitution < 1.0 && t.pressing.first < 0.0) out.push_back(rebound_of(problem, t));
  return out;
}

void find_rebounds(const std::vector<ReboundContact>& contacts, const std::vector<ReboundRows>& rows, double elastic,
                   VectorX& velocity, std::vector<Impulse>& impulses) {
  impulses.clear();
  for (const ReboundContact& c : contacts) impulses.push_back(c.given);
  double greatest = 0.0;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double change = 0.0;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ReboundContact& c = contacts[i];
      const ReboundRows& r = rows[i];
      const auto apply = [&](std::size_t k, double by) {
        r.column[k].add_to(by, velocity);
        impulses[i][k] += by;
        change = std::max(change, std::abs(by) * r.mobility[k]);
      };
      if (!(r.mobility[0] > 0.0)) continue;  // between surfaces that are held
      const double rate = r.row[0].dot(velocity) + c.drift[0] - elastic * c.speed;
      apply(0, std::max(-rate / r.mobility[0], -impulses[i][0]));
      if (!(c.friction > 0.0)) continue;
      // One mobility for both directions: friction is then against the slip, for any choice of directions.
      const double mobility = r.mobility[1] + r.mobility[2];
      double wanted[2] = {};
      for (std::size_t k = 0; k < 2 && mobility > 0.0; ++k)
        wanted[k] = impulses[i][k + 1] - (r.row[k + 1].dot(velocity) + c.drift[k + 1]) / mobility;
      const double size = std::sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1]), most = c.friction * impulses[i][0],
                   share = size > most ? most / size : 1.0;
      for (std::size_t k = 0; k < 2; ++k) apply(k + 1, share * wanted[k] - impulses[i][k + 1]);
    }
    greatest = std::max(greatest, change);
    if (change <= kTolerance * greatest) break;
  }
  for (std::size_t i = 0; i < contacts.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) impulses[i][k] -= contacts[i].given[k];
}

}  // namespace withe
