#pragma once
/// From a mask to cables: every cable one ordered line of points, with its widths, crossings and joints.

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "common/types.hpp"
#include "vision/bit_image.hpp"
#include "vision/cable_paths.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// One cable, end to end.
struct Cable {
  MatrixX2 centreline;         ///< x, y [px]
  std::vector<double> widths;  ///< by row [px]
  std::vector<char> hidden;    ///< by row: true in a crossing or a gap, without information from the skeleton
  bool closed = false;         ///< the first row is not repeated
};

/// A row of a cable's centreline.
struct CableRow {
  int cable = -1;
  int row = -1;
};

/// Two cables, or a cable and itself, one over the other.
struct Crossing {
  Vector2 point = Vector2::Zero();
  CableRow over;
  CableRow under;
  double confidence = 0;  ///< confidence that `over` is over, from 0 (unknown) to 1
};

/// The end of one cable on the flank of another.
struct Joint {
  Vector2 point = Vector2::Zero();
  CableRow end;
  CableRow through;
};

struct Timing {
  std::string step;
  double seconds = 0;
};

/// Books time by step.
class Stopwatch {
 public:
  explicit Stopwatch(std::vector<Timing>& timings) : timings_(&timings) {}
  /// Books the time since the last call.
  void lap(const char* step) {
    const auto now = std::chrono::steady_clock::now();
    timings_->push_back({step, std::chrono::duration<double>(now - last_).count()});
    last_ = now;
  }

 private:
  std::vector<Timing>* timings_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

struct TraceOptions {
  double spur_ratio = 1.5;      ///< ends of the skeleton shorter than this are frays [local half widths]
  double shortest_cable = 2;    ///< shorter lines are specks [widths of the cables in the image]
  double shortest_line = 16;    ///< lines shorter than this are also specks: gaps of this length are bridged [px]
  double spacing = 1.8;         ///< greatest spacing of rows [px]
  double stiffness_length = 1;  ///< bumps shorter than this are smoothed away [half widths]
  GapOptions gaps;
  ZoneOptions zones;
};

struct Tracing {
  std::vector<Cable> cables;
  std::vector<Crossing> crossings;
  std::vector<Joint> joints;
  std::vector<DoubtfulZone> doubts;
  std::vector<Timing> timings;
};

/// Finds every cable in a mask. The picture, if there is one, is used to distinguish strands that lie side by side.
Tracing trace_lines(const BitImage& mask, const TraceOptions& options, const ColorImage* image = nullptr);

}  // namespace withe
