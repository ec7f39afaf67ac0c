#include "vision/branch_matching.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace withe {

namespace {

constexpr double kForbidden = std::numeric_limits<double>::infinity();

/// Two cables that touch side by side are rarer than two that cross. Their energy is therefore multiplied by this
/// weight. If the mask at their waist is hardly wider than one cable, they would have to lie on each other and separate
/// again to the same side. This is even rarer.
double touching_weight(double widening) {
  constexpr double side_by_side = 1.6, on_each_other = 1.2, weight = 1.5, heaviest = 6;
  const double t = std::clamp((side_by_side - widening) / (side_by_side - on_each_other), 0.0, 1.0);
  return weight + t * (heaviest - weight);
}

double signed_angle(const Vector2& from, const Vector2& to) {
  return std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
}

/// Energy of a pair. It is infinite if the turn exceeds 90 degrees within a width, as of two tips that touch. A pair
/// that closes one edge to a ring costs a single end more: a cable with a curl looks like one that a ring touches, and
/// rings are rare.
double pair_energy(const Branch& a, const Branch& b) {
  const Vector2 chord = b.point - a.point;
  const double width = a.half_width + b.half_width;
  const double turn = std::abs(signed_angle(a.tangent, -b.tangent));
  if (turn > 0.5 * std::numbers::pi && chord.norm() < 1.5 * width) return kForbidden;
  const bool ring = a.edge >= 0 && a.edge == b.edge;
  return bending_energy(a, b) + (ring ? single_energy(width) : 0);
}

/// Finds the best and the second best way to pair branches. If their number is odd, one branch stays single. Further
/// single branches cost as much energy as a sharp turn.
class PairSearch {
 public:
  PairSearch(const std::vector<Branch>& branches, double waist)
      : branches_(branches), count_(static_cast<int>(branches.size())) {
    energies_.assign(static_cast<std::size_t>(count_ * count_), kForbidden);
    double width = 0;
    for (const Branch& branch : branches) width = std::max(width, 2 * branch.half_width);
    touching_ = touching_weight(width > 0 ? 2 * waist / width : 0);
    single_ = single_energy(width);
    for (int i = 0; i < count_; ++i) {
      for (int j = i + 1; j < count_; ++j) {
        const double energy = pair_energy(branches[static_cast<std::size_t>(i)], branches[static_cast<std::size_t>(j)]);
        energies_[static_cast<std::size_t>(i * count_ + j)] = energy;
        energies_[static_cast<std::size_t>(j * count_ + i)] = energy;
      }
    }
  }

  Matching run() {
    best_.energy = best_.second = best_.plain = best_.second_plain = kForbidden;
    used_.assign(static_cast<std::size_t>(count_), 0);
    descend(0, 0);
    return best_;
  }

 private:
  double energy(int i, int j) const { return energies_[static_cast<std::size_t>(i * count_ + j)]; }

  void descend(int first, double sum) {
    if (sum >= best_.second) return;
    while (first < count_ && used_[static_cast<std::size_t>(first)]) ++first;
    if (first == count_) {
      const double plain = sum;
      if (count_ == 4 && pairs_.size() == 2 && !interleaved()) sum *= touching_;
      if (sum < best_.energy) {
        best_ = {pairs_, sum, best_.energy, plain, std::min(best_.plain, best_.second_plain)};
      } else {
        best_.second = std::min(best_.second, sum);
        best_.second_plain = std::min(best_.second_plain, plain);
      }
      return;
    }
    used_[static_cast<std::size_t>(first)] = 1;
    for (int j = first + 1; j < count_; ++j) {
      if (used_[static_cast<std::size_t>(j)] || energy(first, j) == kForbidden) continue;
      used_[static_cast<std::size_t>(j)] = 1;
      pairs_.emplace_back(first, j);
      descend(first + 1, sum + energy(first, j));
      pairs_.pop_back();
      used_[static_cast<std::size_t>(j)] = 0;
    }
    descend(first + 1, sum + single_);
    used_[static_cast<std::size_t>(first)] = 0;
  }

