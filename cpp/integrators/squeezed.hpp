#pragma once
/// Surfaces that are pressed into each other by what does not yield: a held node and an obstacle, two held nodes, or
/// two obstacles on both sides of a rod. No stiffness of contact moves them, so that its force says nothing.

#include "steps/equations.hpp"

namespace withe {

/// Contacts of the present set, -1: none.
struct Squeezed {
  int contact = -1;
  int against = -1;  ///< on the other side of what is between them; none: it is held

  explicit operator bool() const { return contact >= 0; }
};

/// The first contact that is deeper than a step may end with, and whose distance no free unknown can change; or only
/// together with another, which becomes as much deeper as it is relieved. `slope` and `other` are scratch.
Squeezed squeezed_contact(const Equations& equations, VectorX& slope, VectorX& other);

/// The first contacts of a rod with obstacles on opposite sides that leave it less room than it is thick, by more than
/// rounding, where their stiffness is not given.
Squeezed opposite_contacts(const Equations& equations, VectorX& slope, VectorX& other);

}  // namespace withe
