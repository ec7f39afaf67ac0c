#pragma once
/// Linearisation of contact for Newton's method: a continuation in the slip tolerance, omitted derivatives, and the
/// friction that the last step predicted.

#include <algorithm>
#include <utility>
#include <vector>

#include "geometry/vec3.hpp"
#include "model/state.hpp"

namespace withe {

/// Friction of contacts over its limit, as a step of Newton's method predicts it: the multipliers of a primal-dual
/// linearisation, see `ForceLaw`.
class FrictionPrediction {
 public:
  /// Null if there was no step; contacts that began since then have none.
  const Vec3d* of(const ContactKey& key, OrderedLookup& lookup) const {
    static constexpr Vec3d kNone{};
    if (!known_) return nullptr;
    const Share* found = lookup.find(shares_, key, [](const Share& share) -> const ContactKey& { return share.first; });
    return found ? &found->second : &kNone;
  }
  const Vec3d* of(const ContactKey& key) const {
    OrderedLookup lookup;
    return of(key, lookup);
  }
  void clear() { known_ = false; }
  /// Stores the results of make(add), which calls add(key, share). The previous prediction is available until then.
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

/// Kind of friction: of surfaces that slip, or of a rod that rolls; see friction.hpp.
enum class FrictionKind { slipping, rolling };
inline constexpr FrictionKind kFrictionKinds[] = {FrictionKind::slipping, FrictionKind::rolling};

struct ContactLinearisation {
  double regularisation = 1;  ///< factor of the slip tolerance
  bool geometric = true;      ///< derivatives have how pressing turns, the part by which it has negative stiffness
  FrictionPrediction friction{}, rolling{};  ///< if known, derivatives are those of Newton's steps, not those of the
                                             ///< forces

  const FrictionPrediction& predicted(FrictionKind kind) const {
    return kind == FrictionKind::rolling ? rolling : friction;
  }
  void forget_friction() { friction.clear(), rolling.clear(); }
};

}  // namespace withe
