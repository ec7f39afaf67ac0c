#include "solvers/separators.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <queue>
#include <utility>

namespace withe {
namespace {

constexpr int kCoarsest = 40;           // vertices of the graph on which separators are grown
constexpr int kSeeds = 4;               // vertices from which they are grown
constexpr int kMostPasses = 4;          // over a separator, on each graph
constexpr int kMostMovesInVain = 40;    // before a pass ends
constexpr double kGreatestShare = 0.6;  // of a part in the weight of the graph

Part opposite(Part part) { return part == Part::left ? Part::right : Part::left; }

/// A graph with pairs of vertices made one, and the coarse vertex of each.
struct Coarser {
  WeightedGraph graph;
  std::vector<int> coarse;
};

/// Pairs each vertex with the neighbour to which it has the heaviest edge, vertices of few neighbours first. Vertices
/// that are left over are paired if they have a neighbour in common, or a hub of many would stay as it is.
std::vector<int> match(const WeightedGraph& fine) {
  const int n = fine.count(), most = std::max(2, fine.total() / (kCoarsest / 3));
  std::vector<int> sorted(n), partner(n, -1), waiting(n, -1);
  std::iota(sorted.begin(), sorted.end(), 0);
  std::stable_sort(sorted.begin(), sorted.end(), [&](int a, int b) { return fine.degree(a) < fine.degree(b); });
  const auto pair = [&](int a, int b) {
    partner[a] = b;
    partner[b] = a;
  };
  const auto fit = [&](int a, int b) { return fine.weights[a] + fine.weights[b] <= most; };
  for (int v : sorted) {
    if (partner[v] >= 0) continue;
    int best = v;
    for (int e = fine.starts[v], heaviest = 0; e < fine.starts[v + 1]; ++e) {
      const int u = fine.neighbours[e], weight = fine.edge_weights[e];
      if (partner[u] >= 0 || !fit(u, v)) continue;
      if (weight < heaviest || (weight == heaviest && fine.weights[u] >= fine.weights[best])) continue;
      best = u;
      heaviest = weight;
    }
    pair(v, best);
  }
  for (int v : sorted) {
    if (partner[v] != v || fine.degree(v) == 0) continue;
    int& other = waiting[fine.neighbours[fine.starts[v]]];
    if (other < 0 || !fit(v, other)) {
      other = v;
    } else {
      pair(v, other);
      other = -1;
    }
  }
  return partner;
}

Coarser coarsen(const WeightedGraph& fine) {
  const std::vector<int> partner = match(fine);
  Coarser result;
  result.coarse.assign(fine.count(), -1);
  std::vector<int> first;  // fine vertex of each coarse one
  for (int v = 0; v < fine.count(); ++v) {
    if (result.coarse[v] >= 0) continue;
    result.coarse[v] = result.coarse[partner[v]] = static_cast<int>(first.size());
    first.push_back(v);
  }
  WeightedGraph& graph = result.graph;
  std::vector<int> place(first.size(), -1);  // of a neighbour in the list that is being written
  for (int c = 0; c < static_cast<int>(first.size()); ++c) {
    const int begin = graph.starts.back(), v = first[c], other = partner[v];
    graph.weights.push_back(fine.weights[v] + (other == v ? 0 : fine.weights[other]));
    for (int member : {v, other}) {
      for (int e = fine.starts[member]; e < fine.starts[member + 1]; ++e) {
        const int u = result.coarse[fine.neighbours[e]];
        if (u == c) continue;
        if (place[u] < begin) {
          place[u] = static_cast<int>(graph.neighbours.size());
          graph.neighbours.push_back(u);
          graph.edge_weights.push_back(0);
        }
        graph.edge_weights[place[u]] += fine.edge_weights[e];
      }
      if (other == v) break;
    }
    graph.starts.push_back(static_cast<int>(graph.neighbours.size()));
  }
  return result;
}

/// A division of a graph, which changes by moves of single vertices from the separator to a part. Their neighbours in
/// the other part join the separator.
class Division {
 public:
  Division(const WeightedGraph& graph, std::vector<Part> parts)
      : graph_(graph), parts_(std::move(parts)), total_(graph.total()) {
    for (int v = 0; v < graph.count(); ++v) weight(parts_[v]) += graph.weights[v];
  }

