#include "vision/zone_growth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vision/branch_matching.hpp"

namespace withe {

namespace {

/// Longest link inside a union of many zones [widths].
constexpr double kLinkLengths[] = {3.5, 6, 9, 13};
/// Larger unions are left to the matching of single zones [branches].
constexpr std::size_t kMostBranches = 24;
/// A matching bends sharply above this energy of a pair [energy of a single end].
constexpr double kSharp = 0.7;
/// A union must lower the energy at least to this share.
constexpr double kGain = 0.8;

/// The middle of a link may deviate from the way of a pair by a width, and by this share of its length.
constexpr double kDeviation = 0.1;

/// Zones and the links between them that become one zone.
struct ZoneUnion {
  std::vector<int> zones;
  std::vector<int> links;
};

class Growth {
 public:
  Growth(const SkeletonGraph& graph, const Continuations& links) : graph_(graph), links_(links) {
    of_zone_.resize(links.zones.size());
    energies_.resize(links.zones.size());
    needs_.resize(links.zones.size());
    for (std::size_t e = 0; e < graph.edges.size(); ++e) {
      const int first = links.zone_of[2 * e], second = links.zone_of[2 * e + 1];
      if (graph.edges[e].removed || links.inside[e] || first < 0 || second < 0) continue;
      of_zone_[at(first)].push_back(static_cast<int>(e));
      if (second != first) of_zone_[at(second)].push_back(static_cast<int>(e));
    }
    for (std::size_t z = 0; z < links.zones.size(); ++z) measure(static_cast<int>(z));
  }

  bool run(std::vector<char>& known_links) {
    bool found = false;
    std::vector<char> taken(links_.zones.size(), 0);
    for (std::size_t z = 0; z < links_.zones.size(); ++z) {
      if (!needs_[z] || taken[z]) continue;
      const ZoneUnion best = smallest_union(static_cast<int>(z), taken);
      for (const int zone : best.zones) taken[at(zone)] = 1;
      for (const int link : best.links) {
        found = found || !known_links[at(link)];
        known_links[at(link)] = 1;
      }
    }
    return found;
  }

 private:
  double width_of(int edge) const { return 2 * graph_.edges[at(edge)].half_width + 1; }
  double length_of(int edge) const { return graph_.edges[at(edge)].length / width_of(edge); }
  int other_zone(int edge, int zone) const {
    const int first = links_.zone_of[at(2 * edge)];
    return first == zone ? links_.zone_of[at(2 * edge + 1)] : first;
  }

  /// Energy of a zone as it is matched, and whether it needs its neighbours.
  void measure(int z) {
    double energy = 0;
    bool needs = false;
    for (const HalfEdge half : links_.zones[at(z)].branches) {
      const Branch& branch = links_.branches[at(half)];
      const double single = single_energy(2 * branch.half_width);
      const HalfEdge partner = links_.partner[at(half)];
      const double own = partner < 0 ? single : 0.5 * bending_energy(branch, links_.branches[at(partner)]);
      energy += own;
      needs = needs || partner < 0 || own > kSharp * single;
    }
    energies_[at(z)] = energy;
    needs_[at(z)] = needs;
  }

  /// Energy of the best matching of a union; infinite if a branch is left over.
  double energy_of(const ZoneUnion& set) const {
    std::vector<Branch> branches;
    for (const int zone : set.zones) {
      for (const HalfEdge half : links_.zones[at(zone)].branches) {
        if (std::find(set.links.begin(), set.links.end(), edge_of(half)) != set.links.end()) continue;
        branches.push_back(links_.branches[at(half)]);
      }
    }
    if (branches.size() > kMostBranches || branches.size() % 2 == 1) return std::numeric_limits<double>::infinity();
    const EndMatching matching = match_ends(branches);
    if (2 * matching.pairs.size() < branches.size()) return std::numeric_limits<double>::infinity();
    for (const int link : set.links) {
      if (!is_covered(graph_.edges[at(link)], branches, matching)) return std::numeric_limits<double>::infinity();
    }
    return matching.energy;
  }

