"""Read-outs and stepping of simulations."""

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, tripod

INTEGRATORS = ["implicit_midpoint", "backward_euler", "energy_momentum", "fourth_order", "verlet", "static"]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_every_integrator_steps_exactly(integrator):
    step = 1e-5 if integrator == "verlet" else 5e-3
    _, arm, simulation = cantilever(integrator=integrator, time_step=step)
    simulation.step(10)
    assert simulation.time == pytest.approx(10 * step, abs=1e-15)
    assert simulation.time_step == step
    assert simulation.positions(arm)[-1, 2] < 0
    simulation.step(0)
    assert simulation.time == pytest.approx(10 * step, abs=1e-15)


def test_readouts_have_their_shapes_and_are_copies():
    _, rods, simulation = tripod()
    simulation.step(5)
    assert simulation.positions().shape == simulation.velocities().shape == (22, 3)
    for rod in rods:
        shapes = {
            "positions": (8, 3),
            "velocities": (8, 3),
            "directors": (7, 3, 3),
            "curvatures": (6, 2),
            "twists": (6,),
            "tensions": (7,),
            "spins": (7,),
        }
        for name, shape in shapes.items():
            readout = getattr(simulation, name)
            first = readout(rod)
            assert first.shape == shape
            assert np.isfinite(first).all()
            first[:] = 7.0
            assert not np.array_equal(readout(rod.name), first)
        assert np.array_equal(simulation.positions(rod), simulation.positions()[rod.rows])


def test_directors_are_orthonormal_and_their_last_row_is_the_tangent():
    _, rods, simulation = tripod()
    simulation.step(20)
    for rod in rods:
        directors = simulation.directors(rod)
        edges = np.diff(simulation.positions(rod), axis=0)
        tangents = edges / np.linalg.norm(edges, axis=1, keepdims=True)
        assert np.allclose(directors[:, 2], tangents, atol=1e-12)
        assert np.allclose(directors @ directors.transpose(0, 2, 1), np.eye(3), atol=1e-12)
        assert np.allclose(np.linalg.det(directors), 1)


@pytest.mark.parametrize("planar", [True, False])
def test_the_drawn_scene_is_read_back_as_it_was_drawn(planar):
    scene = withe.Scene()
    a = np.linspace(0, 1.5, 16)
    points = 0.2 * np.stack([np.sin(a), 0 * a, 1 - np.cos(a)], axis=1)
    arm = scene.add_rod(points=points, radius=5e-3, material=RUBBER, normal=(0, 1, 0))
    scene.clamp(arm.start)
    simulation = scene.build(planar=planar)
    part = scene._directory.rod(arm)
    assert simulation.plan.planar == planar
    assert np.allclose(simulation.positions(arm), points, atol=1e-15)
    assert np.allclose(simulation.directors(arm)[:, 0], part.directors, atol=1e-12)
    assert np.allclose(simulation.curvatures(arm), part.natural_curvature, atol=1e-10)
    assert np.allclose(simulation.get(arm, "natural_curvature"), part.natural_curvature, atol=1e-15)
    assert np.allclose(simulation.tensions(arm), 0, atol=1e-9)
    energy = simulation.energy()
    assert energy.stretch + energy.bend + energy.twist < 1e-18


def test_as_built_is_free_of_stress_also_with_twist_and_closed():
    scene = withe.Scene(gravity=(0, 0, 0))
    a = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ring = np.stack([np.cos(a), np.sin(a), 0.3 * np.sin(2 * a) + 0.2 * np.cos(a) ** 3], axis=1)
    scene.add_rod(points=0.1 * ring, closed=True, radius=2e-3, material=RUBBER)
    b = np.linspace(0, 3, 20)
    normals = np.stack([np.cos(b), np.sin(b), 0.3 + 0 * b], axis=1)[:-1]
    scene.add_rod(points=np.stack([0.05 * np.sin(b) + 1, 0.05 * np.cos(b), 0.02 * b], 1), normal=normals,
                  section=withe.Rectangle(width=4e-3, height=1e-3), material=RUBBER)  # fmt: skip
    simulation = scene.build()
    before = simulation.positions()
    energy = simulation.energy()
    assert energy.bend + energy.twist + energy.stretch < 1e-20
    simulation.step(5)
    assert np.allclose(simulation.positions(), before, atol=1e-10)