  /// Weight of a part that is too heavy, then the weight of the separator: unequal parts must be worth a lighter one.
  using Cost = std::pair<int, std::int64_t>;
  Cost cost() const {
    const int heavier = std::max(held_[0], held_[1]), difference = std::abs(held_[0] - held_[1]);
    return {std::max(0, heavier - most()), std::int64_t{held_[2]} * (total_ + difference)};
  }
  const std::vector<Part>& parts() const { return parts_; }

  /// Grows the left part from a vertex, until both are equal: always by the vertex that adds least to the separator.
  void grow(int seed) {
    move(seed, Part::left);
    while (held_[0] < held_[1]) {
      int best = -1, gain = 0;
      for (int v = 0; v < graph_.count(); ++v) {
        if (parts_[v] != Part::separator) continue;
        const int own = gain_of(v, Part::left);
        if (best >= 0 && own <= gain) continue;
        best = v;
        gain = own;
      }
      if (best < 0) break;
      move(best, Part::left);
    }
  }

  /// Makes the separator lighter, by passes that also go through heavier ones [Fiduccia and Mattheyses 1982].
  void refine() {
    for (int pass = 0; pass < kMostPasses; ++pass)
      if (!improve()) break;
  }

 private:
  struct Move {
    int gain, vertex;
    bool operator<(const Move& other) const { return gain != other.gain ? gain < other.gain : vertex > other.vertex; }
  };
  using Moves = std::priority_queue<Move>;

  static std::size_t index(Part part) { return static_cast<std::size_t>(part); }
  int& weight(Part part) { return held_[index(part)]; }
  int most() const { return static_cast<int>(kGreatestShare * total_); }

  /// Weight by which the separator becomes lighter if a vertex leaves it.
  int gain_of(int v, Part to) const {
    int gain = graph_.weights[v];
    for (int e = graph_.starts[v]; e < graph_.starts[v + 1]; ++e)
      if (parts_[graph_.neighbours[e]] == opposite(to)) gain -= graph_.weights[graph_.neighbours[e]];
    return gain;
  }

  void assign(int v, Part part) {
    weight(parts_[v]) -= graph_.weights[v];
    weight(part) += graph_.weights[v];
    parts_[v] = part;
  }
  void put(int v, Part part) {
    changes_.emplace_back(v, parts_[v]);
    assign(v, part);
  }
  void move(int v, Part to) {
    put(v, to);
    for (int e = graph_.starts[v]; e < graph_.starts[v + 1]; ++e)
      if (parts_[graph_.neighbours[e]] == opposite(to)) put(graph_.neighbours[e], Part::separator);
  }
  void undo(std::size_t until) {
    for (; changes_.size() > until; changes_.pop_back()) assign(changes_.back().first, changes_.back().second);
  }

  /// Offers the move of a vertex of the separator into a part, unless it has left the separator once.
  void offer(int v, Part to, int gain) {
    gains_[index(to)][v] = gain;
    if (!moved_[v]) moves_[index(to)].push({gain, v});
  }
  /// The best move into a part; its vertex is -1 if there is none. Offers that have changed are left out.
  Move best_move(Part to) {
    Moves& moves = moves_[index(to)];
    for (; !moves.empty(); moves.pop()) {
      const Move& top = moves.top();
      const bool current = parts_[top.vertex] == Part::separator && !moved_[top.vertex];
      if (current && top.gain == gains_[index(to)][top.vertex]) return top;
    }
    return {0, -1};
  }
  /// Adds to the gain of moving the neighbours of v into a part.
  void change_gains_around(int v, Part to, int change) {
    for (int e = graph_.starts[v]; e < graph_.starts[v + 1]; ++e) {
      const int u = graph_.neighbours[e];
      if (parts_[u] == Part::separator) offer(u, to, gains_[index(to)][u] + change);
    }
  }
  /// Updates gains after the move whose changes begin at `first`.
  void change_gains(std::size_t first, Part to) {
    const int leaving = changes_[first].first;
    change_gains_around(leaving, opposite(to), -graph_.weights[leaving]);
    for (std::size_t k = first + 1; k < changes_.size(); ++k)
      change_gains_around(changes_[k].first, to, graph_.weights[changes_[k].first]);
    for (std::size_t k = first + 1; k < changes_.size(); ++k)
      for (Part part : {Part::left, Part::right}) offer(changes_[k].first, part, gain_of(changes_[k].first, part));
  }

