#pragma once
/// Surfaces that are pressed into each other by parts that cannot yield: a held node and an obstacle, two held nodes,
/// or two obstacles on both sides of a rod. The depth does not depend on the contact stiffness, so the force is
/// arbitrary.

#include "steps/equations.hpp"

namespace withe {

/// Contacts of the present set, -1: none.
struct Squeezed {
  int contact = -1;
  int against = -1;  ///< contact on the other side; -1: the part between is held

  explicit operator bool() const { return contact >= 0; }
};

/// The first contact that exceeds the allowed depth and whose distance no free unknown can change, or only together
/// with an opposite contact that deepens by as much. `slope` and `other` are scratch.
Squeezed squeezed_contact(const Equations& equations, VectorX& slope, VectorX& other);

/// The first contacts of a rod with obstacles on opposite sides that leave it less room than it is thick, by more than
/// rounding, where their stiffness is not given.
Squeezed opposite_contacts(const Equations& equations, VectorX& slope, VectorX& other);

}  // namespace withe
