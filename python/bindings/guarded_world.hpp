#pragma once
/// A World that Python can hold. It releases the GIL while it steps, and notices Ctrl-C. It refuses a call that would
/// disturb a running step, from another thread or from a callback.

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "bindings.hpp"
#include "world/world.hpp"

namespace withe::bindings {

/// Every member function is called with the GIL held, so plain flags are safe.
class GuardedWorld {
 public:
  GuardedWorld(const SceneDescription& description, const Options& options) : world_(description, options) {}
  explicit GuardedWorld(const GuardedWorld& other) : world_(other.reading()) {}

  /// For read-outs: allowed between steps, and in callbacks.
  const World& reading() const {
    refuse(stepping_ && !in_own_callback());
    return world_;
  }
  /// For the calls that a callback may make: setting loads and prescribed motion.
  World& steering() {
    refuse(stepping_ && !in_own_callback());
    return world_;
  }
  /// For all other uses, which are allowed only between steps.
  World& changing() {
    refuse(stepping_);
    return world_;
  }
  /// Runs `advance(world)` without the GIL. `callback(force_time, end_time)`, or None, is called before
  /// every inner step, and `forces(time, positions, velocities, derivatives)`, or None, for its custom forces. It
  /// returns forces, moments, derivatives by positions and by velocities, or None for each. Signals are checked every
  /// 50 ms between inner steps, where their handlers may read the world. Within a long step they are checked every 100
  /// ms, where handlers may not read it.
  template <class Advance>
  auto run(Advance advance, const py::object& callback, const py::object& forces) {
    refuse(stepping_);
    Stepping stepping(*this);
    auto polled = Clock::now();
    const auto check_signals = [&] {
      polled = Clock::now();
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    };
    world_.set_step_callback(
        [&](World&, double force_time, double end_time) {
          const bool poll = Clock::now() - polled >= std::chrono::milliseconds(50);
          if (!poll && callback.is_none()) return;
          const py::gil_scoped_acquire gil;
          const InCallback mark(*this);
          if (poll) check_signals();
          if (!callback.is_none()) callback(force_time, end_time);
        },
        !callback.is_none());
    if (!forces.is_none()) ask(forces);
    world_.set_poll([&] {
      if (Clock::now() - polled < std::chrono::milliseconds(100)) return;
      const py::gil_scoped_acquire gil;
      check_signals();
    });
    const py::gil_scoped_release release;
    return advance(world_);
  }

  /// While this object exists, a batch steps the world like `run`, but without checking signals.
  class InBatch;

 private:
  using Clock = std::chrono::steady_clock;

  void ask(const py::object& forces) {
    world_.set_force_function(
        [this, &forces](double time, const MatrixX3& positions, const MatrixX3& velocities, bool derivatives) {
          const py::gil_scoped_acquire gil;
          const InCallback mark(*this);
          return custom_forces(forces(time, positions, velocities, derivatives));
        });
  }
  static CustomForces custom_forces(const py::tuple& found) {
    CustomForces out;
    out.forces = found[0].cast<MatrixX3>();
    if (!found[1].is_none()) out.moments = found[1].cast<MatrixX3>();
    if (!found[2].is_none()) out.by_position = found[2].cast<SparseMatrix>();
    if (!found[3].is_none()) out.by_velocity = found[3].cast<SparseMatrix>();
    return out;
  }

  struct Stepping {
    explicit Stepping(GuardedWorld& owner) : self(owner) { self.stepping_ = true; }
    ~Stepping() {
      self.world_.set_step_callback({});
      self.world_.set_force_function({});
      self.world_.set_poll({});
      self.stepping_ = false;
    }
    GuardedWorld& self;
  };
  struct InCallback {
    explicit InCallback(GuardedWorld& owner) : self(owner) { self.callback_thread_ = PyThread_get_thread_ident(); }
    ~InCallback() { self.callback_thread_.reset(); }
    GuardedWorld& self;
  };

  bool in_own_callback() const { return callback_thread_ == PyThread_get_thread_ident(); }
  static void refuse(bool busy) {
    if (busy)
      throw std::runtime_error(
          "the simulation is in the middle of a step: a callback may read it and no more, and other threads must wait");
  }

  World world_;
  bool stepping_ = false;
  std::optional<unsigned long> callback_thread_;
};

class GuardedWorld::InBatch {
 public:
  /// The functions of Python must outlive this.
  InBatch(GuardedWorld& world, const py::object& callback, const py::object& forces) : stepping_(begun(world)) {
    if (!callback.is_none())
      world.world_.set_step_callback([&world, &callback](World&, double force_time, double end_time) {
        const py::gil_scoped_acquire gil;
        const InCallback mark(world);
        callback(force_time, end_time);
      });
    if (!forces.is_none()) world.ask(forces);
  }

 private:
  static GuardedWorld& begun(GuardedWorld& world) {
    refuse(world.stepping_);
    return world;
  }
  Stepping stepping_;
};

}  // namespace withe::bindings
