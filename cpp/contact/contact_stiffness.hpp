#pragma once
/// Stiffness of contacts: computes the records of contacts at the end of a step from the records at its start and the
/// touching pairs at its end.
///
/// The stiffness k of a contact follows its force, so that the overlap of surfaces is about `kDepth` of the smaller
/// radius. If a loaded contact stiffens during a step, it also yields: the force stays the same and the stored energy
/// decreases, or in an impact stays the same. The yielded depth carries no force. It decreases as surfaces part, and
/// decays while they rest. In equilibria nothing yields, and contacts have the stiffness of new contacts. Otherwise a
/// sliding surface would be held at the change from one contact to the next, as if by friction.

#include "contact/contact_set.hpp"

namespace withe {

/// Stiffness of a new contact, for a whole node [N/m]. `stiffness` is the stiffness of new contacts per rod.
double start_stiffness(const ContactProblem& problem, const ContactPair& pair, const VectorX& stiffness);
/// Stiffness of a contact without a record. The approach speed does not stiffen pairs that touch when the step begins,
/// because that would add energy.
double first_stiffness(const ContactProblem& problem, const ContactPair& pair);

/// Scratch of the end of a step.
struct StiffnessScratch {
  struct Fading {
    const Touching* touching;
    std::size_t record;
  };
  std::vector<ContactRecord> records;
  std::vector<Fading> fading;
  VectorX greatest;                 ///< required stiffness, per rod [N/m]
  VectorX force;                    ///< per unknown [N]
  double pressing = 0, change = 0;  ///< greatest force in an equilibrium, and greatest change of a force [N]
};

class ContactStiffness {
 public:
  explicit ContactStiffness(const ContactProblem& problem) : problem_(problem) {}

  /// Sets `scratch.records` to the records of touching pairs at the end of a step. Their stiffness, and the stiffness
  /// of new contacts per rod, follow the forces. Returns the added energy, which is at most `spare`, and negative if
  /// energy was removed [J].
  double accept(const ContactSet& set, double spare, StiffnessScratch& scratch, VectorX& stiffness) const;
  /// `accept` for an equilibrium, or for a point on the path to it. If a force needs a greater stiffness, all contacts
  /// of its rods become stiffer and press harder; on the path, only where the overlap exceeds `deepest`. In an
  /// equilibrium, contacts of rods that are far too stiff for their forces become softer.
  void accept_at_rest(const ContactSet& set, bool arrived, double deepest, StiffnessScratch& scratch,
                      VectorX& stiffness) const;
  /// Greatest ratio of required to present stiffness of any contact; at least 1.
  double wanted_ratio(const ContactSet& set) const;
  /// `accept` for a step so short that the stiffness does not change.
  void remember(const ContactSet& set, const VectorX& stiffness, std::vector<ContactRecord>& records) const;
  /// Stiffens the contacts of `set` with too much overlap: their records at the start of the step, and the stiffness of
  /// new contacts. `start` is the set at the start of the step. In an equilibrium, only contacts are stiffened that
  /// `accept_at_rest` does not change. Returns the added energy [J].
  double stiffen(const ContactSet& set, const ContactSet& start, bool at_rest, std::vector<ContactRecord>& records,
                 VectorX& stiffness) const;
  /// Marks in `start` the contacts that begin with the scene, among those that touch as the step begins, and the
  /// surfaces that approach each other again.
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
  double settle(const Touching& t, double weight, ContactRecord& record) const;
  /// By how much a contact's stiffness is to change, by the force that it carries.
  double wanted_ratio(const Touching& t, const ContactRecord& record) const;
  double source_stiffness(const ContactSet& set, VectorX& force) const;

  const ContactProblem& problem_;
};

}  // namespace withe
