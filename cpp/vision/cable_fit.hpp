#pragma once
/// One cable from its edges. The skeleton inside zones and gaps is dropped, and the whole cable is fitted again.

#include <vector>

#include "vision/bending_fit.hpp"
#include "vision/cable_paths.hpp"
#include "vision/tracing.hpp"

namespace withe {

/// A stretch of a cable that passes through a zone, as rows of its centreline.
struct HiddenStretch {
  int zone = -1;
  int cable = -1;
  int first = 0;
  int last = 0;  ///< may exceed the last row of a ring, if the stretch continues across its first
};

/// Data for the fit of a cable: points in order, with their half widths; a gap before a point is marked by its zone.
class CableOutline {
 public:
  CableOutline(const SkeletonGraph& graph, const Continuations& links, const CablePath& path);

  /// Adds points before the first or behind the last, from there outwards.
  void extend(bool at_end, const std::vector<Vector2>& points);
  /// Length of the points in order [px].
  double length() const;
  bool empty() const { return points_.empty(); }
  bool closed() const { return closed_; }

  /// Fits the line of least bending. `stretches` receives the stretches inside zones. If one flank of the cable is
  /// visible inside a zone, the line keeps its distance from this flank. This is often so if two cables cross at a
  /// small angle.
  Cable fit(const BitImage& mask, const TraceOptions& options, int number, std::vector<HiddenStretch>& stretches) const;

 private:
  /// Flank of a cable: where two cables cross, one flank of each shows before the crossing and the other one behind it.
  enum class Flank { unknown, left, right };
  struct Point {
    Vector2 position;
    double half_width;
    int zone_before;               ///< kNoGap, kBridge or the zone between the point before and this one
    Flank shows = Flank::unknown;  ///< visible flank at the start of the gap before this point
  };
  static constexpr int kNoGap = -2;
  static constexpr int kBridge = -1;

  static Flank flank_that_shows(const Continuations& links, HalfEdge from, HalfEdge to);
  void add_way(const std::vector<Vector2>& way, int zone);
  std::vector<double> stations(double& total) const;
  double median_half_width() const;
  std::vector<FitSample> point_samples(const std::vector<double>& station) const;
  /// The path through a gap is longer than its chord. Measures it on a first line, and moves the points behind it.
  /// Returns the total length.
  double lengthen_gaps(const MatrixX2& line, bool closed, double total, std::vector<double>& station) const;
  /// Finds the widths of rows from their places along the cable, and the hidden rows.
  void describe_rows(const std::vector<double>& places, const std::vector<double>& station, int number, Cable& cable,
                     std::vector<HiddenStretch>& stretches) const;
  std::vector<FitSample> flank_samples(const BitImage& mask, const MatrixX2& line, double spacing,
                                       const std::vector<double>& station) const;

  std::vector<Point> points_;
  bool closed_ = false;
  int closing_zone_ = kNoGap;
  Flank closing_shows_ = Flank::unknown;
};

}  // namespace withe
