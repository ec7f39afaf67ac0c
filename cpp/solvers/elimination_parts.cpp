#include "solvers/elimination_parts.hpp"

#include <algorithm>

namespace withe {
namespace {

// Operations below which a matrix is not divided: one thread then takes about a millisecond, and waking the others for
// each level takes a part of that.
constexpr double kMinDivided = 1e7;
// Least number of subtrees of a tree whose branches are alike. More subtrees are easier to share, but leave more
// supernodes above them.
constexpr double kSubtrees = 16.0;

}  // namespace

EliminationParts divide(const Supernodes& supernodes) {
  const int count = supernodes.count();
  std::vector<double> operations(count, 0.0);  // of the subtree of each
  std::vector<int> first(count);               // first supernode of its subtree
  double total = 0.0;
  for (int s = 0; s < count; ++s) first[s] = s;
  for (int s = 0; s < count; ++s) {
    const double own = supernodes.operations(s);
    total += own;
    operations[s] += own;
    if (const int parent = supernodes.parent[s]; parent >= 0) {
      operations[parent] += operations[s];
      first[parent] = std::min(first[parent], first[s]);
    }
  }
  EliminationParts parts;
  if (total < kMinDivided) {
    parts.subtrees.push_back({0, count});
    return parts;
  }
  const double most = total / kSubtrees;
  std::vector<int> level(count, -1);  // -1: in a subtree
  for (int s = 0; s < count; ++s) {
    const int parent = supernodes.parent[s];
    if (operations[s] <= most) {
      if (parent < 0 || operations[parent] > most) parts.subtrees.push_back({first[s], s + 1});
      continue;
    }
    level[s] = std::max(level[s], 0);
    if (parent >= 0) level[parent] = std::max(level[parent], level[s] + 1);
    parts.levels.resize(std::max(parts.levels.size(), static_cast<std::size_t>(level[s] + 1)));
    EliminationParts::Level& own = parts.levels[level[s]];
    own.supernodes.push_back(s);
    own.operations += supernodes.operations(s);
    own.entries += supernodes.entries(s);
  }
  const auto costlier = [&](int a, int b) { return supernodes.operations(a) > supernodes.operations(b); };
  for (EliminationParts::Level& own : parts.levels)
    std::stable_sort(own.supernodes.begin(), own.supernodes.end(), costlier);
  std::stable_sort(parts.subtrees.begin(), parts.subtrees.end(),
                   [&](const auto& a, const auto& b) { return operations[a.end - 1] > operations[b.end - 1]; });
  return parts;
}

}  // namespace withe
