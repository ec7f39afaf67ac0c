"""Answers do not depend on where a scene stands, how it is turned, how it is written down, or how large it is."""

import numpy as np
import pytest

import rods
import withe

TURN = rods.rotation((0.3, -0.8, 0.5), 2.1)
SHIFT = np.array([0.7, -1.9, 0.4])


def robot(turn=None, shift=(0.0, 0.0, 0.0), order=(0, 1, 2), integrator="static", tolerance=1e-13):
    """Three bent and loaded rods on one joint, one of them clamped, one pinned at its far end."""
    turn = np.eye(3) if turn is None else turn

    def place(points):
        return np.asarray(points, dtype=float) @ turn.T + shift

    scene = withe.Scene(gravity=turn @ (0.0, 0.0, -9.81))
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.4, density=1100.0, viscosity=5e2)
    s = np.linspace(0.0, 1.0, 13)[:, None]
    lines = {
        "arm": np.hstack([0.3 * s, 0.02 * np.sin(3.0 * s), 0.0 * s]),
        "leg": np.hstack([0.3 + 0.1 * s, 0.02 * np.sin(3.0) + 0.2 * s, -0.1 * s**2]),
        "hand": np.hstack([0.3 + 0.05 * s, 0.02 * np.sin(3.0) - 0.15 * s, 0.1 * s]),
    }
    normals = {"arm": (0.0, 0.0, 1.0), "leg": (0.0, 0.0, 1.0), "hand": (1.0, 0.0, 0.0)}
    for name in (list(lines)[i] for i in order):
        scene.add_rod(
            points=place(lines[name]),
            normal=turn @ normals[name],
            section=withe.Rectangle(width=8e-3, height=6e-3),
            material=rubber,
            name=name,
        )
    scene.join("arm.end", "leg.start")
    scene.join("arm.end", "hand.start")
    scene.clamp("arm.start")
    scene.pin("leg.end")
    scene.add_force("hand.end", turn @ (0.05, 0.1, -0.1))
    return scene.build(
        integrator=integrator,
        time_step=2e-3,
        planar=False,
        solver=withe.Solver(step_tolerance=tolerance, force_tolerance=tolerance),
    )


def state_of(simulation, turn, shift):
    """Positions, reactions and energy, turned back."""
    positions = {name: (simulation.positions(name) - shift) @ turn for name in ("arm", "leg", "hand")}
    forces = [simulation.reaction(node).force @ turn for node in ("arm.start", "leg.end")]
    moment = simulation.reaction("arm.start").moment @ turn
    return positions, forces, moment, simulation.energy()


@pytest.mark.parametrize("integrator", ["static", "backward_euler", "implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("change", ["turned", "moved", "turned and moved", "re-ordered"])
def test_scene_gives_the_same_answer_when(change, integrator):
    turn = TURN if "turned" in change else np.eye(3)
    shift = SHIFT if "moved" in change else np.zeros(3)
    order = (2, 0, 1) if change == "re-ordered" else (0, 1, 2)
    answers, counts = [], []
    for arguments in ({}, {"turn": turn, "shift": shift, "order": order}):
        simulation = robot(integrator=integrator, **arguments)
        if integrator == "static":
            assert simulation.equilibrium().stable
        else:
            simulation.step(50)
        answers.append(state_of(simulation, arguments.get("turn", np.eye(3)), arguments.get("shift", np.zeros(3))))
        counts.append((simulation.statistics.steps, simulation.statistics.rejected_steps))
    assert counts[0] == counts[1]
    (positions, forces, moment, energy), (positions_b, forces_b, moment_b, energy_b) = answers
    for name in positions:
        np.testing.assert_allclose(positions_b[name], positions[name], atol=1e-9 * 0.5)
    scale = max(np.linalg.norm(force) for force in forces)
    np.testing.assert_allclose(forces_b, forces, atol=1e-9 * scale * 10.0)
    np.testing.assert_allclose(moment_b, moment, atol=1e-9 * scale)
    for part in ("kinetic", "stretch", "bend", "twist", "dissipated"):
        assert getattr(energy_b, part) == pytest.approx(getattr(energy, part), rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("integrator", ["static", "backward_euler", "implicit_midpoint", "energy_momentum"])
def test_turned_moved_and_reordered_scene_takes_the_same_iterations(integrator):
    counts = []
    for arguments in ({}, {"turn": TURN, "shift": SHIFT, "order": (2, 0, 1)}):
        simulation = robot(integrator=integrator, tolerance=1e-8, **arguments)
        if integrator == "static":
            simulation.equilibrium()
        else:
            simulation.step(50)
        counts.append(simulation.statistics.iterations)
    assert counts[1] == pytest.approx(counts[0], rel=0.02, abs=1)


def sized(length, slenderness=200.0, natural=None):
    """A level cantilever with G = 10 and a side load; its modulus grows with its size."""
    radius = length / slenderness
    density, gravity, weight = 1000.0, 9.81, 10.0
    # w L^3 / B = rho g A L^3 / (E A r^2 / 4)
    modulus = density * gravity * length**3 / (weight * 0.25 * radius**2)
    scene = withe.Scene(gravity=(0.0, 0.0, -gravity))
    material = withe.Material(youngs_modulus=modulus, poisson_ratio=0.3, density=density)
    arm = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=41, radius=radius, material=material)
    scene.clamp(arm.start)
    bend = modulus * np.pi * radius**4 / 4.0
    scene.add_force(arm.end, (0.0, 2.0 * bend / length**2, 0.0))
    return scene, arm


SIZES = (1e-6, 1e-3, 1.0)


@pytest.mark.parametrize("slenderness", [100.0, 1000.0])
def test_micrometre_millimetre_and_metre_scenes_converge_alike(slenderness):
    shapes, iterations = [], []
    for length in SIZES:
        scene, arm = sized(length, slenderness)
        simulation = scene.build(integrator="static", solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12))
        result = simulation.equilibrium()
        assert result.stable
        shapes.append(simulation.positions(arm) / length)
        iterations.append(result.iterations)
    assert len(set(iterations)) == 1, iterations
    for shape in shapes[:-1]:
        np.testing.assert_allclose(shape, shapes[-1], atol=1e-8)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_micrometre_millimetre_and_metre_scenes_move_alike(integrator):
    shapes, iterations = [], []
    for length in SIZES:
        scene, arm = sized(length)
        step = 0.02 * np.sqrt(length / 9.81)
        simulation = scene.build(
            integrator=integrator, time_step=step, solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)
        )
        simulation.step(20)
        shapes.append(simulation.positions(arm) / length)
        iterations.append(simulation.statistics.iterations)
    assert max(iterations) <= 1.05 * min(iterations), iterations
    for shape in shapes[:-1]:
        np.testing.assert_allclose(shape, shapes[-1], atol=1e-8)