  /// One pass: each vertex leaves the separator at most once. Ends at the best division on its way.
  bool improve() {
    changes_.clear();
    moved_.assign(graph_.count(), 0);
    for (Part to : {Part::left, Part::right}) {
      moves_[index(to)] = {};
      gains_[index(to)].assign(graph_.count(), 0);
      for (int v = 0; v < graph_.count(); ++v)
        if (parts_[v] == Part::separator) offer(v, to, gain_of(v, to));
    }
    const Cost before = cost();
    Cost best = before;
    std::size_t kept = 0;
    for (int in_vain = 0; in_vain < kMostMovesInVain; ++in_vain) {
      Part to = held_[0] <= held_[1] ? Part::left : Part::right;
      Move next = best_move(to);
      const Move other = best_move(opposite(to));
      const bool fits = other.vertex >= 0 && weight(opposite(to)) + graph_.weights[other.vertex] <= most();
      if (fits && (next.vertex < 0 || other.gain > next.gain)) {
        next = other;
        to = opposite(to);
      }
      if (next.vertex < 0) break;
      const std::size_t first = changes_.size();
      move(next.vertex, to);
      moved_[next.vertex] = 1;
      change_gains(first, to);
      if (cost() >= best) continue;
      best = cost();
      kept = changes_.size();
      in_vain = -1;
    }
    undo(kept);
    return best < before;
  }

  const WeightedGraph& graph_;
  std::vector<Part> parts_;
  int total_;
  int held_[3] = {0, 0, 0};
  Moves moves_[2];                             // into each part
  std::vector<int> gains_[2];                  // of vertices of the separator
  std::vector<char> moved_;                    // during a pass
  std::vector<std::pair<int, Part>> changes_;  // vertex, and its part before
};

std::vector<Part> grow_separator(const WeightedGraph& graph) {
  const std::vector<Part> start(graph.count(), Part::right);
  std::vector<Part> best;
  Division::Cost cost;
  const int seeds = std::min(kSeeds, graph.count());
  for (int k = 0; k < seeds; ++k) {
    Division division(graph, start);
    division.grow(k * (graph.count() - 1) / std::max(1, seeds - 1));
    division.refine();
    if (!best.empty() && division.cost() >= cost) continue;
    best = division.parts();
    cost = division.cost();
  }
  return best;
}

}  // namespace

int WeightedGraph::total() const { return std::accumulate(weights.begin(), weights.end(), 0); }

std::vector<Part> find_separator(const WeightedGraph& graph) {
  std::vector<Coarser> levels;
  const auto at = [&](std::size_t level) -> const WeightedGraph& {
    return level == 0 ? graph : levels[level - 1].graph;
  };
  while (at(levels.size()).count() > kCoarsest) {
    Coarser next = coarsen(at(levels.size()));
    if (next.graph.count() > 0.95 * at(levels.size()).count()) break;
    levels.push_back(std::move(next));
  }
  std::vector<Part> parts = grow_separator(at(levels.size()));
  for (std::size_t level = levels.size(); level-- > 0;) {
    const std::vector<int>& coarse = levels[level].coarse;
    std::vector<Part> finer(coarse.size());
    for (std::size_t v = 0; v < coarse.size(); ++v) finer[v] = parts[coarse[v]];
    Division division(at(level), std::move(finer));
    division.refine();
    parts = division.parts();
  }
  return parts;
}

}  // namespace withe
