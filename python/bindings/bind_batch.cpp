#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <deque>
#include <memory>

#include "guarded_world.hpp"
#include "world/batch.hpp"

namespace withe::bindings {
namespace {

constexpr Words<LaneReadout, 8> kReadouts{{{"time", LaneReadout::time},
                                           {"positions", LaneReadout::positions},
                                           {"velocities", LaneReadout::velocities},
                                           {"directors", LaneReadout::directors},
                                           {"curvatures", LaneReadout::curvatures},
                                           {"twists", LaneReadout::twists},
                                           {"tensions", LaneReadout::tensions},
                                           {"spins", LaneReadout::spins}}};

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Lanes = py::array_t<int, py::array::c_style | py::array::forcecast>;

std::span<const int> numbers_of(const Lanes& lanes) { return {lanes.data(), static_cast<std::size_t>(lanes.size())}; }

/// A batch of worlds that Python holds too, and may use between its calls.
class GuardedBatch {
 public:
  GuardedBatch(std::vector<py::object> worlds, int workers)
      : objects_(std::move(worlds)), worlds_(guarded(objects_)), batch_(engines(worlds_), workers) {}

  int size() const { return batch_.size(); }
  int workers() const { return batch_.workers(); }

  /// Functions of Python by lane: (callback, forces), or None for each.
  void step(const Lanes& lanes, int count, const std::map<int, std::pair<py::object, py::object>>& functions) {
    const auto check = [] {
      const py::gil_scoped_acquire gil;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    };
    const py::object none = py::none();
    std::deque<GuardedWorld::InBatch> stepping;
    for (const int lane : numbers_of(lanes)) {
      const auto own = functions.find(lane);
      const bool has = own != functions.end();
      stepping.emplace_back(world(lane), has ? own->second.first : none, has ? own->second.second : none);
    }
    const std::span<const int> numbers = numbers_of(lanes);
    const py::gil_scoped_release release;
    batch_.step(numbers, count, check);
  }

  void replace(int lane, const py::object& with) {
    idle();
    auto& world = with.cast<GuardedWorld&>();
    batch_.replace(lane, world.changing());
    worlds_[at(lane)] = &world;
    objects_[at(lane)] = with;
  }

  /// Warnings of all lanes that were not yet reported.
  Warnings take_warnings() {
    Warnings out;
    for (GuardedWorld* world : worlds_) out.add(world->changing().take_warnings());
    return out;
  }

  /// Supports released since the last call: lane, support, time [s].
  std::vector<std::tuple<int, int, double>> take_left_rings() {
    std::vector<std::tuple<int, int, double>> out;
    for (int lane = 0; lane < size(); ++lane)
      for (const LeftRing& ring : world(lane).changing().take_left_rings())
        out.emplace_back(lane, ring.support, ring.time);
    return out;
  }

  void read(const std::string& what, int rod, py::array_t<double, py::array::c_style>& out) const {
    idle();
    const LaneReadout readout = from_word(kReadouts, what);
    const auto wanted = static_cast<py::ssize_t>(batch_.readout_size(readout, rod) * at(size()));
    if (out.size() != wanted) throw std::invalid_argument("out has another size than what is read");
    batch_.read(readout, rod, out.mutable_data());
  }

  /// Curvatures as `set_natural_curvature` takes them; refused where they turn a rod by pi or more.
  void set_natural_curvature(const Lanes& lanes, int rod, Numbers values, double over, const Numbers& voronoi,
                             bool discrete, const std::string& owner) {
    if (static_cast<std::size_t>(voronoi.size()) != at(size()) * batch_.readout_size(LaneReadout::twists, rod))
      throw std::invalid_argument("voronoi has another size than the batch");
    set(lanes, values, LaneReadout::curvatures, rod, [&](std::span<const int> named, const double* given) {
      if (discrete) batch_.make_smooth(named, rod, voronoi.data(), values.mutable_data());
      batch_.check_turns(named, rod, voronoi.data(), given, owner);
      batch_.set_natural_curvature(named, rod, given, over);
    });
  }

  template <class Set>
  void set(const Lanes& lanes, const Numbers& values, LaneReadout like, int rod, Set set) {
    idle();
    if (static_cast<std::size_t>(values.size()) != numbers_of(lanes).size() * batch_.readout_size(like, rod))
      throw std::invalid_argument("values have another size than the lanes");
    set(numbers_of(lanes), values.data());
  }

