#pragma once
/// Which contacts have a place in the matrix: their rows in the assembler's table of elements.

#include <algorithm>
#include <functional>
#include <vector>

#include "contact/contact.hpp"

namespace withe {

class ContactRows {
 public:
  /// Sorted.
  const std::vector<ContactKey>& keys() const { return keys_; }
  /// Unknowns of all rows, one after the other.
  const std::vector<int>& unknowns() const { return unknowns_; }
  /// -1: none.
  int row(const ContactKey& key, OrderedLookup& lookup) const {
    const ContactKey* known = lookup.find(keys_, key, std::identity{});
    return known ? static_cast<int>(known - keys_.data()) : -1;
  }
  /// True if all that touches has a row.
  bool hold(const Contact& contact) const {
    OrderedLookup lookup;
    for (int i = 0; i < contact.count(); ++i)
      if (row(contact.key(i), lookup) < 0) return false;
    return true;
  }
  void set(const Surfaces& surfaces, std::vector<ContactKey> keys) {
    std::sort(keys.begin(), keys.end());
    keys_ = std::move(keys);
    unknowns_.clear();
    for (const ContactKey& key : keys_) {
      int dofs[kContactUnknowns];
      surfaces.unknowns(key, dofs);
      unknowns_.insert(unknowns_.end(), std::begin(dofs), std::end(dofs));
    }
  }

 private:
  std::vector<ContactKey> keys_;
  std::vector<int> unknowns_;
};

}  // namespace withe
