#include "world/batch.hpp"

#include <algorithm>
#include <utility>

#include "common/check.hpp"

namespace withe {
namespace {

constexpr auto kBetweenChecks = std::chrono::milliseconds(50);

template <class Table>
void put(const Table& table, double*& out) {
  out = std::copy(table.data(), table.data() + table.size(), out);
}

void put_rows(const MatrixX3& all, const std::vector<int>& rows, double*& out) {
  for (const int row : rows) out = std::copy(all.row(row).data(), all.row(row).data() + 3, out);
}

void read_lane(const World& world, LaneReadout what, int rod, double*& out) {
  const auto nodes = [&](const MatrixX3& all) {
    rod < 0 ? put(all, out) : put_rows(all, world.description().rods[at(rod)].nodes, out);
  };
  switch (what) {
    case LaneReadout::time:
      *out++ = world.time();
      return;
    case LaneReadout::positions:
      return nodes(world.positions());
    case LaneReadout::velocities:
      return nodes(world.velocities());
    case LaneReadout::directors:
      return put(world.directors(rod), out);
    case LaneReadout::curvatures:
      return put(world.curvatures(rod), out);
    case LaneReadout::twists:
      return put(world.twists(rod), out);
    case LaneReadout::tensions:
      return put(world.tensions(rod), out);
    case LaneReadout::spins:
      return put(world.spins(rod), out);
  }
}

}  // namespace

Batch::Batch(std::vector<World*> lanes, int workers)
    : lanes_(std::move(lanes)), failures_(lanes_.size()), pool_(workers) {
  require(!lanes_.empty(), "a batch needs one simulation at least");
  for (std::size_t i = 1; i < lanes_.size(); ++i) check_shape(*lanes_[i], static_cast<int>(i));
  check_distinct();
}

void Batch::check_distinct() const {
  std::vector<World*> sorted = lanes_;
  std::sort(sorted.begin(), sorted.end());
  require(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(),
          "simulations of a batch must be different objects, got one twice: use a copy()");
}

/// Two threads must not step one lane.
void Batch::check_lanes(std::span<const int> lanes) const {
  std::vector<bool> named(lanes_.size(), false);
  for (const int i : lanes) {
    require(i >= 0 && i < size(), "no such lane: ", i);
    require(!named[at(i)], "lanes must differ, got ", i, " twice");
    named[at(i)] = true;
  }
}

void Batch::check_shape(const World& world, int lane) const {
  const SceneDescription &own = world.description(), &first = lanes_[0]->description();
  const std::string which = "simulation " + std::to_string(lane) + " of a batch must have the shape of the first: ";
  const auto same = [&](std::size_t mine, std::size_t wanted, const std::string& what) {
    require(mine == wanted, which, wanted, " ", what, " there, ", mine, " here");
  };
  same(own.rods.size(), first.rods.size(), "rods");
  for (std::size_t r = 0; r < own.rods.size(); ++r) {
    same(own.rods[r].nodes.size(), first.rods[r].nodes.size(), "nodes of rod '" + first.rods[r].name + "'");
    require(own.rods[r].name == first.rods[r].name, which, "rod '", first.rods[r].name, "' there, '", own.rods[r].name,
            "' here");
    require(own.rods[r].nodes == first.rods[r].nodes && own.rods[r].closed == first.rods[r].closed, which,
            "rod '" + first.rods[r].name + "' is joined otherwise");
  }
  same(at(static_cast<int>(own.positions.rows())), at(static_cast<int>(first.positions.rows())), "nodes");
  same(own.contact.obstacles.size(), first.contact.obstacles.size(), "obstacles");
  require(world.options().time_step == lanes_[0]->options().time_step, which, "time_step ",
          lanes_[0]->options().time_step, " s there, ", world.options().time_step, " s here");
}

void Batch::replace(int lane, World& world) {
  check_shape(world, lane);
  World*& place = lanes_.at(at(lane));
  World* const before = std::exchange(place, &world);
  try {
    check_distinct();
  } catch (...) {
    place = before;
    throw;
  }
  forgive(lane);
}

/// The calling thread's, not too often.
void Batch::look(const std::function<void()>& check) {
  const auto now = Clock::now();
  if (!check || now - checked_ < kBetweenChecks) return;
  checked_ = now;
  check();
}

/// Within a step of a lane, in any thread.
void Batch::poll() {
  if (stop_) throw Interrupted();
  if (std::this_thread::get_id() == caller_) look(*check_);
}

void Batch::each(std::size_t count, const std::function<void(std::size_t)>& work, const std::function<void()>& check) {
  stop_ = false;
  thrown_.assign(count, nullptr);
  caller_ = std::this_thread::get_id();
  check_ = &check;
  checked_ = Clock::now();
  std::exception_ptr ended;
  pool_.run(
      count,
      [&](std::size_t i) {
        if (stop_) return;
        try {
          work(i);
        } catch (...) {
          thrown_[i] = std::current_exception();
          stop_ = true;
        }
      },
      [&] {
        try {
          if (!ended) look(check);
        } catch (...) {
          ended = std::current_exception();
          stop_ = true;
        }
      });
  const auto is_cause = [](const std::exception_ptr& thrown) {
    if (!thrown) return false;
    try {
      std::rethrow_exception(thrown);
    } catch (const Interrupted&) {  // because of another
      return false;
    } catch (...) {
      return true;
    }
  };
  const std::vector<std::exception_ptr> thrown = std::exchange(thrown_, {});
  if (ended) std::rethrow_exception(ended);
  if (!stop_) return;
  const auto cause = std::find_if(thrown.begin(), thrown.end(), is_cause);
  if (cause == thrown.end()) throw Interrupted();
  std::rethrow_exception(*cause);
}

void Batch::step(std::span<const int> lanes, int count, const std::function<void()>& check) {
  require(count >= 0, "number of steps must not be negative, got ", count);
  check_lanes(lanes);
  for (const int i : lanes) lane(i).set_poll([this] { poll(); });
  struct Unset {
    const Batch& self;
    std::span<const int> lanes;
    ~Unset() {
      for (const int i : lanes) self.lane(i).set_poll({});
    }
  };
  const Unset unset{*this, lanes};
  each(
      lanes.size(),
      [&](std::size_t i) {
        std::optional<ConvergenceFailure>& failure = failures_[at(lanes[i])];
        if (failure) return;
        try {
          lane(lanes[i]).step(count);
        } catch (const ConvergenceFailure& failed) {
          failure.emplace(failed);
        }
      },
      check);
}

void Batch::read_failed(bool* out) const {
  for (const auto& failure : failures_) *out++ = failure.has_value();
}

std::size_t Batch::readout_size(LaneReadout what, int rod) const {
  const SceneDescription& scene = lanes_[0]->description();
  const bool of_nodes = what == LaneReadout::positions || what == LaneReadout::velocities;
  if (what == LaneReadout::time) return 1;
  if (of_nodes && rod < 0) return 3 * at(static_cast<int>(scene.positions.rows()));
  const RodDescription& own = scene.rods.at(at(rod));
  const std::size_t nodes = own.nodes.size(), edges = own.closed ? nodes : nodes - 1,
                    stencils = own.closed ? nodes : nodes - 2;
  switch (what) {
    case LaneReadout::directors:
      return 9 * edges;
    case LaneReadout::curvatures:
      return 2 * stencils;
    case LaneReadout::twists:
      return stencils;
    case LaneReadout::tensions:
    case LaneReadout::spins:
      return edges;
    default:
      return 3 * nodes;
  }
}

void Batch::read(LaneReadout what, int rod, double* out) const {
  for (const World* world : lanes_) read_lane(*world, what, rod, out);
}

void Batch::make_smooth(std::span<const int> lanes, int rod, const double* voronoi, double* curvature) const {
  const std::size_t stencils = readout_size(LaneReadout::twists, rod);
  for (const int i : lanes)
    for (std::size_t s = 0; s < stencils; ++s, curvature += 2)
      Eigen::Map<Vector2>{curvature} =
          smooth_curvature(Eigen::Map<const Vector2>{curvature}, voronoi[at(i) * stencils + s]);
}

void Batch::check_turns(std::span<const int> lanes, int rod, const double* voronoi, const double* curvature,
                        const std::string& owner) const {
  const auto stencils = static_cast<Eigen::Index>(readout_size(LaneReadout::twists, rod));
  for (const int i : lanes) {
    const Eigen::Map<const VectorX> own{voronoi + i * stencils, stencils};
    withe::check_turns({curvature, stencils, 2}, own, [&] { return owner; });
    curvature += 2 * stencils;
  }
}

void Batch::set_natural_curvature(std::span<const int> lanes, int rod, const double* curvature, double over) {
  const auto size = static_cast<Eigen::Index>(readout_size(LaneReadout::curvatures, rod));
  for (const int i : lanes) {
    lane(i).set_natural_curvature(rod, Eigen::Map<const MatrixX2>(curvature, size / 2, 2), over);
    curvature += size;
  }
}

void Batch::set_natural_twist(std::span<const int> lanes, int rod, const double* twist, double over) {
  const auto size = static_cast<Eigen::Index>(readout_size(LaneReadout::twists, rod));
  for (const int i : lanes) {
    lane(i).set_natural_twist(rod, Eigen::Map<const VectorX>(twist, size), over);
    twist += size;
  }
}

void Batch::set_natural_stretch(std::span<const int> lanes, int rod, const double* stretch, double over) {
  const auto size = static_cast<Eigen::Index>(readout_size(LaneReadout::tensions, rod));
  for (const int i : lanes) {
    lane(i).set_natural_stretch(rod, Eigen::Map<const VectorX>(stretch, size), over);
    stretch += size;
  }
}

void Batch::restore(std::span<const int> lanes, std::span<const std::string* const> snapshots) {
  require(lanes.size() == snapshots.size(), "as many snapshots as simulations are needed");
  check_lanes(lanes);
  each(lanes.size(),
       [&](std::size_t i) {
         lane(lanes[i]).restore(*snapshots[i]);
         forgive(lanes[i]);
       },
       {});
}

}  // namespace withe