def anywhere(draw, length):
    """A vector of that length."""
    way = draw.normal(size=3)
    return length * way / np.linalg.norm(way)


def limp_rod(scene, draw, turn, start, way, nodes, decades, name):
    """One that leads straight on from a place; how its section lies, and its stiffness in `decades` [Pa], are drawn."""
    return scene.add_rod(
        start=turn @ start,
        end=turn @ (start + way),
        nodes=nodes,
        normal=turn @ np.cross(way, draw.normal(size=3)),
        section=withe.Rectangle(width=8e-3, height=5e-3),
        material=withe.Material(youngs_modulus=10.0 ** draw.uniform(*decades), poisson_ratio=0.4, density=1000.0),
        name=name,
    )


def limp_tree(seed, turn):
    """Three soft rods on one joint, with loads and natural shapes that lead them far from where they were drawn."""
    draw = np.random.default_rng(seed)
    scene = withe.Scene(gravity=turn @ (0.0, 0.0, -9.81))

    knot = anywhere(draw, 0.25)
    for name, start, length, nodes in (("trunk", np.zeros(3), 0.25, 11), ("leg", knot, 0.2, 9), ("arm", knot, 0.15, 8)):
        way = knot if name == "trunk" else anywhere(draw, length)
        limp_rod(scene, draw, turn, start, way, nodes, (5.5, 6.5), name)
    scene.join("trunk.end", "leg.start")
    scene.join("trunk.end", "arm.start")
    scene.clamp("trunk.start")
    scene.add_force("leg.end", turn @ (0.05 * draw.normal(size=3)))
    scene.add_mass("arm.end", 0.01)
    simulation = scene.build(integrator="static", planar=False)
    for name in ("trunk", "leg", "arm"):
        simulation.set(name, natural_curvature=3.0 * draw.normal(size=2))
        simulation.set(name, natural_twist=3.0 * draw.normal())
    return simulation


@pytest.mark.parametrize("seed", [3, 5, 10, 20, 35, 70, 79, 85, 95])
def test_what_falls_far_to_its_equilibrium_comes_to_the_same_one_when_turned(seed):
    """Nothing on the way knows the axes of the room."""
    ends = []
    for turn in (np.eye(3), TURN, TURN @ TURN):
        simulation = limp_tree(seed, turn)
        assert simulation.equilibrium().stable
        ends.append(simulation.positions() @ turn)
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-8)


def hinged_chain(seed, turn):
    """Three rods with natural curvature on two hinges, one clamped, with a force on each: paths that end in jumps."""
    draw = np.random.default_rng(seed)
    scene = withe.Scene(gravity=turn @ (0.0, 0.0, -9.81))

    start, last = np.zeros(3), None
    for name in ("upper", "lower", "hand"):
        way = anywhere(draw, 0.2)
        rod = limp_rod(scene, draw, turn, start, way, 11, (6.0, 7.0), name)
        if last is None:
            scene.clamp(rod.start)
        else:
            scene.join(last.end, rod.start, kind="revolute", axis=turn @ anywhere(draw, 1.0))
        scene.add_force(rod.node(6), turn @ anywhere(draw, 0.2))
        start, last = start + way, rod
    simulation = scene.build(integrator="static", planar=False)
    for name in ("upper", "lower", "hand"):
        simulation.set(name, natural_curvature=3.0 * draw.normal(size=2))
    return simulation


@pytest.mark.parametrize("seed", [0, 8, 17, 28, 48, 54])
def test_jump_of_a_chain_at_rest_leads_to_the_same_place_when_turned(seed):
    """Its clamp does not move, though a rotation of the scene rounds where it stands."""
    ends = []
    for turn in (np.eye(3), TURN, TURN @ TURN):
        simulation = hinged_chain(seed, turn)
        assert simulation.equilibrium().stable
        ends.append(simulation.positions() @ turn)
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-8)
