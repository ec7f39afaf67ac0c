#pragma once
/// Contact of a scene in one step: touching pairs, energy and forces, friction, and the allowed length of an iterate.
///
/// Contact acts at the end configuration q1 of every scheme. Its potential k E(D) stays finite if centrelines cross.
/// `allowed` therefore shortens every iterate so that no pair of centrelines passes through another on its path. The
/// path from one accepted state to the next keeps every knot.
///
/// Contact has four parts. `Candidates` are the pairs that may touch, and a `ContactSet` holds those that touch at q1.
/// Pressing and friction are functions of its entries and of the `ContactProblem`, which is const during a solve.
/// `ContactStiffness` computes the records at the end of a step from the records at its start.

#include <span>
#include <utility>
#include <vector>

#include "contact/candidates.hpp"
#include "contact/contact_adjoint.hpp"
#include "contact/contact_linearisation.hpp"
#include "contact/contact_set.hpp"
#include "contact/contact_stiffness.hpp"
#include "contact/surfaces.hpp"

namespace withe {

/// One contact as a person wants it.
struct ContactReport {
  ContactKey key;
  double distance = 0;      ///< of the centrelines, or of a centreline and the obstacle [m]
  double gap = 0;           ///< of the surfaces [m]
  double edge_gap = 0;      ///< of the surfaces, with the straight edge in place of the curve [m]
  double s = 0, t = 0;      ///< along the edges
  Vec3d point{}, normal{};  ///< between the surfaces; from b to a
  double force = 0;         ///< normal force [N]
  Vec3d friction{};         ///< friction force on body a [N]
  bool sticking = false;

  /// Drawn overlap of surfaces [m]. Beside a corner of the edges, the curve of a rod deviates from the edges by up to
  /// an eighth of the second difference of the nodes, and begins at rest there.
  double drawn_depth() const { return -std::max(gap, edge_gap); }
};

/// Contact of a fixed state with fixed obstacles: scratch of read-outs.
struct ContactAtRest {
  ContactParameters own;  ///< parameters, if they differ from those of the steps
  ContactProblem problem;
  ContactSet set;
  CandidateSearch search;
  std::vector<ContactRecord> records;
};

class Contact {
 public:
  explicit Contact(const Model& model);
  Contact(const Contact&) = delete;
  Contact& operator=(const Contact&) = delete;

  const Surfaces& surfaces() const { return surfaces_; }
  /// True if the stiffness of the pair is a number that the scene gives.
  bool has_given_stiffness(const ContactPair& pair) const { return problem_.fixed(pair); }
  /// True if friction is there at all, and its Jacobian unsymmetric.
  bool frictional() const { return surfaces_.frictional(); }
  bool unsymmetric() const { return problem_.unsymmetric(); }
  /// True if friction goes with the way, and not with the velocity.
  bool anchored() const { return problem_.anchored(); }
  /// True if friction grows with slip, so that a continuation in the slip tolerance leads to it.
  bool regularises() const;

  /// True if an obstacle would pass through a rod on its way through this step.
  bool blocked() const { return blocked_; }

