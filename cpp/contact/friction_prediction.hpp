#pragma once
/// The friction that a step of Newton's method predicts for the contacts that it knows, over its limit: the multipliers
/// of a primal-dual linearisation, see `ForceLaw`.

#include <algorithm>
#include <utility>
#include <vector>

#include "geometry/vec3.hpp"
#include "model/state.hpp"

namespace withe {

class FrictionPrediction {
 public:
  /// Nothing where there has been no step; what touches since then has none.
  const Vec3d* of(const ContactKey& key) const {
    static constexpr Vec3d kNone{};
    if (!known_) return nullptr;
    const auto found = std::lower_bound(shares_.begin(), shares_.end(), key,
                                        [](const Share& share, const ContactKey& k) { return share.first < k; });
    return found != shares_.end() && found->first == key ? &found->second : &kNone;
  }
  void clear() { known_ = false; }
  /// Takes the next prediction, made by add(key, share) calls of `make`, in which this one can still be asked for.
  template <class Make>
  void renew(const Make& make) {
    next_.clear();
    make([this](const ContactKey& key, const Vec3d& share) { next_.emplace_back(key, share); });
    std::sort(next_.begin(), next_.end(), [](const Share& a, const Share& b) { return a.first < b.first; });
    shares_.swap(next_);
    known_ = true;
  }

 private:
  using Share = std::pair<ContactKey, Vec3d>;
  bool known_ = false;
  std::vector<Share> shares_, next_;  ///< sorted by key
};

}  // namespace withe
