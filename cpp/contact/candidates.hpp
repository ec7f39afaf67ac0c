#pragma once
/// Which surfaces may touch, and how far an iterate may go.
///
/// A grid finds the pairs of edges that may come near on the path of an iterate, with a margin. The search is repeated
/// when a node leaves the margin. The set of touching pairs, and the allowed length of an iterate, depend only on the
/// positions of the bodies, not on earlier searches. Bounds of the motion only let the search skip pairs.

#include <vector>

#include "contact/bodies.hpp"
#include "contact/broad_phase.hpp"

namespace withe {

/// Scratch of a search for near pairs.
struct CandidateSearch {
  BroadPhase broad_phase;
  std::vector<Box> boxes;
  std::vector<ContactPair> pairs;  ///< pairs with obstacles first, then others, sorted by key
};

class Candidates {
 public:
  Candidates(const Model& model, const Surfaces& surfaces);

  /// Calls add(pair, proximity) for all that is within reach at q: obstacles' pairs first, then others, sorted by key.
  template <class Add>
  void find(const VectorX& q, const Bodies& bodies, const Add& add) {
    reach(q, bodies);
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      if (bounds_[p].clear > moved_) continue;
      const Proximity proximity = bodies.proximity(pairs_[p], q);
      set_bounds(proximity.apart(), p);
      if (proximity.distance < pairs_[p].reach()) add(pairs_[p], proximity);
    }
  }
  /// The same without a trace; what the search needs is the caller's.
  template <class Add>
  void find(const VectorX& q, const Bodies& bodies, CandidateSearch& search, const Add& add) const {
    const bool known = !outgrown(q, nullptr);
    if (!known) find_near(q, 0.0, search);
    const double here = moved_ + way_from_last(q, bodies);
    const std::vector<ContactPair>& pairs = known ? pairs_ : search.pairs;
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      if (known && p < bounds_.size() && bounds_[p].clear > here) continue;
      const Proximity proximity = bodies.proximity(pairs[p], q);
      if (proximity.distance < pairs[p].reach()) add(pairs[p], proximity);
    }
  }
  /// Share of a change of q that keeps centrelines apart, from 0 to 1.
  double allowed(const VectorX& q, const Bodies& bodies, const VectorX& change);
  /// True if an obstacle that moves by its `shift` would pass through a rod that stays at q.
  bool blocked(const VectorX& q, const Bodies& bodies, const std::vector<Vec3d>& shift) const;
  /// True if surfaces that are apart at q, and were before it, have gone through each other in between, on a way that
  /// the candidates are known for. `shift`: of obstacles since then; empty: they rest.
  bool missed(const VectorX& before, const VectorX& q, const Bodies& bodies, const std::vector<Vec3d>& shift);
  /// Pairs within reach and half of their radii at q, sorted by key, independent of the candidates; and all pairs with
  /// obstacles. With an empty q only the latter.
  std::vector<ContactKey> near(const VectorX& q, const Bodies& bodies) const;
  /// Coefficients of friction of the surfaces have changed.
  void renew_parameters() {
    for (ContactPair& pair : pairs_) surfaces_.set_parameters(pair);
  }
  /// Discards the results of earlier searches.
  void forget();

 private:
  struct Bounds {
    double clear = -1.0;  ///< the pair does not touch while `moved_` stays below this distance [m]
    double open = -1.0;   ///< nor do its centrelines come nearer than an iteration may bring them
  };
  void reach(const VectorX& q, const Bodies& bodies);
  void set_bounds(double distance, std::size_t pair);
  double way_from_last(const VectorX& q, const Bodies& bodies) const;
  template <class More>
  void set_boxes(const VectorX& from, const VectorX& to, const More& more, std::vector<Box>& out) const;
  void find_near(const VectorX& q, double radii, CandidateSearch& search) const;
  void add_near(const std::vector<BroadPhase::Pair>& found, std::vector<ContactPair>& pairs) const;
  void find_pairs(const VectorX& from, const VectorX& to);
  bool outgrown(const VectorX& q, const VectorX* change) const;
  const Model& model_;
  const Surfaces& surfaces_;
  BroadPhase broad_phase_;
  std::vector<Box> boxes_;
  std::vector<ContactPair> pairs_;  ///< pairs with obstacles first, then those of the broad phase, sorted by key
  VectorX end_, back_;              ///< scratch: where a way leads, and the way to where one began
  VectorX reference_;               ///< q for which the candidates were found
  VectorX low_, high_;              ///< bounds of the way there
  double margin_ = 0;
  std::vector<Bounds> bounds_;  ///< per pair
  VectorX last_;                ///< the last q, and obstacles there
  std::vector<Obstacle> last_obstacles_;
  double moved_ = 0;  ///< farthest that a node may have gone, summed over all q so far [m]
};

}  // namespace withe