  /// True if the two pairs of four branches separate each other, seen from their middle.
  bool interleaved() const {
    Vector2 middle = Vector2::Zero();
    for (const Branch& branch : branches_) middle += 0.25 * branch.point;
    const auto direction = [&](int i) {
      const Vector2 d = branches_[static_cast<std::size_t>(i)].point - middle;
      return std::atan2(d.y(), d.x());
    };
    const double start = direction(pairs_[0].first);
    const auto turn = [&](int i) {
      const double angle = direction(i) - start;
      return angle < 0 ? angle + 2 * std::numbers::pi : angle;
    };
    const double end = turn(pairs_[0].second);
    return (turn(pairs_[1].first) < end) != (turn(pairs_[1].second) < end);
  }

  const std::vector<Branch>& branches_;
  int count_;
  double single_ = 0;
  double touching_ = 1;
  std::vector<double> energies_;
  std::vector<char> used_;
  std::vector<std::pair<int, int>> pairs_;
  Matching best_;
};

/// Depth-first search for the pairs of least energy, with a lower bound for the ends that are still open.
class EndSearch {
 public:
  EndSearch(const std::vector<double>& singles, const std::vector<std::vector<std::pair<double, int>>>& partners)
      : singles_(singles), partners_(partners), partner_(singles.size(), -1), used_(singles.size(), 0) {}

  /// Adds the pairs of one group of ends to `pairs`.
  void run(const std::vector<int>& group, std::vector<std::pair<int, int>>& pairs) {
    group_ = group;
    // Each end costs at least as much as alone, or half of its cheapest pair.
    rest_.assign(group.size() + 1, 0.0);
    for (std::size_t i = group.size(); i-- > 0;) {
      double least = singles_[at(group[i])];
      if (!partners_[at(group[i])].empty()) least = std::min(least, 0.5 * partners_[at(group[i])].front().first);
      rest_[i] = rest_[i + 1] + least;
    }
    bound_.assign(singles_.size(), 0.0);
    for (std::size_t i = 0; i < group.size(); ++i) bound_[at(group[i])] = rest_[i] - rest_[i + 1];
    best_ = kForbidden;
    steps_ = 0;
    double open = rest_.front();
    descend(0, 0, open);
    for (const int a : group) {
      if (best_partner_[at(a)] > a) pairs.emplace_back(a, best_partner_[at(a)]);
    }
  }

 private:
  void descend(std::size_t next, double sum, double open) {
    constexpr int most_steps = 50'000;  // the best pairs come first, so that what is found until then is good
    if (sum + open >= best_ || (++steps_ > most_steps && best_ < kForbidden)) return;
    while (next < group_.size() && used_[at(group_[next])]) ++next;
    if (next == group_.size()) {
      best_ = sum;
      best_partner_ = partner_;
      return;
    }
    const int a = group_[next];
    used_[at(a)] = 1;
    const double without = open - bound_[at(a)];
    bool alone = false;
    const auto stay_alone = [&] {
      alone = true;
      descend(next + 1, sum + singles_[at(a)], without);
    };
    for (const auto& [energy, b] : partners_[at(a)]) {
      if (used_[at(b)]) continue;
      if (!alone && energy > singles_[at(a)] + singles_[at(b)]) stay_alone();
      used_[at(b)] = 1;
      partner_[at(a)] = b;
      partner_[at(b)] = a;
      descend(next + 1, sum + energy, without - bound_[at(b)]);
      partner_[at(a)] = partner_[at(b)] = -1;
      used_[at(b)] = 0;
    }
    if (!alone) stay_alone();
    used_[at(a)] = 0;
  }

  const std::vector<double>& singles_;
  const std::vector<std::vector<std::pair<double, int>>>& partners_;
  std::vector<int> group_;
  std::vector<double> rest_, bound_;
  std::vector<int> partner_, best_partner_;
  std::vector<char> used_;
  double best_ = kForbidden;
  int steps_ = 0;
};

}  // namespace

double single_energy(double width) { return 0.25 * std::pow(0.5 * std::numbers::pi, 2) / std::max(width, 1.0); }