def test_a_closed_rod_steps():
    scene = withe.Scene()
    a = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = scene.add_rod(points=0.1 * np.stack([np.cos(a), 0 * a, np.sin(a)], 1), closed=True,
                         radius=2e-3, material=RUBBER)  # fmt: skip
    scene.pin(ring.node(6))
    simulation = scene.build()
    simulation.step(20)
    assert simulation.curvatures(ring).shape == (24, 2)
    assert simulation.tensions(ring).shape == (24,)
    assert np.allclose(simulation.positions(ring)[6], (0, 0, 0.1), atol=1e-12)


def test_gravity_energy_and_reaction_agree_with_the_weight():
    scene, arm, simulation = cantilever(integrator="static")
    mass = simulation.get(arm, "line_density")[0] * 0.2
    found = simulation.equilibrium()
    assert found.stable
    assert found.iterations > 0
    assert found.residual < 1e-6 * mass * 9.81
    for handle in (arm.start, "arm.start", "wall", scene["wall"]):
        reaction = simulation.reaction(handle)
        assert np.allclose(reaction.force, (0, 0, 9.81 * mass), atol=1e-8)
    x, z = simulation.positions(arm)[:, 0], simulation.positions(arm)[:, 2]
    weights = np.full(11, mass / 10)
    weights[[0, -1]] /= 2
    assert reaction.moment == pytest.approx((0, -9.81 * weights @ x, 0), abs=1e-8)
    assert simulation.energy().gravity == pytest.approx(9.81 * weights @ z)


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "verlet"])
def test_reaction_of_the_two_clamps_agrees_in_static_scenes(integrator):
    values = []
    for hold in ("frame", "edge"):
        scene = withe.Scene()
        arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=161, radius=5e-3, material=RUBBER)
        scene.clamp(arm.start, hold=hold)
        simulation = scene.build(integrator=integrator)
        simulation.equilibrium()
        values.append(simulation.reaction(arm.start).moment)
    assert np.allclose(*values, rtol=1e-2, atol=1e-9)


def test_energy_is_the_sum_of_its_parts():
    _, _, simulation = tripod()
    simulation.step(20)
    e = simulation.energy()
    parts = e.kinetic + e.stretch + e.bend + e.twist + e.gravity + e.loads + e.contact
    assert e.total == pytest.approx(parts)
    assert e.kinetic > 0
    with pytest.raises(AttributeError):
        e.kinetic = 0.0


def test_the_plan_is_told_in_a_few_lines():
    _, _, simulation = cantilever()
    plan = simulation.plan
    assert plan.planar
    assert abs(plan.plane_normal[1]) == pytest.approx(1)
    lines = str(plan).splitlines()
    assert lines[0].startswith("planar, normal (0, ")
    assert f"{plan.unknowns} unknowns" in lines[0]
    assert 3 <= len(lines) <= 12
    assert all(len(line) <= 140 for line in lines)
    _, _, spatial = tripod()
    assert not spatial.plan.planar
    assert spatial.plan.plane_normal is None
    assert str(spatial.plan).startswith("3D; ")


def test_statistics_count_the_work():
    _, _, simulation = cantilever()
    simulation.step(10)
    statistics = simulation.statistics
    assert statistics.steps >= 10
    assert statistics.iterations >= statistics.steps
    assert statistics.total_time > 0


