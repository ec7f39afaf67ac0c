#pragma once
/// Many worlds side by side: one call steps all of them, over threads, and reads them out into one array.

#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/worker_pool.hpp"
#include "world/world.hpp"

namespace withe {

/// Read-outs of every lane, one number after the other.
enum class LaneReadout { time, positions, velocities, directors, curvatures, twists, tensions, spins };

/// Worlds of one shape, which others own and may use between calls. A lane goes on exactly as it would alone, whatever
/// the number of workers: it shares nothing with the others.
///
/// A lane whose step does not converge has failed: it stays in its last accepted state and is passed over until
/// `forgive` or `replace`, while the others go on.
class Batch {
 public:
  /// Throws std::invalid_argument where there is none, one is there twice, or rods, nodes, the number of obstacles or
  /// the time step of one differ from those of the first.
  Batch(std::vector<World*> lanes, int workers);

  int size() const { return static_cast<int>(lanes_.size()); }
  int workers() const { return pool_.workers(); }
  World& lane(int i) const { return *lanes_.at(at(i)); }

  /// Lanes by their numbers, each at most once. `check` is called in the calling thread at least every 0.1 s or so;
  /// what it throws ends the call within one Newton iteration, every lane in its last accepted state, and is thrown
  /// on. So is what a callback of a lane threw.
  void step(std::span<const int> lanes, int count, const std::function<void()>& check);

  const std::optional<ConvergenceFailure>& failure(int lane) const { return failures_.at(at(lane)); }
  /// True for each lane that has failed.
  void read_failed(bool* out) const;
  void forgive(int lane) { failures_.at(at(lane)).reset(); }
  /// Another world takes a lane's place.
  void replace(int lane, World& world);

  /// Numbers that a lane has of a read-out: of a rod, or, for positions and velocities, of every node (rod -1).
  std::size_t readout_size(LaneReadout what, int rod) const;
  /// Reads all lanes, one after the other.
  void read(LaneReadout what, int rod, double* out) const;

  /// Makes discrete curvatures 2 tan(phi / 2) of the lanes that are named smooth ones [1/m], with the Voronoi lengths
  /// of each lane's rod, a row a lane of the batch [m].
  void make_smooth(std::span<const int> lanes, int rod, const double* voronoi, double* curvature) const;
  /// Refuses curvatures that turn a rod by pi or more at a node; `owner` begins the message.
  void check_turns(std::span<const int> lanes, int rod, const double* voronoi, const double* curvature,
                   const std::string& owner) const;
  /// Leads natural curvatures there, a row a stencil and these for every lane that is named, one after the other.
  void set_natural_curvature(std::span<const int> lanes, int rod, const double* curvature, double over);
  void set_natural_twist(std::span<const int> lanes, int rod, const double* twist, double over);
  void set_natural_stretch(std::span<const int> lanes, int rod, const double* stretch, double over);
  /// Takes lanes back to snapshots, one for each that is named; failures there are forgiven.
  void restore(std::span<const int> lanes, std::span<const std::string* const> snapshots);

 private:
  using Clock = std::chrono::steady_clock;

  void check_shape(const World& world, int lane) const;
  void check_distinct() const;
  void check_lanes(std::span<const int> lanes) const;
  /// Does work(i) for every i below `count`, over the threads; throws what the first of them threw.
  void each(std::size_t count, const std::function<void(std::size_t)>& work, const std::function<void()>& check);
  void poll();
  void look(const std::function<void()>& check);

  std::vector<World*> lanes_;
  std::vector<std::optional<ConvergenceFailure>> failures_;
  WorkerPool pool_;
  // State of a call in progress:
  std::atomic<bool> stop_{false};
  std::vector<std::exception_ptr> thrown_;
  std::thread::id caller_;
  const std::function<void()>* check_ = nullptr;
  Clock::time_point checked_;
};

}  // namespace withe