std::vector<std::pair<int, int>> pair_ends(const std::vector<double>& singles, std::vector<PairCandidate> candidates) {
  constexpr std::size_t most_partners = 6;
  std::sort(candidates.begin(), candidates.end(),
            [](const PairCandidate& a, const PairCandidate& b) { return a.energy < b.energy; });
  std::vector<std::vector<std::pair<double, int>>> partners(singles.size());
  for (const PairCandidate& pair : candidates) {
    auto &of_a = partners[at(pair.a)], &of_b = partners[at(pair.b)];
    if (of_a.size() >= most_partners || of_b.size() >= most_partners) continue;
    of_a.emplace_back(pair.energy, pair.b);
    of_b.emplace_back(pair.energy, pair.a);
  }
  std::vector<std::pair<int, int>> pairs;
  std::vector<char> seen(singles.size(), 0);
  EndSearch search(singles, partners);
  for (std::size_t start = 0; start < singles.size(); ++start) {
    if (seen[start] || partners[start].empty()) continue;
    std::vector<int> group{static_cast<int>(start)};
    seen[start] = 1;
    for (std::size_t i = 0; i < group.size(); ++i) {
      for (const auto& [energy, other] : partners[at(group[i])]) {
        if (seen[at(other)]) continue;
        seen[at(other)] = 1;
        group.push_back(other);
      }
    }
    search.run(group, pairs);
  }
  return pairs;
}

Vector2 way_place(const Vector2& from, const Vector2& leaving, const Vector2& to, const Vector2& arriving, double t) {
  const double u = 1 - t, length = (to - from).norm();
  return u * u * (1 + 2 * t) * from + t * t * (1 + 2 * u) * to + length * t * u * (u * leaving - t * arriving);
}

double bending_energy(const Branch& from, const Branch& to) {
  const Vector2 chord = to.point - from.point;
  const double shortest = 0.5 * (from.half_width + to.half_width);
  const double length = chord.norm();
  if (length < 1e-9) {
    const double turn = signed_angle(from.tangent, -to.tangent);
    return 0.5 * turn * turn / std::max(shortest, 1.0);
  }
  const double a = signed_angle(from.tangent, chord);
  const double b = signed_angle(-to.tangent, chord);
  const double scale = 2 / std::max({length, shortest, 1.0});
  const double straight = scale * (a * a + a * b + b * b);
  // Curvatures along the way from one branch to the other; extrapolated over at most half a radian.
  const double most = 0.5 / length;
  const double k1 = std::clamp(from.curvature, -most, most);
  const double k2 = std::clamp(-to.curvature, -most, most);
  const double c = a - length * (k1 / 3 + k2 / 6);
  const double d = b + length * (k1 / 6 + k2 / 3);
  return 0.25 * straight + 0.75 * scale * (c * c + c * d + d * d);
}

Matching match_branches(const std::vector<Branch>& branches, double waist) {
  constexpr std::size_t most_branches = 10;  // the second best matching costs all combinations
  if (branches.size() <= most_branches) return PairSearch(branches, waist).run();
  Matching matching;
  matching.energy = matching.second = matching.plain = matching.second_plain = kForbidden;
  matching.pairs = match_ends(branches).pairs;
  return matching;
}

EndMatching match_ends(const std::vector<Branch>& branches) {
  double width = 0;
  for (const Branch& branch : branches) width = std::max(width, 2 * branch.half_width);
  const std::vector<double> singles(branches.size(), single_energy(width));
  std::vector<PairCandidate> candidates;
  for (std::size_t i = 0; i < branches.size(); ++i) {
    for (std::size_t j = i + 1; j < branches.size(); ++j) {
      const double energy = pair_energy(branches[i], branches[j]);
      if (energy < 2 * singles[i]) candidates.push_back({static_cast<int>(i), static_cast<int>(j), energy});
    }
  }
  EndMatching result;
  result.pairs = pair_ends(singles, candidates);
  const auto count = static_cast<double>(branches.size() - 2 * result.pairs.size());
  result.energy = count * single_energy(width);
  for (const auto& [a, b] : result.pairs) result.energy += pair_energy(branches[at(a)], branches[at(b)]);
  return result;
}

}  // namespace withe
