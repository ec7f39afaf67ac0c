#pragma once
/// Stiffness of contacts: from the records of contacts as a step begins, and what touches at its end, to the records
/// that it leaves.
///
/// Stiffness k follows each contact's force so that surfaces are about `kDepth` of the smaller radius deep in each
/// other. In steps, what becomes stiffer under load yields, so that it goes on pressing as hard as before, and stores
/// less, or in an impact stores as much; the depth that presses no more wears off as surfaces part, and fades where
/// they rest. In equilibria nothing yields, and contacts are as stiff as those which are yet to begin: what slides on
/// from one to the next would otherwise be held, as by friction.

#include "contact/contact_set.hpp"

namespace withe {

/// Stiffness of a contact that begins, for a whole node [N/m]. `stiffness`: of contacts that begin, per rod.
double start_stiffness(const ContactProblem& problem, const ContactPair& pair, const VectorX& stiffness);
/// Stiffness of a contact without a record. What touches already when the step begins does not become stiffer by its
/// speed, which would put energy in.
double first_stiffness(const ContactProblem& problem, const ContactPair& pair);

/// Scratch of the end of a step.
struct StiffnessScratch {
  struct Fading {
    const Touching* touching;
    std::size_t record;
  };
  std::vector<ContactRecord> records;
  std::vector<Fading> fading;
  VectorX greatest;                 ///< stiffness wanted, per rod [N/m]
  VectorX force;                    ///< per unknown [N]
  double pressing = 0, change = 0;  ///< the greatest force, and by how much one has changed, of an equilibrium [N]
};

class ContactStiffness {
 public:
  explicit ContactStiffness(const ContactProblem& problem) : problem_(problem) {}

  /// Makes `scratch.records` those of what touches at the end of a step, whose stiffness follows the forces, and so
  /// does that of contacts that begin, per rod. Returns the energy that this put in, no more than `spare`, and below
  /// zero where it took some [J].
  double accept(const ContactSet& set, double spare, StiffnessScratch& scratch, VectorX& stiffness) const;
  /// The same in an equilibrium, or on the way to one. Where a force wants a greater stiffness, on the way where
  /// surfaces are deeper in each other than `deepest`, all contacts of their rods become stiffer, and press harder; in
  /// an equilibrium those of rods that are far too stiff for their forces softer.
  void accept_at_rest(const ContactSet& set, bool arrived, double deepest, StiffnessScratch& scratch,
                      VectorX& stiffness) const;
  /// The greatest of the stiffnesses that forces want of contacts, over what they have; no less than 1.
  double wanted_ratio(const ContactSet& set) const;
  /// The same for a step so short that stiffness stays as it is.
  void remember(const ContactSet& set, const VectorX& stiffness, std::vector<ContactRecord>& records) const;
  /// Makes contacts stiffer that are too deep in `set`, records of the step's start and stiffness of contacts that
  /// begin; `start`: what touches there. In an equilibrium those alone that `accept_at_rest` leaves as they are.
  /// Returns the energy put in [J].
  double stiffen(const ContactSet& set, const ContactSet& start, bool at_rest, std::vector<ContactRecord>& records,
                 VectorX& stiffness) const;
  /// Which contacts begin with the scene, of those that touch as the step begins, and which surfaces near each other
  /// anew by then; gives them to `start`.
  void renew(ContactSet& start, std::vector<ContactRecord>& records) const;

 private:
  bool begins_at_rest(const Touching& t, ContactRecord& record) const;
  bool begins_anew(const Touching& t, bool struck, ContactRecord& record) const;
  bool is_struck(const Touching& t) const;
  /// True if it is near enough to press, and not there for its friction of the start alone.
  bool presses(const Touching& t) const;
  ContactRecord record(const Touching& t) const;
  void finish(const ContactSet& set, std::vector<ContactRecord>& records) const;
  double yielded_at(const Touching& t, double ratio) const;
  double change_stiffness(const Touching& t, double ratio, double yielded, ContactRecord& record) const;
  /// By how much a contact's stiffness is to change, by the force that it carries.
  double wanted_ratio(const Touching& t, const ContactRecord& record) const;
  double source_stiffness(const ContactSet& set, VectorX& force) const;

  const ContactProblem& problem_;
};

}  // namespace withe
