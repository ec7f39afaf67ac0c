#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <memory>

#include "guarded_world.hpp"

namespace withe::bindings {
namespace {

void register_gradients(py::module_& module) {
  py::class_<ParameterGradient> parameters(module, "ParameterGradient",
                                           "Derivatives of a scalar by the numbers that act.");
  for (const ParameterInfo& info : parameter_index())
    if (info.number)
      parameters.def_property_readonly(
          std::string(info.name).c_str(),
          [number = info.number](const ParameterGradient& g) -> VectorX { return g.*number; });
  parameters.def_readonly("stretch_stiffness", &ParameterGradient::edge_stretch)
      .def_readonly("bend_stiffness", &ParameterGradient::edge_bend)
      .def_readonly("twist_stiffness", &ParameterGradient::edge_twist)
      .def_readonly("line_density", &ParameterGradient::edge_density)
      .def_readonly("rotary_inertia", &ParameterGradient::edge_rotary)
      .def_readonly("viscous_time", &ParameterGradient::edge_viscous_time)
      .def_readonly("drag", &ParameterGradient::edge_drag)
      .def_readonly("added_mass", &ParameterGradient::added_mass)
      .def_readonly("hand_stiffness", &ParameterGradient::hand_stiffness)
      .def_readonly("hand_limit", &ParameterGradient::hand_limit)
      .def_readonly("gravity", &ParameterGradient::gravity)
      .def_readonly("natural_curvature", &ParameterGradient::natural_curvature)
      .def_readonly("natural_twist", &ParameterGradient::natural_twist)
      .def_readonly("natural_stretch", &ParameterGradient::natural_stretch)
      .def_readonly("loads", &ParameterGradient::loads)
      .def_readonly("fluid_viscosity", &ParameterGradient::fluid_viscosity)
      .def_readonly("friction", &ParameterGradient::friction)
      .def_readonly("slip_tolerance", &ParameterGradient::slip_tolerance)
      .def_readonly("obstacle_friction", &ParameterGradient::obstacle_friction)
      .def_readonly("pair_friction", &ParameterGradient::pair_friction)
      .def_readonly("obstacle_rolling", &ParameterGradient::obstacle_rolling)
      .def_readonly("rest_length", &ParameterGradient::rest_length)
      .def_readonly("edge_turn", &ParameterGradient::edge_turn)
      .def_readonly("drawn_curvature", &ParameterGradient::drawn_curvature)
      .def_readonly("drawn_twist", &ParameterGradient::drawn_twist);
  py::class_<EquilibriumGradient>(module, "EquilibriumGradient", "Derivatives of a scalar of an equilibrium.")
      .def_readonly("parameters", &EquilibriumGradient::parameters)
      .def_property_readonly("support_positions", [](const EquilibriumGradient& g) { return g.poses.positions; })
      .def_property_readonly("support_rotations", [](const EquilibriumGradient& g) { return g.poses.rotations; })
      .def_property_readonly("obstacle_positions", [](const EquilibriumGradient& g) { return g.poses.obstacles; })
      .def_property_readonly("drawn_nodes", [](const EquilibriumGradient& g) { return g.drawn.nodes; })
      .def_property_readonly("edge_turn", [](const EquilibriumGradient& g) { return g.drawn.edge_turn; });
  py::class_<PoseAdjoint>(module, "PoseAdjoint", "Derivatives of a scalar by poses of supports and obstacles.")
      .def_readonly("positions", &PoseAdjoint::positions)
      .def_readonly("rotations", &PoseAdjoint::rotations)
      .def_readonly("obstacles", &PoseAdjoint::obstacles);
  py::class_<Reached>(module, "Reached", "How far what moves has come, from 0 to 1; empty: all is there.")
      .def_readonly("supports", &Reached::supports)
      .def_readonly("obstacles", &Reached::obstacles);
  py::class_<InitialGradient>(module, "InitialGradient", "Derivatives of a scalar of a run by the state at its start.")
      .def_readonly("positions", &InitialGradient::positions)
      .def_readonly("velocities", &InitialGradient::velocities)
      .def_readonly("poses", &InitialGradient::poses)
      .def_property_readonly("drawn_nodes", [](const InitialGradient& g) { return g.drawn.nodes; })
      .def_property_readonly("edge_turn", [](const InitialGradient& g) { return g.drawn.edge_turn; });
  py::class_<RunJacobian>(module, "RunJacobian", "Derivatives of the state that a run leads to.")
      .def_readonly("state", &RunJacobian::state)
      .def_readonly("rows", &RunJacobian::rows);
  py::class_<ReadoutAdjoint>(module, "ReadoutAdjoint", "Derivatives of a scalar by what is read out of a state.")
      .def(py::init<>())
      .def_readwrite("positions", &ReadoutAdjoint::positions)
      .def_readwrite("velocities", &ReadoutAdjoint::velocities)
      .def_readwrite("directors", &ReadoutAdjoint::directors)
      .def_readwrite("curvatures", &ReadoutAdjoint::curvatures)
      .def_readwrite("twists", &ReadoutAdjoint::twists)
      .def_readwrite("tensions", &ReadoutAdjoint::tensions)
      .def_readwrite("spins", &ReadoutAdjoint::spins)
      .def_property(
          "reaction_forces", [](const ReadoutAdjoint& self) { return self.reactions.forces; },
          [](ReadoutAdjoint& self, const MatrixX3& value) { self.reactions.forces = value; })
      .def_property(
          "reaction_moments", [](const ReadoutAdjoint& self) { return self.reactions.moments; },
          [](ReadoutAdjoint& self, const MatrixX3& value) { self.reactions.moments = value; });
  py::class_<MomentAdjoint>(module, "MomentAdjoint", "What a scalar depends on after so many steps of a run.")
      .def(py::init<long, ReadoutAdjoint>(), py::arg("steps"), py::arg("by"));
  py::class_<Tape, std::shared_ptr<Tape>>(module, "Tape", "A run as the adjoint method needs it.")
      .def_property_readonly("count", &Tape::count, "Steps taken.")
      .def("divide", &Tape::divide, "What acts from here on is told apart.")
      .def(
          "gradient",
          [](const Tape& self, const std::vector<MomentAdjoint>& moments, const ParameterVisitor& visit,
             const std::optional<PoseVisitor>& visit_poses) {
            return self.gradient(moments, visit, visit_poses.value_or(PoseVisitor()));
          },
          py::arg("moments"), py::arg("visit"), py::arg("visit_poses"), py::call_guard<py::gil_scoped_release>())
      .def("jacobian", &Tape::jacobian, py::call_guard<py::gil_scoped_release>());
}

void register_results(py::module_& module) {
  py::class_<RodState>(module, "RodState", "What a rod is to be like; what is empty stays as it is.")
      .def(py::init<>())
      .def_readwrite("rod", &RodState::rod)
      .def_readwrite("positions", &RodState::positions)
      .def_readwrite("directors", &RodState::directors)
      .def_readwrite("twists", &RodState::twists)
      .def_readwrite("velocities", &RodState::velocities)
      .def_readwrite("spins", &RodState::spins);
  const auto warning = [](Warning kind) { return [kind](const Warnings& all) { return all[kind]; }; };
  py::class_<Warnings>(module, "Warnings", "What is wrong with how a scene is run; empty where nothing is.")
      .def_property_readonly("mesh", warning(Warning::mesh))
      .def_property_readonly("steps", warning(Warning::steps))
      .def_property_readonly("impact", warning(Warning::impact))
      .def_property_readonly("branch", warning(Warning::branch))
      .def_property_readonly("drift", warning(Warning::drift))
      .def_property_readonly("crossing", warning(Warning::crossing))
      .def_property_readonly("squeeze", warning(Warning::squeeze))
      .def_property_readonly("plane", warning(Warning::plane));
  py::class_<Linearisation>(module, "Linearisation", "Equations linearised about the present configuration.")
      .def_property_readonly("geometric", [](const Linearisation& self) { return self.geometric; })
      .def_property_readonly("gradients", [](const Linearisation& self) { return self.gradients; })
      .def_readonly("stiffnesses", &Linearisation::stiffnesses)
      .def_property_readonly("mass", [](const Linearisation& self) { return self.mass; })
      .def_property_readonly("displacement", [](const Linearisation& self) { return self.displacement; })
      .def_property_readonly("turn", [](const Linearisation& self) { return self.turn; })
      .def_readonly("imbalance", &Linearisation::imbalance);
  py::class_<Energy>(module, "Energy", "Energies [J].")
      .def_readonly("kinetic", &Energy::kinetic)
      .def_readonly("stretch", &Energy::stretch)
      .def_readonly("bend", &Energy::bend)
      .def_readonly("twist", &Energy::twist)
      .def_readonly("gravity", &Energy::gravity)
      .def_readonly("loads", &Energy::loads)
      .def_readonly("contact", &Energy::contact)
      .def_readonly("spring", &Energy::spring)
      .def_readonly("total", &Energy::total)
      .def_readonly("work", &Energy::work)
      .def_readonly("dissipated", &Energy::dissipated);
  py::class_<Momentum>(module, "Momentum", "Of the whole scene, angular about the origin.")
      .def_readonly("linear", &Momentum::linear)
      .def_readonly("angular", &Momentum::angular);
  py::class_<Statistics>(module, "Statistics", "What the work so far took.")
      .def_readonly("steps", &Statistics::steps)
      .def_readonly("rejected_steps", &Statistics::rejected_steps)
      .def_readonly("iterations", &Statistics::iterations)
      .def_readonly("evaluations", &Statistics::evaluations)
      .def_readonly("factorizations", &Statistics::factorizations)
      .def_readonly("largest_turn", &Statistics::largest_turn)
      .def_readonly("energy_momentum_steps", &Statistics::energy_momentum_steps)
      .def_readonly("fourth_order_steps", &Statistics::fourth_order_steps)
      .def_readonly("unresolved_amplitude", &Statistics::unresolved_amplitude)
      .def_readonly("branch_changes", &Statistics::branch_changes)
      .def_readonly("assembly_time", &Statistics::assembly_time)
      .def_readonly("solve_time", &Statistics::solve_time)
      .def_readonly("fluid_time", &Statistics::fluid_time)
      .def_readonly("total_time", &Statistics::total_time);
  py::class_<Deflection>(module, "Deflection", "How far what a hand holds has gone.")
      .def_readonly("shift", &Deflection::shift)
      .def_readonly("turn", &Deflection::turn)
      .def_readonly("slip", &Deflection::slip);
  py::class_<RingPassage>(module, "RingPassage", "How a rod passes a ring.")
      .def_readonly("passes", &RingPassage::passes)
      .def_readonly("at", &RingPassage::at)
      .def_readonly("pull", &RingPassage::pull)
      .def_readonly("press", &RingPassage::press)
      .def_readonly("feed_rate", &RingPassage::feed_rate);
  py::class_<Reaction>(module, "Reaction", "Of a support on the rod.")
      .def_readonly("force", &Reaction::force)
      .def_readonly("moment", &Reaction::moment);
  py::class_<ContactTable>(module, "ContactTable", "What touches, a row each.")
      .def_readonly("bodies", &ContactTable::bodies)
      .def_readonly("numbers", &ContactTable::numbers);
  py::class_<EquilibriumResult>(module, "EquilibriumResult", "How an equilibrium was found.")
      .def_readonly("stable", &EquilibriumResult::stable)
      .def_readonly("decided", &EquilibriumResult::decided)
      .def_readonly("branch_changed", &EquilibriumResult::branch_changed)
      .def_readonly("iterations", &EquilibriumResult::iterations)
      .def_readonly("residual", &EquilibriumResult::residual);
  py::class_<PathPoint>(module, "PathPoint", "A point of a path of equilibria.")
      .def_readonly("factor", &PathPoint::factor)
      .def_readonly("stable", &PathPoint::stable)
      .def_readonly("limit", &PathPoint::limit)
      .def_readonly("positions", &PathPoint::positions)
      .def_readonly("forces", &PathPoint::forces)
      .def_readonly("moments", &PathPoint::moments);
  py::class_<EquilibriumPath>(module, "EquilibriumPath", "A path of equilibria.")
      .def_readonly("points", &EquilibriumPath::points)
      .def_readonly("finished", &EquilibriumPath::finished)
      .def_readonly("iterations", &EquilibriumPath::iterations);
  py::class_<Plan>(module, "Plan", "What build decided.")
      .def_readonly("planar", &Plan::planar)
      .def_readonly("plane_normal", &Plan::plane_normal)
      .def_readonly("unknowns", &Plan::unknowns)
      .def_readonly("solver", &Plan::solver)
      .def_readonly("stable_step", &Plan::stable_step)
      .def_readonly("notes", &Plan::notes);
}

/// ConvergenceFailure keeps its numbers in args; Interrupted is Ctrl-C.
void register_exceptions(py::module_& module) {
  static PyObject* failure =
      PyErr_NewException((py::str(module.attr("__name__")).cast<std::string>() + ".ConvergenceFailure").c_str(),
                         PyExc_RuntimeError, nullptr);
  module.attr("ConvergenceFailure") = py::handle(failure);
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const ConvergenceFailure& e) {
      const py::tuple args = py::make_tuple(e.what(), e.time, e.step, e.rod, e.node, e.residual);
      PyErr_SetObject(failure, args.ptr());
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
}

using WorldClass = py::class_<GuardedWorld>;

void set_parameters(World& world, int owner, const py::dict& values, double over) {
  using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
  std::vector<Array> arrays;
  std::vector<ParameterSetting> settings;
  for (const auto& [name, value] : values) {
    const ParameterInfo& info = parameter_named(name.cast<std::string_view>());
    const Array& array = arrays.emplace_back(py::reinterpret_borrow<py::object>(value));
    const auto size = [&](int axis) { return static_cast<Eigen::Index>(array.shape(axis)); };
    // One row where there is one axis, unless each row is a number.
    const bool table = array.ndim() == 2, list = array.ndim() == 1 && info.columns == 1;
    const Eigen::Index rows = table || list ? size(0) : 1;
    const Eigen::Index columns = table ? size(1) : list ? 1 : static_cast<Eigen::Index>(array.size());
    settings.push_back({info.kind, owner, {array.data(), rows, columns}});
  }
  world.set(settings, over);
}

void define_steps(WorldClass& world) {
  world.def(
      "step",
      [](GuardedWorld& self, int count, const py::object& callback, const py::object& forces) {
        self.run([count](World& w) { w.step(count); }, callback, forces);
      },
      py::arg("count"), py::arg("callback"), py::arg("forces"), "Advance exactly `count` time steps.");
  world.def(
      "advance_to",
      [](GuardedWorld& self, double time, const py::object& callback, const py::object& forces) {
        self.run([time](World& w) { w.advance_to(time); }, callback, forces);
      },
      py::arg("time"), py::arg("callback"), py::arg("forces"), "Advance to a time [s].");
  world.def(
      "equilibrium",
      [](GuardedWorld& self, bool stable, const py::object& callback, const py::object& forces) {
        const Saddles saddles = stable ? Saddles::leave : Saddles::keep;
        return self.run([saddles](World& w) { return w.equilibrium(saddles); }, callback, forces);
      },
      py::arg("stable"), py::arg("callback"), py::arg("forces"), "Find the static equilibrium.");
  world.def(
      "equilibrium_path",
      [](GuardedWorld& self, const std::vector<int>& loads, double start, double end, int most_points, double turn,
         const py::object& callback, const py::object& forces) {
        const PathOptions wanted{loads, start, end, most_points, turn};
        return self.run([&wanted](World& w) { return w.equilibrium_path(wanted); }, callback, forces);
      },
      py::arg("loads"), py::arg("start"), py::arg("end"), py::arg("most_points"), py::arg("turn"), py::arg("callback"),
      py::arg("forces"), "Follow a path of equilibria through limit points.");
  world.def("check_idle", [](GuardedWorld& self) { (void)self.changing(); }, "Raises in the middle of a step.");
  world.def(
      "snapshot", [](const GuardedWorld& self) { return py::bytes(self.reading().snapshot()); }, "The whole state.");
  world.def(
      "restore", [](GuardedWorld& self, const py::bytes& state) { self.changing().restore(std::string(state)); },
      py::arg("state"), "Go back to a snapshot.");
  world.def(
      "copy", [](const GuardedWorld& self) { return std::make_unique<GuardedWorld>(self); },
      "Another world like this.");
}

void define_parameters(WorldClass& world) {
  world.def(
      "set_load", [](GuardedWorld& self, int load, const MatrixX3& values) { self.steering().set_load(load, values); },
      py::arg("load"), py::arg("values"));
  world.def(
      "add_load", [](GuardedWorld& self, const LoadDescription& load) { return self.changing().add_load(load); },
      py::arg("load"), "A load that acts from now on; its index.");
  world.def("remove_load", [](GuardedWorld& self, int load) { self.changing().remove_load(load); }, py::arg("load"));
  world.def("load", [](const GuardedWorld& self, int load) { return self.reading().load(load); }, py::arg("load"));
  world.def(
      "set_natural_curvature",
      [](GuardedWorld& self, int rod, const MatrixX2& curvature, double over) {
        self.changing().set_natural_curvature(rod, curvature, over);
      },
      py::arg("rod"), py::arg("curvature"), py::arg("over"));
  world.def(
      "set_natural_twist",
      [](GuardedWorld& self, int rod, const VectorX& twist, double over) {
        self.changing().set_natural_twist(rod, twist, over);
      },
      py::arg("rod"), py::arg("twist"), py::arg("over"));
  world.def(
      "set_natural_stretch",
      [](GuardedWorld& self, int rod, const VectorX& stretch, double over) {
        self.changing().set_natural_stretch(rod, stretch, over);
      },
      py::arg("rod"), py::arg("stretch"), py::arg("over"));
  world.def(
      "natural_curvature", [](const GuardedWorld& self, int rod) { return self.reading().natural_curvature(rod); },
      py::arg("rod"));
  world.def(
      "natural_twist", [](const GuardedWorld& self, int rod) { return self.reading().natural_twist(rod); },
      py::arg("rod"));
  world.def(
      "due",
      [](const GuardedWorld& self, const std::string& name, int owner) {
        return self.reading().due(parameter_named(name).kind, owner);
      },
      py::arg("name"), py::arg("owner"), "Return the time at which the ramp of a parameter ends [s], or None.");
  world.def(
      "set",
      [](GuardedWorld& self, int owner, const py::dict& values, double over) {
        set_parameters(self.changing(), owner, values, over);
      },
      py::arg("owner"), py::arg("values"), py::arg("over") = 0.0,
      "Set parameters of a rod, a part or the scene by their names, over a duration [s]: all, or where one is refused "
      "none.");
  world.def(
      "parameter",
      [](const GuardedWorld& self, const std::string& name, int owner) {
        return self.reading().parameter(parameter_named(name).kind, owner);
      },
      py::arg("name"), py::arg("owner") = 0,
      "Return the present values of a parameter of a rod, a part or the scene: a row an edge, stencil or node.");
  world.def(
      "set_added_mass", [](GuardedWorld& self, const VectorX& mass) { self.changing().set_added_mass(mass); },
      py::arg("mass"));
  world.def(
      "set_gravity", [](GuardedWorld& self, const Vector3& gravity) { self.changing().set_gravity(gravity); },
      py::arg("gravity"));
}

void define_supports(WorldClass& world) {
  world.def(
      "add_support",
      [](GuardedWorld& self, const SupportDescription& support) { return self.changing().add_support(support); },
      py::arg("support"));
  world.def(
      "remove_support", [](GuardedWorld& self, int support) { self.changing().remove_support(support); },
      py::arg("support"));
  world.def(
      "move_support",
      [](GuardedWorld& self, int support, const std::optional<Vector3>& position,
         const std::optional<Matrix3>& rotation, double over,
         const Vector3& roll) { self.changing().move_support(support, position, rotation, over, roll); },
      py::arg("support"), py::arg("position"), py::arg("rotation"), py::arg("over"), py::arg("roll"));
  world.def(
      "prescribe_support",
      [](GuardedWorld& self, int support, const std::optional<Vector3>& position,
         const std::optional<Matrix3>& rotation) { self.steering().prescribe_support(support, position, rotation); },
      py::arg("support"), py::arg("position"), py::arg("rotation"));
  world.def(
      "move_obstacle",
      [](GuardedWorld& self, int obstacle, const std::optional<Vector3>& position, const std::optional<Vector3>& turn,
         double over) { self.changing().move_obstacle(obstacle, position, turn, over); },
      py::arg("obstacle"), py::arg("position"), py::arg("turn"), py::arg("over"));
  world.def(
      "prescribe_obstacle",
      [](GuardedWorld& self, int obstacle, const std::optional<Vector3>& position, const std::optional<Vector3>& turn) {
        self.steering().prescribe_obstacle(obstacle, position, turn);
      },
      py::arg("obstacle"), py::arg("position"), py::arg("turn"));
  world.def(
      "obstacle_position",
      [](const GuardedWorld& self, int obstacle) { return self.reading().obstacle_position(obstacle); },
      py::arg("obstacle"));
  world.def(
      "obstacle_turn", [](const GuardedWorld& self, int obstacle) { return self.reading().obstacle_turn(obstacle); },
      py::arg("obstacle"));
  world.def(
      "own_contact",
      [](GuardedWorld& self, int first, int second) { return self.changing().own_contact(first, second); },
      py::arg("first"), py::arg("second"),
      "Return the index of the pair of two bodies that owns contact parameters, added where there is none.");
  world.def(
      "set_friction_shares",
      [](GuardedWorld& self, int pair, const VectorX& shares) { self.steering().set_friction_shares(pair, shares); },
      py::arg("pair"), py::arg("shares"));
  world.def_property_readonly("contact", [](const GuardedWorld& self) { return self.reading().description().contact; });
  world.def(
      "support_position",
      [](const GuardedWorld& self, int support) { return self.reading().support_position(support); },
      py::arg("support"));
  world.def(
      "support_rotation",
      [](const GuardedWorld& self, int support) { return self.reading().support_rotation(support); },
      py::arg("support"));
  world.def(
      "support_turn", [](const GuardedWorld& self, int support) { return self.reading().support_turn(support); },
      py::arg("support"));
  world.def(
      "reaction", [](const GuardedWorld& self, int support) { return self.reading().reaction(support); },
      py::arg("support"));
  world.def(
      "joint_reaction",
      [](const GuardedWorld& self, int joint, const std::vector<RodPass>& side) {
        return self.reading().joint_reaction(joint, side);
      },
      py::arg("joint"), py::arg("side"));
  world.def(
      "deflection", [](const GuardedWorld& self, int support) { return self.reading().deflection(support); },
      py::arg("support"));
  world.def(
      "feed", [](GuardedWorld& self, int support, double rate) { self.steering().feed(support, rate); },
      py::arg("support"), py::arg("rate"));
  world.def(
      "passage", [](const GuardedWorld& self, int support) { return self.reading().passage(support); },
      py::arg("support"));
  world.def(
      "set_ring_friction",
      [](GuardedWorld& self, int support, double friction) { self.changing().set_ring_friction(support, friction); },
      py::arg("support"), py::arg("friction"));
  world.def(
      "take_left_rings",
      [](GuardedWorld& self) {
        std::vector<std::pair<int, double>> out;
        for (const LeftRing& ring : self.steering().take_left_rings()) out.emplace_back(ring.support, ring.time);
        return out;
      },
      "Supports that were released since rods have left them, and when [s].");
}

void define_readouts(WorldClass& world) {
  world.def_property_readonly("time", [](const GuardedWorld& self) { return self.reading().time(); });
  world.def_property_readonly("plan", [](const GuardedWorld& self) { return self.reading().plan(); });
  world.def_property_readonly("frames_as_drawn",
                              [](const GuardedWorld& self) { return self.reading().frames_as_drawn(); });
  world.def_property_readonly("plane_normal", [](const GuardedWorld& self) { return self.reading().plane_normal(); });
  world.def_property_readonly("statistics", [](const GuardedWorld& self) { return self.reading().statistics(); });
  world.def("positions", [](const GuardedWorld& self) { return self.reading().positions(); });
  world.def("velocities", [](const GuardedWorld& self) { return self.reading().velocities(); });
  world.def(
      "set_velocities",
      [](GuardedWorld& self, const MatrixX3& velocities) { self.changing().set_velocities(velocities); },
      py::arg("velocities"));
  world.def(
      "set_state",
      [](GuardedWorld& self, const std::vector<RodState>& rods, std::optional<double> time) {
        self.changing().set_state(rods, time);
      },
      py::arg("rods"), py::arg("time"), "Put rods where they are told to be.");
  world.def(
      "directors", [](const GuardedWorld& self, int rod) { return self.reading().directors(rod); }, py::arg("rod"));
  world.def(
      "curvatures", [](const GuardedWorld& self, int rod) { return self.reading().curvatures(rod); }, py::arg("rod"));
  world.def("twists", [](const GuardedWorld& self, int rod) { return self.reading().twists(rod); }, py::arg("rod"));
  world.def("tensions", [](const GuardedWorld& self, int rod) { return self.reading().tensions(rod); }, py::arg("rod"));
  world.def(
      "spring_tension", [](const GuardedWorld& self, int spring) { return self.reading().spring_tension(spring); },
      py::arg("spring"));
  world.def(
      "tendon_length", [](const GuardedWorld& self, int tendon) { return self.reading().tendon_length(tendon); },
      py::arg("tendon"));
  world.def(
      "tendon_points", [](const GuardedWorld& self, int tendon) { return self.reading().tendon_points(tendon); },
      py::arg("tendon"));
  world.def(
      "joint_angle", [](const GuardedWorld& self, int joint) { return self.reading().joint_angle(joint); },
      py::arg("joint"));
  world.def(
      "joint_rate", [](const GuardedWorld& self, int joint) { return self.reading().joint_rate(joint); },
      py::arg("joint"));
  world.def(
      "joint_torque", [](const GuardedWorld& self, int joint) { return self.reading().joint_torque(joint); },
      py::arg("joint"));
  world.def(
      "body_rotation", [](const GuardedWorld& self, int body) { return self.reading().body_rotation(body); },
      py::arg("body"));
  world.def(
      "body_base", [](const GuardedWorld& self, int body) { return self.reading().body_base(body); }, py::arg("body"));
  world.def(
      "body_spin", [](const GuardedWorld& self, int body) { return self.reading().body_spin(body); }, py::arg("body"));
  world.def(
      "set_body_motion",
      [](GuardedWorld& self, int body, const Vector3& velocity, const Vector3& spin, const Vector3& held) {
        self.changing().set_body_motion(body, velocity, spin, held);
      },
      py::arg("body"), py::arg("velocity"), py::arg("spin"), py::arg("held"));
  world.def("spins", [](const GuardedWorld& self, int rod) { return self.reading().spins(rod); }, py::arg("rod"));
  world.def("take_warnings", [](GuardedWorld& self) { return self.changing().take_warnings(); });
  world.def("energy", [](const GuardedWorld& self) { return self.reading().energy(); });
  world.def(
      "rod_energy", [](const GuardedWorld& self, int rod) { return self.reading().rod_energy(rod); }, py::arg("rod"));
  world.def("momentum", [](const GuardedWorld& self) { return self.reading().momentum(); });
  world.def("contacts", [](const GuardedWorld& self) { return self.reading().contacts(); });
  world.def(
      "equilibrium_gradients",
      [](const GuardedWorld& self, const std::vector<ReadoutAdjoint>& by) {
        EquilibriumGradients found = self.reading().equilibrium_gradients(by);
        return std::make_tuple(std::move(found.scalars), std::move(found.works));
      },
      py::arg("by"));
  world.def("equilibrium_residual", [](const GuardedWorld& self) { return self.reading().equilibrium_residual(); });
  world.def(
      "support_directions",
      [](const GuardedWorld& self, int support) { return self.reading().support_directions(support); },
      py::arg("support"));
  world.def(
      "equilibrium_responses",
      [](const GuardedWorld& self, const MatrixX& residual, const MatrixX& held) {
        return self.reading().equilibrium_responses(residual, held);
      },
      py::arg("residual"), py::arg("held"));
  world.def("start_tape", [](GuardedWorld& self) { return self.changing().start_tape(); });
  world.def("note_moment", [](GuardedWorld& self) { self.changing().note_moment(); });
  world.def("stop_tape", [](GuardedWorld& self) { self.changing().stop_tape(); });
  world.def(
      "state_difference",
      [](const GuardedWorld& self, const GuardedWorld& reference) {
        return self.reading().state_difference(reference.reading());
      },
      py::arg("reference"));
  world.def(
      "displace_state", [](GuardedWorld& self, const VectorX& by) { self.changing().displace_state(by); },
      py::arg("by"));
  world.def(
      "linearise",
      [](GuardedWorld& self, const py::object& forces) {
        if (forces.is_none()) return std::as_const(self).reading().linearise();
        return self.run([](World& w) { return w.linearise(); }, py::none(), forces);
      },
      py::arg("forces"));
}

}  // namespace

void register_world(py::module_& module) {
  register_gradients(module);
  register_results(module);
  register_exceptions(module);
  WorldClass world(module, "World", "A scene while it runs.");
  world.def(py::init<const SceneDescription&, const Options&>(), py::arg("description"), py::arg("options"));
  define_steps(world);
  define_parameters(world);
  define_supports(world);
  define_readouts(world);
}

}  // namespace withe::bindings
