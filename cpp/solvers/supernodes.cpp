#include "solvers/supernodes.hpp"

#include <algorithm>
#include <utility>

#include "solvers/dissection.hpp"
#include "solvers/minimum_degree.hpp"

namespace withe {
namespace {

// Operations per unknown above which dissection is tried too. It takes as long as ten factorisations of this cost, and
// an order serves for a hundred.
constexpr double kWorthDissecting = 5e3;

std::vector<int> inverse(const std::vector<int>& order) {
  std::vector<int> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = static_cast<int>(k);
  return place;
}

/// First row below the diagonal of each column in L, or -1 [Liu 1990, sec. 3].
std::vector<int> elimination_tree(const SparsityPattern& pattern, const std::vector<int>& order) {
  const std::vector<int> place = inverse(order);
  std::vector<int> parent(pattern.size, -1), ancestor(pattern.size, -1);
  for (int k = 0; k < pattern.size; ++k) {
    for (int p = pattern.column_starts[order[k]]; p < pattern.column_starts[order[k] + 1]; ++p) {
      for (int node = place[pattern.row_indices[p]]; node >= 0 && node < k;) {
        const int next = ancestor[node];
        ancestor[node] = k;
        if (next < 0) parent[node] = k;
        node = next;
      }
    }
  }
  return parent;
}

/// Columns in an order in which every subtree is together and its root comes last: new -> old.
std::vector<int> postorder(const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  std::vector<int> first_child(n, -1), sibling(n, -1), result, open;
  for (int k = n - 1; k >= 0; --k) {
    if (parent[k] < 0) continue;
    sibling[k] = first_child[parent[k]];
    first_child[parent[k]] = k;
  }
  for (int root = 0; root < n; ++root) {
    if (parent[root] >= 0) continue;
    open.push_back(root);
    while (!open.empty()) {
      const int node = open.back(), child = first_child[node];
      if (child >= 0) {
        first_child[node] = sibling[child];
        open.push_back(child);
      } else {
        result.push_back(node);
        open.pop_back();
      }
    }
  }
  return result;
}

/// Entries of each column of L, its diagonal included [Liu 1990, sec. 5].
std::vector<int> column_counts(const SparsityPattern& pattern, const std::vector<int>& order,
                               const std::vector<int>& parent) {
  const std::vector<int> place = inverse(order);
  std::vector<int> counts(pattern.size, 1), visitor(pattern.size, -1);
  for (int k = 0; k < pattern.size; ++k) {
    visitor[k] = k;
    for (int p = pattern.column_starts[order[k]]; p < pattern.column_starts[order[k] + 1]; ++p) {
      const int column = place[pattern.row_indices[p]];
      if (column >= k) continue;
      for (int node = column; visitor[node] != k; node = parent[node]) {
        visitor[node] = k;
        ++counts[node];
      }
    }
  }
  return counts;
}

/// An order of elimination, and what it leads to.
struct Elimination {
  std::vector<int> order, parent, counts;

  /// Takes an order, and sorts it so that subtrees are together, which changes nothing of L.
  Elimination(const SparsityPattern& pattern, const std::vector<int>& given) {
    for (int k : postorder(elimination_tree(pattern, given))) order.push_back(given[k]);
    parent = elimination_tree(pattern, order);
    counts = column_counts(pattern, order, parent);
  }

  /// Additions and multiplications for L of a symmetric matrix.
  double operations() const {
    double sum = 0.0;
    for (int count : counts) sum += static_cast<double>(count) * count;
    return sum;
  }
};

/// Columns that become one supernode: number of stored entries, and number of entries that are not zero.
struct Group {
  int first, columns, rest;
  double entries;

