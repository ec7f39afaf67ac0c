#include "vision/width_runs.hpp"

#include <cmath>

#include "vision/cable_ends.hpp"

namespace withe {

namespace {

/// Mean distance from flank to flank: half widths of single pixels are too coarse to compare thin cables by.
double measure_width(const BitImage& mask, const SkeletonLine& line, int first, int last, double half_width) {
  constexpr int places = 12;
  const int step = std::max(3, (last - first) / places);
  double sum = 0;
  int count = 0;
  for (int i = first + (last - first) % step / 2; i <= last; i += step) {
    const Flanks flanks = measure_flanks(mask, line.position(i), line.normal(i), 2 * half_width + 2);
    sum += flanks.left + flanks.right;
    ++count;
  }
  return count > 0 ? sum / count : 2 * half_width;
}

void find_runs_of(int number, const SkeletonLine& line, const BitImage& mask, std::vector<WidthRun>& runs) {
  const std::size_t before = runs.size();
  int first = 0;
  double sum = 0;
  const auto finish = [&](int end) {
    const int count = end - first;
    const double half_width = count > 0 ? sum / count : 0;
    if (count < std::max(3 * half_width, 8.0)) return;
    if (runs.size() > before) {
      WidthRun& last = runs.back();
      if (std::abs(last.width - 2 * half_width) < 0.3 * half_width && first - last.last < 3 * half_width) {
        last.width = (last.width * last.length() + 2 * half_width * count) / (last.length() + count);
        last.last = end - 1;
        return;
      }
    }
    runs.push_back({number, first, end - 1, 2 * half_width});
  };
  for (int i = 0; i < line.count(); ++i) {
    const double here = line.half_width(i);
    const double mean = i > first ? sum / (i - first) : here;
    if (std::abs(here - mean) > std::max(0.2 * mean, 0.8)) {
      finish(i);
      first = i;
      sum = 0;
    }
    sum += here;
  }
  finish(line.count());
  for (std::size_t r = before; r < runs.size(); ++r) {
    runs[r].width = measure_width(mask, line, runs[r].first, runs[r].last, 0.5 * runs[r].width);
  }
}

}  // namespace

std::vector<WidthRun> find_width_runs(const SkeletonGraph& graph, const BitImage& mask) {
  std::vector<WidthRun> runs;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const SkeletonEdge& edge = graph.edges[e];
    if (!edge.removed && !edge.points.empty()) find_runs_of(static_cast<int>(e), SkeletonLine(edge), mask, runs);
  }
  return runs;
}

double narrower_cable(const std::vector<WidthRun>& runs, double width) {
  constexpr double long_run = 3, narrower = 0.75, same = 0.15, most = 0.9;
  std::vector<std::pair<double, int>> widths;
  int total = 0, narrow = 0;
  for (const WidthRun& run : runs) {
    if (run.length() < long_run * run.width) continue;
    widths.emplace_back(run.width, run.length());
    total += run.length();
    if (run.width < narrower * width) narrow += run.length();
  }
  std::sort(widths.begin(), widths.end());
  double single = 0;
  int sum = 0;
  for (const auto& [of_run, length] : widths) {
    sum += length;
    if (2 * sum >= narrow) {
      single = of_run;
      break;
    }
  }
  if (narrow == 0) return 0;
  int agree = 0;
  for (const auto& [of_run, length] : widths) {
    if (std::abs(of_run - single) < same * single || count_strands(of_run, single) > 1) agree += length;
  }
  return agree >= most * total ? single : 0;
}

int count_strands(double width, double single) {
  constexpr double tolerance = 0.12;
  const double count = std::round(width / single);
  return count >= 1 && std::abs(width - count * single) < tolerance * count * single ? static_cast<int>(count) : 0;
}

}  // namespace withe
