#include "vision/tracing.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "vision/branch_matching.hpp"
#include "vision/cable_ends.hpp"
#include "vision/cable_fit.hpp"
#include "vision/cable_paths.hpp"
#include "vision/crossings.hpp"
#include "vision/hidden_bridges.hpp"
#include "vision/skeleton_graph.hpp"
#include "vision/strand_classes.hpp"
#include "vision/strand_seams.hpp"
#include "vision/thinning.hpp"

namespace withe {

namespace {

/// Regions of fewer pixels are noise of single pixels: salt of a density of 5 % forms no larger ones.
constexpr std::size_t kSpeckPixels = 12;

/// Removes frays and pinholes, unless the lines are so thin that much of them would be removed too. A smooth border
/// converges at once. Bays of a ragged border become shallower by one pixel per round.
BitImage smooth(const BitImage& given) {
  const auto loses_much = [](const BitImage& before, const BitImage& after) {
    return 10 * after.count() < 8 * before.count();
  };
  BitImage mask = given;
  BitImage result = majority(mask);
  if (loses_much(mask, result)) {  // thin lines, or specks
    mask = without_specks(mask, kSpeckPixels);
    result = majority(mask);
    if (loses_much(mask, result)) return mask;
  }
  const std::size_t count = result.count();
  constexpr int most_rounds = 6;
  for (int round = 1; round < most_rounds; ++round) {
    BitImage next = majority(result);
    const bool settled = 200 * count_differences(result, next) < count;
    result = std::move(next);
    if (settled) break;
  }
  return result;
}

/// Pixels of a mask with a pixel outside it beside them.
std::size_t border_length(const BitImage& mask) { return mask.count() - erode(mask).count(); }

/// Pixels with more than half of the square of `radius` pixels around them set. Beyond the border the image continues
/// as it ends.
BitImage majority_of_square(const BitImage& mask, int radius) {
  const int height = mask.height(), width = mask.width();
  const auto row_length = static_cast<std::size_t>(width);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(height) * row_length);
  unpack(mask, bytes.data());
  std::vector<int> columns(row_length, 0);  // sums over the rows around
  const auto row = [&](int y) {
    return bytes.data() + static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * row_length;
  };
  for (int y = -radius; y <= radius; ++y) {
    for (std::size_t x = 0; x < row_length; ++x) columns[x] += row(y)[x];
  }
  BitImage result(height, width);
  const int half = (2 * radius + 1) * (2 * radius + 1) / 2;
  const auto column = [&](int x) { return columns[at(std::clamp(x, 0, width - 1))]; };
  for (int y = 0; y < height; ++y) {
    int sum = 0;
    for (int x = -radius; x <= radius; ++x) sum += column(x);
    for (int x = 0; x < width; ++x) {
      if (sum > half) result.set(x, y);
      sum += column(x + radius + 1) - column(x - radius);
    }
    for (std::size_t x = 0; x < row_length; ++x) columns[x] += row(y + radius + 1)[x] - row(y - radius)[x];
  }
  return result;
}

/// A mask whose border is displaced by waves longer than the frays that `smooth` removes, smoothed at a scale of half
/// of a width; empty if the border is not displaced so. Its ends are shorter, so it serves for the skeleton only.
std::optional<BitImage> smooth_waves(const BitImage& given, const BitImage& smoothed) {
  // Share of the border that smoothing moves. A clean mask loses 0.014, a border displaced by 1 px 0.08 or more.
  constexpr double frayed = 0.06;
  // At this scale a clean mask changes by 0.04 of its border, one with frays of 1.5 px by 0.19, and
  // one that is displaced by 1.5 px by 0.25 or more.
  constexpr double displaced = 0.22;
  constexpr double scale = 0.45;  // [widths], which a ragged border underestimates
  constexpr int rounds = 3;
  const auto border = static_cast<double>(border_length(smoothed));
  if (static_cast<double>(count_differences(given, smoothed)) < frayed * border) return std::nullopt;
  const double width = 2 * static_cast<double>(smoothed.count()) / std::max(border, 1.0);
  const BitImage cables = without_specks(smoothed, static_cast<std::size_t>(width * width));
  const int radius = std::max(1, static_cast<int>(std::lround(scale * width)));
  BitImage result = majority_of_square(cables, radius);
  if (static_cast<double>(count_differences(result, cables)) < displaced * border) return std::nullopt;
  for (int round = 1; round < rounds; ++round) result = majority_of_square(result, radius);
  return result;
}

/// True if there is a square of four pixels: lines with a width of one pixel are not cables.
bool has_width(const BitImage& mask) {
  for (int y = 1; y < mask.height(); ++y) {
    const std::uint64_t* above = mask.row(y - 1);
    const std::uint64_t* row = mask.row(y);
    for (int w = 0; w < mask.words(); ++w) {
      const std::uint64_t pair = above[w] & row[w];
      const std::uint64_t right = (pair >> 1) | ((above[w + 1] & row[w + 1]) << 63);
      if ((pair & right) != 0) return true;
    }
  }
  return false;
}

/// The half width that is exceeded along half of the length of the skeleton.
double typical_half_width(const SkeletonGraph& graph) {
  std::vector<std::pair<double, double>> entries;
  double total = 0;
  for (const SkeletonEdge& edge : graph.edges) {
    if (edge.removed) continue;
    entries.emplace_back(edge.half_width, edge.length + 1);
    total += edge.length + 1;
  }
  std::sort(entries.begin(), entries.end());
  double sum = 0;
  for (const auto& [half_width, length] : entries) {
    sum += length;
    if (2 * sum >= total) return half_width;
  }
  return 0;
}

/// Tips by half-edge, grown to the end of the mask. Lines too short to be cables are removed.
std::vector<std::vector<Vector2>> grow_tips(const BitImage& mask, SkeletonGraph& graph, const Continuations& links,
                                            double shortest) {
  std::vector<std::vector<Vector2>> ends(2 * graph.edges.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    SkeletonEdge& edge = graph.edges[e];
    if (edge.removed || links.inside[e]) continue;
    if (edge.nodes[0] < 0) {
      edge.removed = edge.length < shortest;
      continue;
    }
    bool alone = true;
    double length = edge.length;
    for (std::size_t end = 0; end < 2; ++end) {
      const std::size_t half = 2 * e + end;
      if (links.zone_of[half] >= 0) {
        alone = false;
        if (links.partner[half] < 0) ends[half] = {links.branches[half].point};
        continue;
      }
      const Branch& branch = links.branches[half];
      ends[half] = grow_end(mask, branch);
      if (ends[half].empty()) ends[half].push_back(branch.point);
      length += static_cast<double>(ends[half].size()) - branch.skip;
    }
    if (alone && length < shortest) {
      edge.removed = true;
      ends[2 * e].clear();
      ends[2 * e + 1].clear();
    }
  }
  return ends;
}

SkeletonGraph find_graph(const BitImage& mask, const TraceOptions& options) {
  SkeletonGraph graph = build_graph(thin(mask), mask, 200);
  prune_spurs(graph, options.spur_ratio);
  return graph;
}

/// Pieces of a cable that are shorter have no direction [widths].
constexpr double kShortestPiece = 2.2;

/// At a straight cut the skeleton forks to both corners, which are sqrt(2) half widths away, and ends a pixel or two
/// before them or behind the fork [half widths].
constexpr double kSpurRatioOfPieces = 2.2;

/// Shortest cable in a mask that is cut between colours [widths].
constexpr double kShortestOfColors = 6;

/// The skeleton with a single pixel, in the middle, of each region of the mask up to an area [px^2].
BitImage shrink_pieces(BitImage skeleton, const BitImage& mask, double area) {
  for_each_region(mask, [&](const std::vector<Pixel>& region) {
    if (static_cast<double>(region.size()) > area) return;
    Vector2 middle = Vector2::Zero();
    for (const Pixel p : region) middle += Vector2(p.x, p.y);
    middle /= static_cast<double>(region.size());
    Pixel nearest = region.front();
    for (const Pixel p : region) {
      skeleton.clear(p.x, p.y);
      if ((Vector2(p.x, p.y) - middle).norm() < (Vector2(nearest.x, nearest.y) - middle).norm()) nearest = p;
    }
    skeleton.set(nearest.x, nearest.y);
  });
  return skeleton;
}

struct CableEnd {
  int cable;
  bool at_end;
  HalfEdge half;
};

/// Data of lines before they are followed.
struct Found {
  const BitImage& mask;
  const TraceOptions& options;
  const SkeletonGraph& graph;
  const Continuations& links;
};

/// Outlines of cables during the fits.
struct Outlines {
  std::vector<CableOutline> cables;
  std::vector<HiddenStretch> stretches;
  std::vector<CableEnd> on_flanks;  ///< ends on the flank of another cable, which has to be known first
};

Outlines outline_cables(const Found& found, const std::vector<CablePath>& paths,
                        const std::vector<std::vector<Vector2>>& ends, double shortest, std::vector<Cable>& cables) {
  Outlines out;
  for (const CablePath& path : paths) {
    CableOutline outline(found.graph, found.links, path);
    std::vector<CableEnd> flanks;
    const int number = static_cast<int>(out.cables.size());
    if (!path.closed) {
      for (const bool at_end : {false, true}) {
        const HalfEdge half = at_end ? opposite(path.entries.back()) : path.entries.front();
        if (found.links.zone_of[static_cast<std::size_t>(half)] < 0) {
          outline.extend(at_end, ends[static_cast<std::size_t>(half)]);
        } else {
          flanks.push_back({number, at_end, half});
        }
      }
    }
    if (outline.empty() || outline.length() < shortest) continue;
    out.on_flanks.insert(out.on_flanks.end(), flanks.begin(), flanks.end());
    cables.push_back(outline.fit(found.mask, found.options, number, out.stretches));
    out.cables.push_back(std::move(outline));
  }
  return out;
}

using Joints = std::vector<std::pair<CableEnd, CableRow>>;

/// The removed end of the skeleton in which a branch continues across another cable; null if there is none. A cable
/// that ends close behind a crossing looks like a fray of the other cable.
const Spur* spur_ahead(const SkeletonGraph& graph, const Branch& branch) {
  constexpr double longest = 12;     // [half widths]
  constexpr double shortest = 0.8;   // of a spur [half widths]
  constexpr double most_turn = 0.9;  // from the tangent of the branch [rad]
  const Spur* best = nullptr;
  double in_line = std::cos(most_turn);
  for (const Spur& spur : graph.spurs) {
    const Vector2 chord = spur.tip - branch.point, end = spur.tip - spur.root;
    const double length = chord.norm();
    if (length > longest * branch.half_width || end.norm() < shortest * branch.half_width) continue;
    const double cosine = branch.tangent.dot(chord) / length;
    if (cosine < in_line || chord.dot(end) <= 0) continue;
    in_line = cosine;
    best = &spur;
  }
  return best;
}

/// Points from a branch across another cable, along a removed end of the skeleton, to the end of the mask.
std::vector<Vector2> grow_along(const BitImage& mask, const Branch& branch, const Spur& spur) {
  const Vector2 chord = spur.tip - branch.point;
  const double length = chord.norm();
  // The line of least bending without a known direction at its far end.
  const Vector2 direction = chord / length;
  const Vector2 arrival = (3 * direction - branch.tangent).normalized();
  std::vector<Vector2> points;
  for (double s = 1; s < length; s += 1)
    points.push_back(way_place(branch.point, branch.tangent, spur.tip, arrival, s / length));
  Branch behind = branch;
  behind.point = spur.tip;
  behind.tangent = arrival;
  points.push_back(spur.tip);
  const std::vector<Vector2> rest = grow_end(mask, behind);
  points.insert(points.end(), rest.begin(), rest.end());
  return points;
}

/// Points from a branch straight across another cable to the end of the mask; none if the mask hardly goes on behind
/// the far flank, at a distance along the tangent.
std::vector<Vector2> grow_across(const BitImage& mask, const Branch& branch, double far_flank) {
  const Vector2 normal(-branch.tangent.y(), branch.tangent.x());
  const double least = far_flank + branch.half_width;
  for (const double aside : {-0.3, 0.0, 0.3}) {
    const Vector2 start = branch.point + aside * branch.half_width * normal;
    if (reach_border(mask, start, branch.tangent, least + 1) < least) return {};
  }
  const Vector2 behind = branch.point + far_flank * branch.tangent;
  return grow_along(mask, branch, {behind, behind});
}

/// Extends ends to the flanks that they point at, and fits their cables again.
Joints extend_to_flanks(const Found& found, Outlines& outlines, std::vector<Cable>& cables) {
  std::vector<char> again(outlines.cables.size(), 0);
  Joints joints;
  const std::vector<HiddenStretch> before = outlines.stretches;
  for (const CableEnd& end : outlines.on_flanks) {
    const Branch& branch = found.links.branches[static_cast<std::size_t>(end.half)];
    CableOutline& outline = outlines.cables[static_cast<std::size_t>(end.cable)];
    again[static_cast<std::size_t>(end.cable)] = 1;
    if (const Spur* spur = spur_ahead(found.graph, branch)) {
      outline.extend(end.at_end, grow_along(found.mask, branch, *spur));
      continue;
    }
    const int zone = found.links.zone_of[static_cast<std::size_t>(end.half)];
    const double longest = 12 * 2 * branch.half_width;
    const RayHit hit = cast_ray(cables, before, zone, branch.point, branch.tangent, longest);
    if (hit.through.cable < 0) {
      outline.extend(end.at_end, grow_end(found.mask, branch));
      continue;
    }
    const Cable& through = cables[static_cast<std::size_t>(hit.through.cable)];
    const double half_width = 0.5 * through.widths[static_cast<std::size_t>(hit.through.row)];
    const double flank = half_width / std::max(hit.sine, 0.3), distance = hit.distance - flank;
    const std::vector<Vector2> across = grow_across(found.mask, branch, hit.distance + flank);
    if (!across.empty()) {
      outline.extend(end.at_end, across);
      continue;
    }
    std::vector<Vector2> points;
    for (double s = 1; s < distance; s += 1) points.push_back(branch.point + s * branch.tangent);
    if (distance > 0) points.push_back(branch.point + distance * branch.tangent);
    outline.extend(end.at_end, points);
    joints.emplace_back(end, hit.through);
  }
  for (std::size_t c = 0; c < outlines.cables.size(); ++c) {
    if (!again[c]) continue;
    const int number = static_cast<int>(c);
    std::erase_if(outlines.stretches, [number](const HiddenStretch& stretch) { return stretch.cable == number; });
    cables[c] = outlines.cables[c].fit(found.mask, found.options, number, outlines.stretches);
  }
  return joints;
}

void join_flanks(const Found& found, Outlines& outlines, Tracing& tracing) {
  for (const auto& [end, through] : extend_to_flanks(found, outlines, tracing.cables)) {
    const Cable& cable = tracing.cables[static_cast<std::size_t>(end.cable)];
    const int row = end.at_end ? static_cast<int>(cable.centreline.rows()) - 1 : 0;
    const Vector2 point = cable.centreline.row(row).transpose();
    // The other cable may have been fitted again too, so its row is determined again.
    const Cable& other = tracing.cables[static_cast<std::size_t>(through.cable)];
    Eigen::Index nearest = through.row;
    (other.centreline.rowwise() - point.transpose()).rowwise().squaredNorm().minCoeff(&nearest);
    if (through.cable == end.cable) nearest = std::min<Eigen::Index>(through.row, other.centreline.rows() - 1);
    if (through.cable == end.cable) tracing.doubts.push_back({point, Doubt::ends_on_itself});
    tracing.joints.push_back({point, {end.cable, row}, {through.cable, static_cast<int>(nearest)}});
  }
}

}  // namespace