  double stored() const { return columns * (0.5 * (columns + 1.0) + rest); }
};

/// True if merging a group with a child is worth the zeros that it adds.
bool worth_merging(const Group& merged) {
  const double zeros = 1.0 - merged.entries / merged.stored();
  return zeros < (merged.columns <= 8 ? 0.3 : merged.columns <= 16 ? 0.2 : 0.1);
}

/// Groups columns from the leaves up. A column joins the next one if both have the same rows. A group joins its parent
/// if this adds few zeros.
std::vector<Group> group_columns(const std::vector<int>& parent, const std::vector<int>& counts) {
  std::vector<Group> groups;
  for (int column = 0; column < static_cast<int>(parent.size()); ++column) {
    groups.push_back({column, 1, counts[column] - 1, static_cast<double>(counts[column])});
    while (groups.size() > 1) {
      const Group &child = groups[groups.size() - 2], &own = groups.back();
      const int above = parent[own.first - 1];  // parent of the last column of the child
      if (above < 0 || above > column) break;   // it belongs to a later group
      const Group merged{child.first, child.columns + own.columns, own.rest, child.entries + own.entries};
      const bool same_rows = own.columns == 1 && child.rest == own.rest + 1;
      if (!same_rows && !worth_merging(merged)) break;
      groups.pop_back();
      groups.back() = merged;
    }
  }
  return groups;
}

/// Adds the rows of each group below its own columns: rows of the matrix, and remaining rows of its children.
void add_groups(const SparsityPattern& pattern, const std::vector<Group>& groups, Supernodes& result) {
  const std::vector<int> place = inverse(result.order);
  std::vector<int> group_of(pattern.size), visitor(pattern.size, -1), rows;
  for (std::size_t g = 0; g < groups.size(); ++g)
    std::fill_n(group_of.begin() + groups[g].first, groups[g].columns, static_cast<int>(g));
  std::vector<std::vector<int>> children(groups.size());  // as supernodes
  result.column_starts.push_back(0);
  result.row_starts.push_back(0);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const int end = groups[g].first + groups[g].columns;
    rows.clear();
    const auto add = [&](int row) {
      if (row < end || visitor[row] == end) return;
      visitor[row] = end;
      rows.push_back(row);
    };
    for (int column = groups[g].first; column < end; ++column) {
      const int old = result.order[column];
      for (int p = pattern.column_starts[old]; p < pattern.column_starts[old + 1]; ++p)
        add(place[pattern.row_indices[p]]);
    }
    for (int child : children[g]) {
      for (int r = result.row_starts[child]; r < result.row_starts[child + 1]; ++r) add(result.rows[r]);
      result.parent[child] = result.count();
    }
    std::sort(rows.begin(), rows.end());
    result.column_starts.push_back(end);
    result.rows.insert(result.rows.end(), rows.begin(), rows.end());
    result.row_starts.push_back(static_cast<int>(result.rows.size()));
    result.parent.push_back(-1);
    if (!rows.empty()) children[group_of[rows[0]]].push_back(result.count() - 1);
  }
}

}  // namespace

double Supernodes::entries(int s) const { return columns(s) * (0.5 * (columns(s) + 1.0) + rest(s)); }

double Supernodes::entries() const {
  double sum = 0.0;
  for (int s = 0; s < count(); ++s) sum += entries(s);
  return sum;
}

double Supernodes::operations(int s) const {
  double sum = 0.0;
  for (double length = rest(s) + 1.0; length <= rest(s) + columns(s); ++length) sum += length * length;
  return sum;
}

double Supernodes::operations() const {
  double sum = 0.0;
  for (int s = 0; s < count(); ++s) sum += operations(s);
  return sum;
}

Supernodes find_supernodes(const SparsityPattern& pattern) {
  Elimination best(pattern, minimum_degree_order(pattern));
  if (best.operations() > kWorthDissecting * pattern.size) {
    Elimination other(pattern, dissection_order(pattern));
    if (other.operations() < best.operations()) best = std::move(other);
  }
  Supernodes result;
  result.order = std::move(best.order);
  add_groups(pattern, group_columns(best.parent, best.counts), result);
  return result;
}

}  // namespace withe