  /// Takes over how surfaces press and rub, for read-outs before the next step.
  void set_parameters(const Parameters& parameters);
  /// Sets the given stiffness of contacts of a state, and of new contacts. If no stiffness is given any more, new
  /// contacts get the least one.
  void take_given_stiffness(State& state, const Parameters& parameters) const;
  /// A step begins at `state`, which must outlive it. `duration`: the time in which slip happens [s]. `target`:
  /// obstacles at the end of the step, which must outlive it; empty: they rest.
  void begin(const State& state, const Parameters& parameters, double duration, Pressing pressing,
             std::span<const ObstaclePlace> target = {});
  /// Finds the contacts at q1.
  void update(const VectorX& q1);
  const ContactProblem& problem() const { return problem_; }
  const ContactSet& contacts() const { return set_; }
  int count() const { return set_.count(); }
  const ContactKey& key(int i) const { return set_[i].pair.key; }
  /// Unknowns of contact i, -1 for missing ones.
  void unknowns(int i, int (&dofs)[kContactUnknowns]) const { surfaces_.unknowns(set_[i].pair, dofs); }
  /// Minus the forces of a contact, and optionally their derivative.
  void local(int i, bool with_hessian, ContactLocal& out, const ContactLinearisation& linearisation = {}) const;
  /// The same of a piece beside a plane, by its nodes' coordinates alone; false where contact i is none.
  bool plane_local(int i, bool with_hessian, PlaneLocal& out, const ContactLinearisation& linearisation) const;
  void plane_unknowns(int i, int (&dofs)[kPlaneUnknowns]) const { surfaces_.plane_unknowns(set_[i].pair, dofs); }
  /// rows^T times the derivatives by the inputs of a step; see contact_adjoint.hpp.
  ContactAdjoint adjoint(int i, const double (&rows)[kContactUnknowns], double by_approach) const {
    return contact_adjoint(problem_, set_[i], rows, by_approach);
  }
  /// Rounding of contact i's force for coordinates up to `reach` [N].
  double rounding(int i, double reach, const ContactLinearisation& linearisation) const;
  /// Energy of contact and of anchors at q1, and at the start of the step [J].
  double energy() const { return set_.energy(problem_); }
  double start_energy() const { return problem_.start_energy; }
  /// Work of pressing in a step that ends at q1, `change` after its start: see contact_work.hpp.
  double pressing_gain(const VectorX& change) const;
  double mean_friction_loss(const VectorX& change, const VectorX& start, const VectorX& end) const;
  void friction_force(VectorX& out) const;
  double obstacle_work() const;
  /// True if all contacts of an accepted state kept their given stiffness; false if none was given.
  bool has_given_stiffness(const State& state) const;
  /// True if surfaces are deeper in each other than a step may end with.
  bool too_deep() const { return set_.depth() > deepest_; }
  void allow_depth(double deepest) { deepest_ = deepest; }
  /// True if a step of dt is too long to resolve where surfaces meet.
  bool unresolved(double dt) const;
  /// True if the step from q0, now at its end, is too long to see that surfaces met.
  bool missed(const VectorX& q0) { return candidates_.missed(q0, set_.q(), problem_.bodies, problem_.shift); }
  /// Pairs that touch or are near at q1, sorted: the matrix should have room for them.
  std::vector<ContactKey> near() const;

  /// Share of a change of q1 that keeps centrelines apart, from 0 to 1.
  double allowed(const VectorX& q1, const VectorX& change) { return candidates_.allowed(q1, problem_.bodies, change); }

  /// Predicts the friction of a step of Newton's method by which `change` is to be added to q1.
  void predict_friction(const VectorX& change, ContactLinearisation& linearisation) const;

  /// Which connected components touch anything, and how fast obstacles go that they touch.
  struct TouchingComponents {
    std::vector<bool> which;
    std::vector<Vec3d> obstacles;  ///< different velocities of touched obstacles in the step [m/s]
  };
  TouchingComponents touching_components() const;
  /// Removes the part of a predicted change of q that would move sticking surfaces: friction is steep there, and from
  /// outside Newton's method would step past it.
  void hold_sticking(const State& state, VectorX& change) const;

  /// Stores the records of contacts at q1 in `state`, which is still that of the start: see `ContactStiffness::accept`.
  double accept(State& state, double spare);
  /// The same in an equilibrium, or on the way to one.
  void accept_at_rest(State& state, bool arrived, double deepest = kMaxDepth);
  /// Greatest ratio of required to present stiffness of any contact; at least 1.
  double wanted_ratio() const { return ContactStiffness(problem_).wanted_ratio(set_); }
  /// True if the contacts that were accepted last press as before, up to rounding.
  bool presses_alike() const { return scratch_.change <= 1e-9 * scratch_.pressing; }
  /// Stores records for a step so short that the stiffness does not change.
  void remember(State& state);
  /// Makes contacts of bodies that are too deep in each other stiffer; returns the energy put in [J].
  double stiffen(State& state, bool at_rest);
  /// Gives a state that has none yet the stiffness that no rod falls below.
  void initialise(State& state, const Parameters& parameters) const;
  /// Contacts of a state at rest, for read-outs; and their energy.
  std::vector<ContactReport> report(const State& state, const Parameters& parameters) const;
  double energy_of(const State& state, const Parameters& parameters, ContactAtRest& rest) const;
  /// Makes the next step search all contacts again.
  void forget();

 private:
  void find(const VectorX& q);
  void find_at_rest(const State& state, const Parameters& parameters, ContactAtRest& rest) const;
  void restart(const State& state, double duration);
  void move_obstacles();
  void lag_friction();
  /// Gives a state the records that were found, with obstacles where they were to go.
  void leave(State& state);
  /// Notes in a state that obstacles have come to where they were to go.
  void leave_obstacles(State& state) const;

  Surfaces surfaces_;
  ContactParameters parameters_;
  ContactProblem problem_;
  Candidates candidates_;
  ContactSet set_, deep_;  ///< present contacts; contacts when the overlap was found too deep
  StiffnessScratch scratch_;
  bool current_ = false;  ///< true if set_ has the contacts of this step
  std::span<const ObstaclePlace> target_;
  bool blocked_ = false;
  double deepest_ = kMaxDepth;
};

}  // namespace withe