  void restore(const Lanes& lanes, const std::vector<py::bytes>& snapshots) {
    idle();
    const std::vector<std::string> bytes(snapshots.begin(), snapshots.end());
    std::vector<const std::string*> each;
    for (const std::string& snapshot : bytes) each.push_back(&snapshot);
    const std::span<const int> numbers = numbers_of(lanes);
    const py::gil_scoped_release release;
    batch_.restore(numbers, each);
  }

  Batch& batch() { return batch_; }

 private:
  static std::vector<GuardedWorld*> guarded(const std::vector<py::object>& objects) {
    std::vector<GuardedWorld*> out;
    for (const py::object& object : objects) out.push_back(&object.cast<GuardedWorld&>());
    return out;
  }
  static std::vector<World*> engines(const std::vector<GuardedWorld*>& worlds) {
    std::vector<World*> out;
    for (GuardedWorld* world : worlds) out.push_back(&world->changing());
    return out;
  }
  GuardedWorld& world(int lane) const { return *worlds_.at(at(lane)); }
  /// Refuses in the middle of a step of any lane.
  void idle() const {
    for (const GuardedWorld* world : worlds_) (void)world->reading();
  }

  std::vector<py::object> objects_;  ///< keep the worlds alive
  std::vector<GuardedWorld*> worlds_;
  Batch batch_;
};

py::object failure_of(GuardedBatch& self, int lane) {
  const auto& failure = self.batch().failure(lane);
  if (!failure) return py::none();
  return py::make_tuple(failure->what(), failure->time, failure->step, failure->rod, failure->node, failure->residual);
}

}  // namespace

void register_batch(py::module_& module) {
  py::class_<GuardedBatch> batch(module, "Batch", "Worlds that are stepped and read in one call.");
  batch.def(py::init<std::vector<py::object>, int>(), py::arg("worlds"), py::arg("workers"));
  batch.def_property_readonly("workers", &GuardedBatch::workers);
  batch.def("step", &GuardedBatch::step, py::arg("lanes"), py::arg("count"), py::arg("functions"),
            "Advance lanes by `count` time steps; functions of Python are called with the lock of the interpreter.");
  batch.def("replace", &GuardedBatch::replace, py::arg("lane"), py::arg("world"));
  batch.def("failure", &failure_of, py::arg("lane"), "Message and numbers, or None.");
  batch.def(
      "failed",
      [](GuardedBatch& self) {
        py::array_t<bool> out(self.size());
        self.batch().read_failed(out.mutable_data());
        return out;
      },
      "Which lanes have failed.");
  batch.def("forgive", [](GuardedBatch& self, int lane) { self.batch().forgive(lane); }, py::arg("lane"));
  batch.def("take_warnings", &GuardedBatch::take_warnings);
  batch.def("take_left_rings", &GuardedBatch::take_left_rings,
            "Lanes and supports that were released since rods have left them, and when [s].");
  batch.def("read", &GuardedBatch::read, py::arg("what"), py::arg("rod"), py::arg("out").noconvert(),
            "Fill an array with a read-out of every lane.");
  batch.def("restore", &GuardedBatch::restore, py::arg("lanes"), py::arg("snapshots"));
  batch.def("set_natural_curvature", &GuardedBatch::set_natural_curvature, py::arg("lanes"), py::arg("rod"),
            py::arg("values"), py::arg("over"), py::arg("voronoi"), py::arg("discrete"), py::arg("owner"),
            "Rows of the lanes, smooth or discrete, which are made smooth in place; refused before any is led.");
  batch.def(
      "set_natural_twist",
      [](GuardedBatch& self, const Lanes& lanes, int rod, const Numbers& values, double over) {
        self.set(lanes, values, LaneReadout::twists, rod,
                 [&](std::span<const int> l, const double* v) { self.batch().set_natural_twist(l, rod, v, over); });
      },
      py::arg("lanes"), py::arg("rod"), py::arg("values"), py::arg("over"));
  batch.def(
      "set_natural_stretch",
      [](GuardedBatch& self, const Lanes& lanes, int rod, const Numbers& values, double over) {
        self.set(lanes, values, LaneReadout::tensions, rod,
                 [&](std::span<const int> l, const double* v) { self.batch().set_natural_stretch(l, rod, v, over); });
      },
      py::arg("lanes"), py::arg("rod"), py::arg("values"), py::arg("over"));
}

}  // namespace withe::bindings
