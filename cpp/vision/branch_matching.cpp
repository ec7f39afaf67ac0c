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

/// Energy of a pair. It is infinite if the turn exceeds 90 degrees within a width, as of two tips that touch.
double pair_energy(const Branch& a, const Branch& b) {
  const Vector2 chord = b.point - a.point;
  const double width = a.half_width + b.half_width;
  const double turn = std::abs(signed_angle(a.tangent, -b.tangent));
  if (turn > 0.5 * std::numbers::pi && chord.norm() < 1.5 * width) return kForbidden;
  return bending_energy(a, b);
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
    // Half of the energy of a turn of 90 degrees within a width.
    single_ = 0.25 * std::pow(0.5 * std::numbers::pi, 2) / std::max(width, 1.0);
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
    if (count_ > 10) {
      run_greedy();
    } else {
      used_.assign(static_cast<std::size_t>(count_), 0);
      descend(0, 0);
    }
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

  void run_greedy() {
    std::vector<std::pair<double, std::pair<int, int>>> candidates;
    for (int i = 0; i < count_; ++i) {
      for (int j = i + 1; j < count_; ++j) {
        if (energy(i, j) < 2 * single_) candidates.push_back({energy(i, j), {i, j}});
      }
    }
    std::sort(candidates.begin(), candidates.end());
    std::vector<char> used(static_cast<std::size_t>(count_), 0);
    for (const auto& [energy, pair] : candidates) {
      char& a = used[static_cast<std::size_t>(pair.first)];
      char& b = used[static_cast<std::size_t>(pair.second)];
      if (a || b) continue;
      a = b = 1;
      best_.pairs.push_back(pair);
    }
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

}  // namespace

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

Matching match_branches(const std::vector<Branch>& branches, double waist) { return PairSearch(branches, waist).run(); }

}  // namespace withe