def test_the_plan_says_how_long_and_heavy_a_scene_is_by_which_millimetres_are_noticed():
    def plan(length, radius):
        scene = withe.Scene()
        arm = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=5, radius=radius,
                            material=withe.Material(youngs_modulus=1e6, density=1000.0))  # fmt: skip
        scene.add_mass(arm.end, 0.5)
        return scene.build().plan

    assert plan(200.0, 5.0).notes[0] == "200 m of rod, 1.571e+07 kg in all"
    assert plan(0.2, 5e-3).notes[0] == "0.2 m of rod, 0.5157 kg in all"
    assert "- 0.2 m of rod, 0.5157 kg in all" in str(plan(0.2, 5e-3)).splitlines()


def test_the_plan_names_rods_that_no_support_holds():
    def notes(simulation):
        return [note for note in simulation.plan.notes if note.startswith("no support")]

    scene = withe.Scene()
    ends = [((0, 0, 0), (0.1, 0, 0)), ((0.1, 0, 0), (0.2, 0, 0)), ((0, 1, 0), (0.1, 1, 0))]
    arm, tip, _ = (
        scene.add_rod(start=start, end=end, nodes=5, radius=5e-3, material=RUBBER, name=name)
        for name, (start, end) in zip(("arm", "tip", "stick"), ends, strict=True)
    )
    scene.join(arm.end, tip.start)
    assert notes(scene.build()) == ["no support holds rods 'arm', 'tip', 'stick': they are free"]
    wall = scene.clamp(arm.start)
    simulation = scene.build()
    assert notes(simulation) == ["no support holds rod 'stick': it is free"]
    simulation.release(wall)
    simulation.clamp("stick.start")
    assert notes(simulation) == ["no support holds rods 'arm', 'tip': they are free"]
    scene.pin("stick.end")
    assert notes(scene.build()) == []


def test_planar_and_spatial_simulations_agree():
    results = []
    for planar in (True, False):
        _, arm, simulation = cantilever(planar=planar)
        simulation.step(40)
        results.append((simulation.positions(arm), simulation.curvatures(arm), simulation.reaction("wall").moment))
    for a, b in zip(*results, strict=True):
        assert np.allclose(a, b, rtol=1e-7, atol=1e-9)


def test_a_failed_static_problem_is_a_convergence_error_that_says_where():
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0.1), nodes=5, radius=5e-3, material=RUBBER, name="free rod")
    simulation = scene.build(integrator="static")
    before = simulation.snapshot()
    with pytest.raises(withe.ConvergenceError) as caught:
        simulation.equilibrium()
    error = caught.value
    assert isinstance(error, RuntimeError)
    assert error.time == 0.0
    assert error.rod in (None, "free rod")
    assert "no support holds the scene: clamp or pin a node" in str(error)
    assert error.residual > 0 or np.isnan(error.residual)
    assert simulation.snapshot() == before
    assert np.isfinite(simulation.positions(rod)).all()


def test_convergence_errors_pickle():
    import pickle

    error = withe.ConvergenceError("no", time=1.0, step=0.5, rod="arm", node=3, residual=2.0)
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == "no"
    assert (again.time, again.step, again.rod, again.node, again.residual) == (1.0, 0.5, "arm", 3, 2.0)


# Hints of errors


@pytest.mark.parametrize(
    ("build", "hint"),
    [
        (
            {"solver": withe.Solver(max_iterations=1, max_halvings=0)},
            "Try a smaller time_step, viscosity of the material, or integrator=",
        ),
        ({"solver": withe.Solver(max_iterations=1), "adaptive": False}, "Try adaptive=True, or a smaller time_step"),
        (
            {"solver": withe.Solver(max_iterations=1, max_halvings=0), "integrator": "backward_euler"},
            "Try a smaller time_step, or more max_halvings",
        ),
        ({"tolerance": 1e-13, "solver": withe.Solver(max_halvings=1)}, "Try a larger tolerance, or more max_halvings"),
    ],
)
def test_a_step_that_fails_ends_with_what_to_try(build, hint):
    _, _, simulation = cantilever(**build)
    with pytest.raises(withe.ConvergenceError) as caught:
        simulation.step(50)
    assert str(caught.value).rpartition("state. ")[2].startswith(hint)


