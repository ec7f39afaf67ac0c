#pragma once
/// Set of contacts at one configuration: a value without memory.

#include "contact/candidates.hpp"
#include "contact/contact_linearisation.hpp"
#include "contact/contact_problem.hpp"

namespace withe {

class ContactSet {
 public:
  /// Finds the contacts at q: first those with lagged friction, then those that press, in the order of candidates, then
  /// those that only return their energy. `within_reach(add)` calls add(pair, proximity) for all near pairs, in order.
  template <class WithinReach>
  void find(const ContactProblem& problem, const VectorX& q, const WithinReach& within_reach) {
    q_ = q;
    touching_ = problem.lagged;
    for (Touching& t : touching_) problem.bodies.values(t.pair, q, t.now);
    const std::size_t first = touching_.size();
    OrderedLookup records;
    within_reach([&](const ContactPair& pair, const Proximity& proximity) {
      Touching& t = add(problem, pair, proximity);
      set_forces(problem, records, t);
      if (!problem.touch(pair, proximity.distance, t.yielded) || leaves_face(problem, t)) touching_.pop_back();
    });
    const std::size_t last = touching_.size();
    add_all(problem, problem.leaving, first, last);
    add_all(problem, problem.striking, first, last);
  }
  void clear();

  const VectorX& q() const { return q_; }
  int count() const { return static_cast<int>(touching_.size()); }
  const Touching& operator[](int i) const { return touching_[static_cast<std::size_t>(i)]; }
  std::vector<Touching>::const_iterator begin() const { return touching_.begin(); }
  std::vector<Touching>::const_iterator end() const { return touching_.end(); }
  /// The contact of a pressing pair, or null.
  const Touching* pressing(const ContactKey& key) const;
  /// Updates a contact from its changed record.
  void renew(const ContactProblem& problem, int i, const ContactRecord& record);

  /// Energy of pressing, and with that of anchors, at the end of a step and at the start of the next one [J].
  double pressing_energy() const;
  double energy(const ContactProblem& problem) const;
  double kept_energy(const ContactProblem& problem) const;
  /// Greatest depth of surfaces in each other, over the smaller radius.
  double depth() const;

 private:
  Touching& add(const ContactProblem& problem, const ContactPair& pair, const Proximity& proximity);
  static void set_forces(const ContactProblem& problem, OrderedLookup& records, Touching& t);
  static bool leaves_face(const ContactProblem& problem, const Touching& t);
  void add_all(const ContactProblem& problem, const std::vector<Touching>& acting, std::size_t first, std::size_t last);

  VectorX q_;
  std::vector<Touching> touching_;
};

/// Minus the forces of a contact, and optionally their derivative.
void contact_local(const ContactProblem& problem, const Touching& t, const ContactLinearisation& linearisation,
                   bool with_hessian, ContactLocal& out);

}  // namespace withe