Tracing trace_lines(const BitImage& mask, const TraceOptions& given, const ColorImage* image) {
  TraceOptions options = given;
  Tracing tracing;
  Stopwatch watch(tracing.timings);
  if (!has_width(mask)) return tracing;
  BitImage smoothed = smooth(mask);
  // Skeletons are made of `lines`. Ends and flanks are measured in `smoothed`, which keeps the length of the cables.
  const std::optional<BitImage> waveless = smooth_waves(mask, smoothed);
  BitImage lines = waveless ? *waveless : smoothed;
  if (waveless) options.stiffness_length *= 2;
  const BitImage smooth_mask = image != nullptr ? smoothed : BitImage();
  watch.lap("smooth");
  BitImage skeleton = thin(lines);
  watch.lap("thin");
  SkeletonGraph graph = build_graph(skeleton, lines, 200);
  prune_spurs(graph, options.spur_ratio);
  watch.lap("graph");
  // A displaced border changes the width of a single cable as much as a second cable beside it would.
  if (!waveless && cut_seams(graph, options.zones, image, lines, tracing.doubts)) {
    graph = find_graph(lines, options);
    smoothed = lines;
  }
  watch.lap("strands");
  Continuations links = find_continuations(graph, options.zones, image);
  watch.lap("cross");
  int first_bridge = static_cast<int>(links.zones.size());
  std::optional<StrandClasses> classes;
  if (image != nullptr && contradicts_colors(*image, graph, links)) {
    classes.emplace(*image, graph, smooth_mask);
    if (classes->cut(lines)) {
      classes->cut(smoothed);
      const double width = 2 * typical_half_width(graph);
      skeleton = shrink_pieces(thin(lines), lines, kShortestPiece * width * width);
      graph = build_graph(skeleton, lines, 200);
      prune_spurs(graph, kSpurRatioOfPieces);
      links = find_continuations(graph, options.zones, image);
      first_bridge = static_cast<int>(links.zones.size());
      bridge_hidden(graph, smooth_mask, *image, *classes, options.zones, links);
    }
    watch.lap("colours");
  }
  tracing.doubts.insert(tracing.doubts.end(), links.doubts.begin(), links.doubts.end());

  // A shadow in the mask has a colour of its own too: a short piece that continues no other is not a cable.
  const double widths = classes ? kShortestOfColors : options.shortest_cable;
  const double shortest = std::max(widths * 2 * typical_half_width(graph), options.shortest_line);
  auto ends = grow_tips(smoothed, graph, links, shortest);
  bridge_gaps(links, ends, options.gaps);
  if (classes && classes->count() > 1) {
    for (std::size_t h = 0; h < ends.size(); ++h) {
      if (links.zone_of[h] < 0 && links.partner[h] < 0) {
        extend_beneath(smooth_mask, *classes, links.branches[h].half_width, ends[h]);
      }
    }
  }
  const std::vector<CablePath> paths = collect_paths(graph, links);
  watch.lap("paths");

  const Found found{smoothed, options, graph, links};
  Outlines outlines = outline_cables(found, paths, ends, shortest, tracing.cables);
  join_flanks(found, outlines, tracing);
  tracing.crossings = find_crossings(tracing.cables, outlines.stretches, first_bridge);
  watch.lap("fit");
  return tracing;
}

}  // namespace withe
