#pragma once
/// Impacts of surfaces with a coefficient of restitution e below 1.
///
/// An impact is one event within one step of dt. Surfaces C apart approach each other at the speed v and, by gravity,
/// at the acceleration g_n. They meet after the time s, at the speed v_s = v + g_n s, and part at the speed e v_s. A
/// contact force at the end of the step keeps them as far apart as they are then,
///   D1 >= C + (dt - s) e v_s - g_n (dt - s)^2 / 2.
/// The force has the right effect on positions. Its effect on velocities depends on the rule of the step. Impulses at
/// the end of the step make up for the difference. With P the sum of these and of the impulses by forces of the step,
/// u_n the rate of D and u_t the rate of slip,
///   0 <= P_n,  0 <= u_n - (e v_s - g_n (dt - s)),  one of both 0 [Newton's law, in the form of Moreau 1988];
///   |P_t| <= mu P_n, against u_t where surfaces slip [Coulomb].
/// Other contacts with e < 1 that press, among them those that rest, take part without a rebound. Surfaces rest that
/// meet more slowly than `rest_speed`, or that would come back within a step.
///
/// Impacts return no more energy than they take [Stronge 1990]. Friction, and bodies that touch at several places or
/// vibrate, could otherwise gain energy by Newton's law. All rebound speeds of a step then decrease by one factor.
///
/// The impulses change velocities by M^-1 J^T P, with the masses M of the scene. They are found by a projected
/// Gauss-Seidel method over contacts [Jean 1999]. They act on the points that touch, so linear and angular momentum
/// stay as they are.

#include <array>
#include <utility>
#include <vector>

#include "contact/contact_set.hpp"

namespace withe {

/// Impulses along the distance of two surfaces and in two directions of their slip [N s].
using Impulse = std::array<double, 3>;

/// A contact to which impulses apply.
struct ReboundContact {
  int dofs[kContactUnknowns];        ///< -1: none
  double rows[3][kContactUnknowns];  ///< derivatives of D and of the slip in two directions, by the unknowns
  double drift[3];                   ///< rates of these by the motion of an obstacle [m/s]
  double speed = 0;                  ///< least rate of D [m/s]
  double friction = 0;               ///< [-]
  Impulse given{};                   ///< what the forces of the impact have done in the step [N s]
};

/// The contacts to which impulses apply at the end of a step; none if no impact happens in the step.
std::vector<ReboundContact> rebound_contacts(const ContactProblem& problem, const ContactSet& set);

/// Numbers of a vector of unknowns that are not zero.
struct SparseRow {
  std::vector<std::pair<int, double>> entries;

  double dot(const VectorX& v) const;
  void add_to(double by, VectorX& v) const;
};

/// One contact in the method of Gauss and Seidel: rows J and columns M^-1 J^T.
struct ReboundRows {
  SparseRow row[3], column[3];
  double mobility[3] = {};  ///< diagonal of J M^-1 J^T [1/kg]
};

/// Finds the impulses that act besides those of the step's forces, and adds their effect to the velocities. `elastic`:
/// share of rebound speeds.
void find_rebounds(const std::vector<ReboundContact>& contacts, const std::vector<ReboundRows>& rows, double elastic,
                   VectorX& velocity, std::vector<Impulse>& impulses);

}  // namespace withe