  /// True if a link lies near the way of a pair. A cable that crosses itself forms a ring, which is no part of the
  /// straight way from one of its branches to the other.
  static bool is_covered(const SkeletonEdge& link, const std::vector<Branch>& branches, const EndMatching& matching) {
    if (link.points.empty()) return true;
    const Vector2 middle = link.points[link.points.size() / 2].position();
    const double reach = 2 * link.half_width + kDeviation * link.length;
    return std::any_of(matching.pairs.begin(), matching.pairs.end(), [&](const std::pair<int, int>& pair) {
      return distance_to_way(middle, branches[at(pair.first)], branches[at(pair.second)]) < reach;
    });
  }

  /// Distance of a point from the cubic line that leads from one branch into another.
  static double distance_to_way(const Vector2& point, const Branch& from, const Branch& to) {
    constexpr int places = 16;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= places; ++i) {
      const Vector2 place = way_place(from.point, from.tangent, to.point, -to.tangent, static_cast<double>(i) / places);
      least = std::min(least, (place - point).norm());
    }
    return least;
  }

  void add_links(ZoneUnion& set, double longest) const {
    for (const int zone : set.zones) {
      for (const int link : of_zone_[at(zone)]) {
        const int other = other_zone(link, zone);
        if (length_of(link) > longest || other < zone) continue;
        if (std::find(set.zones.begin(), set.zones.end(), other) != set.zones.end()) set.links.push_back(link);
      }
    }
  }

  ZoneUnion with(const ZoneUnion& set, int zone, double longest) const {
    ZoneUnion result;
    result.zones = set.zones;
    result.zones.push_back(zone);
    add_links(result, longest);
    return result;
  }

  /// The union of least energy of the smallest size that explains all branches; empty if there is none.
  ZoneUnion smallest_union(int start, const std::vector<char>& taken) const {
    const double most_length = kLinkLengths[3];
    std::vector<ZoneUnion> size{{{start}, {}}};
    for (int more = 1; more <= 2; ++more) {
      std::vector<ZoneUnion> next;
      for (const ZoneUnion& set : size) {
        for (const int zone : set.zones) {
          for (const int link : of_zone_[at(zone)]) {
            const int other = other_zone(link, zone);
            if (length_of(link) > most_length || taken[at(other)]) continue;
            if (std::find(set.zones.begin(), set.zones.end(), other) != set.zones.end()) continue;
            next.push_back(with(set, other, std::max(1.3 * length_of(link), kLinkLengths[0])));
          }
        }
      }
      if (const ZoneUnion* best = best_of(next)) return *best;
      size = std::move(next);
    }
    for (const double longest : kLinkLengths) {
      ZoneUnion set{{start}, {}};
      for (std::size_t i = 0; i < set.zones.size(); ++i) {
        for (const int link : of_zone_[at(set.zones[i])]) {
          const int other = other_zone(link, set.zones[i]);
          if (length_of(link) > longest || taken[at(other)]) continue;
          if (std::find(set.zones.begin(), set.zones.end(), other) == set.zones.end()) set.zones.push_back(other);
        }
      }
      add_links(set, longest);
      const std::vector<ZoneUnion> only{set};
      if (best_of(only) != nullptr) return set;
    }
    return {};
  }

  const ZoneUnion* best_of(const std::vector<ZoneUnion>& sets) const {
    const ZoneUnion* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const ZoneUnion& set : sets) {
      double before = 0;
      for (const int zone : set.zones) before += energies_[at(zone)];
      const double energy = energy_of(set);
      if (energy > kGain * before || energy >= least) continue;
      least = energy;
      best = &set;
    }
    return best;
  }

  const SkeletonGraph& graph_;
  const Continuations& links_;
  std::vector<std::vector<int>> of_zone_;  ///< links at each zone
  std::vector<double> energies_;
  std::vector<char> needs_;
};

}  // namespace

bool grow_zones(const SkeletonGraph& graph, const Continuations& links, std::vector<char>& known_links) {
  return Growth(graph, links).run(known_links);
}

}  // namespace withe