def test_rods_of_unlike_stiffness_are_named_where_a_step_fails():
    scene = withe.Scene()
    soft = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER, name="soft")
    steel = withe.Material(youngs_modulus=2e13, density=8000.0)
    stiff = scene.add_rod(start=(0.2, 0, 0), end=(0.3, 0, 0), nodes=6, radius=5e-3, material=steel, name="stiff")
    scene.clamp(soft.start)
    scene.join(soft.end, stiff.start)
    simulation = scene.build(solver=withe.Solver(max_iterations=1, max_halvings=0))
    with pytest.raises(
        withe.ConvergenceError, match=r"Try more similar stiffnesses: .* rods 'soft' and 'stiff' differ by 2e\+07 times"
    ):
        simulation.step(50)


# Tolerances with which anything is a solution


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            {"solver": withe.Solver(step_tolerance=1.0)},
            "step_tolerance must not exceed the shortest edge over the longest rod, 0.1, got 1",
        ),
        ({"solver": withe.Solver(force_tolerance=1.0)}, "force_tolerance must be less than 1, got 1"),
        ({"tolerance": 0.3}, "tolerance must not exceed the length of the longest rod, 0.2 m, got 0.3 m"),
    ],
)
def test_silly_tolerances_are_refused(build, message):
    with pytest.raises(ValueError, match=message):
        cantilever(**build)


# Energy of a rod


@pytest.mark.parametrize("planar", [None, False])
def test_energies_of_all_rods_sum_up_to_that_of_the_scene(planar):
    scene, rods, _ = tripod()
    ring = withe.shapes.circle(0.03, 12) + np.array([0.5, 0.0, 0.0])
    scene.add_rod(points=ring, closed=True, radius=2e-3, material=RUBBER, name="ring")
    scene.add_mass(rods[0].start, 0.01)
    if planar is None:
        scene = withe.Scene(gravity=(0, -9.81, 0))
        arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=6, radius=4e-3, material=RUBBER)
        hand = scene.add_rod(start=(0.1, 0, 0), end=(0.2, 0, 0), nodes=9, radius=2e-3, material=RUBBER)
        leg = scene.add_rod(start=(0.1, 0, 0), end=(0.1, -0.1, 0), nodes=5, radius=2e-3, material=RUBBER)
        scene.clamp(arm.start)
        scene.join(arm.end, hand.start, kind="revolute", axis=(0, 0, 1))
        scene.join(arm.end, leg.start)
    simulation = scene.build()
    assert simulation.plan.planar == (planar is None)
    simulation.step(20)
    whole, parts = simulation.energy(), [simulation.energy(rod) for rod in simulation.rods]
    scale = abs(whole.total) + whole.kinetic
    for name in ("kinetic", "stretch", "bend", "twist", "gravity"):
        assert sum(getattr(part, name) for part in parts) == pytest.approx(getattr(whole, name), abs=1e-12 * scale), (
            name
        )
    for part in parts:
        assert part.total == pytest.approx(part.kinetic + part.stretch + part.bend + part.twist + part.gravity)
        assert part.kinetic > 0.0
        assert part.bend >= 0.0


def test_the_energy_of_a_rod_is_that_of_the_rod_alone():
    _, _, simulation = cantilever()
    far = withe.Scene()
    same = far.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER, name="arm")
    far.clamp(same.start)
    far.add_rod(start=(0, 5, 0), end=(0.1, 5, 0), nodes=4, radius=5e-3, material=RUBBER, name="other")
    other = far.build()
    simulation.step(10)
    other.step(10)
    for name in ("kinetic", "bend", "gravity", "total"):
        assert getattr(other.energy("arm"), name) == pytest.approx(getattr(simulation.energy(), name), rel=1e-6)
    with pytest.raises(ValueError, match="rod must be a rod, got the support"):
        simulation.energy("wall")
