"""Stored, supplied and dissipated energy add up: total - work + dissipated is constant."""

import numpy as np
import pytest

import rods
import withe
from cases import measured
from convergence import assert_order

DURATION = 0.5


def driven(integrator, step, what, planar=False):
    """A robot of two joined rods: its wall moves, its arm is actuated, its hand is loaded, all is damped."""
    scene = withe.Scene(gravity=(0.0, 0.0, -3.0))
    viscous = 0.02 if "viscosity" in what else 0.0
    parts = {
        "stiffness": rods.stiffness(twist=0.8, stretch=2e2, viscous_time=viscous),
        "line_density": 1.0,
        "radius": 0.05,
    }
    arm = scene.add_rod(start=(0, 0, 0), end=(0.6, 0, 0), nodes=7, name="arm", **parts)
    hand = scene.add_rod(start=(0.6, 0, 0), end=(0.6, 0, 0.4), nodes=5, name="hand", **parts)
    scene.join(arm.end, hand.start)
    hold = "edge" if "edge" in what else "frame"
    scene.clamp(arm.start, hold=hold)
    if "drag" in what:
        scene.add_drag(0.4)
    if "load" in what:
        scene.add_force(
            hand.end, lambda t: (0.5 * np.sin(9.0 * t), 0.0, 0.3) if planar else (0.5, np.sin(9.0 * t), 0.3)
        )
        scene.add_load(arm, (0.0, 0.0, 0.4))
    if "follower" in what:
        scene.add_force(hand.end, (0.0, 0.0, -0.7), follower=True)
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        planar=None if planar else False,
        solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
        adaptive=False,
    )
    if "wall" in what:
        turn = (0.0, 1.0, 0.0) if planar else (0.4, 1.0, 0.2)
        simulation.move(
            arm.start,
            path=lambda t: ((0.1 * np.sin(5.0 * t) ** 2, 0.0, 0.2 * t**2), rods.rotation(turn, 0.8 * t**2)),
        )
    if "actuation" in what:
        simulation.set(arm, natural_curvature=(2.0, 0.0) if planar else (1.5, 1.0), over=0.3)
        if not planar:
            simulation.set(hand, natural_twist=1.2, over=0.4)
    if "muscle" in what:
        simulation.set(arm, natural_stretch=np.linspace(0.9, 1.2, 6), over=0.3)
    return simulation


def balance(simulation):
    energy = simulation.energy()
    return energy.total - energy.work + energy.dissipated


def worst_imbalance(integrator, step, what, planar=False):
    """Greatest change of the balance, and of its greatest part."""
    simulation = driven(integrator, step, what, planar)
    before = balance(simulation)
    worst = size = 0.0
    for _ in range(round(DURATION / step) // 10):
        simulation.step(10)
        worst = max(worst, abs(balance(simulation) - before))
        energy = simulation.energy()
        size = max(size, energy.kinetic, abs(energy.work), abs(energy.loads), energy.dissipated)
    return worst, size


CASES = [
    "drag",
    "viscosity",
    "load",
    "follower",
    "wall",
    "wall edge",
    "actuation",
    "muscle",
    "drag viscosity load wall actuation muscle",
]


@pytest.mark.case("dynamics", "Energy balance, energy-momentum steps", source="conservation")
@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("what", CASES)
def test_energy_of_energy_momentum_steps_adds_up_to_solver_tolerance(what, planar):
    for step in (1e-2, 2.5e-3):
        worst, size = worst_imbalance("energy_momentum", step, what, planar)
        assert size > 1e-2
        measured(worst / size)
        assert worst < 1e-9 * size


@pytest.mark.case("dynamics", "Energy balance, midpoint steps", source="conservation")
@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("what", CASES)
def test_energy_of_midpoint_steps_adds_up_at_second_order(what, planar):
    errors = [worst_imbalance("implicit_midpoint", DURATION / n, what, planar)[0] for n in (200, 400, 800)]
    assert_order(errors, slack=0.3)


@pytest.mark.case("dynamics", "Energy balance, fourth-order steps", source="conservation")
@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("what", ["drag", "load", "wall", "actuation"])
def test_energy_of_fourth_order_steps_adds_up_to_solver_tolerance(what, planar):
    for step in (5e-3, 2.5e-3):
        worst, size = worst_imbalance("fourth_order", step, what, planar)
        assert size > 1e-3
        measured(worst / size)
        assert worst < 1e-9 * size


@pytest.mark.case("contact", "Energy balance with friction", source="conservation")
@pytest.mark.parametrize("friction", [0.3, (0.2, 0.5)], ids=["isotropic", "directed"])
@pytest.mark.parametrize("model", ["anchored", "implicit"])
@pytest.mark.parametrize("what", ["flat", "tilted", "rods"])
def test_what_friction_takes_is_booked_however_short_the_steps(what, model, friction):
    """An anchor loses its energy when surfaces part or press too little, and this loss was not counted."""
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1100.0)
    for step in (4e-3, 1e-3, 2.5e-4):
        scene = withe.Scene(gravity=(0, 0, 0) if what == "rods" else (0, 0, -9.81))
        tilt = 0.3 if what == "tilted" else 0.0
        end = (0.15 * np.cos(tilt), 0, 0.012 + 0.15 * np.sin(tilt))
        rod = scene.add_rod(start=(0, 0, 0.012), end=end, nodes=11, radius=5e-3, material=rubber)
        if what == "rods":
            scene.add_rod(start=(0.06, -0.05, 0), end=(0.09, 0.05, 0), nodes=7, radius=4e-3, material=rubber)
        else:
            scene.add_floor(friction=friction)
        scene.enable_contact(friction=0.3, friction_model=model)
        simulation = scene.build(integrator="energy_momentum", time_step=step)
        simulation.set_velocities(rod, (0.3, 0.1, -0.2))
        first, moving = balance(simulation), simulation.energy().kinetic
        worst = 0.0
        for _ in range(round(0.2 / step)):
            simulation.step()
            worst = max(worst, abs(balance(simulation) - first))
        assert simulation.energy().dissipated > 0.01 * moving
        measured(worst / moving)
        assert worst < 1e-6 * moving


def test_energy_of_a_cantilever_at_rest_is_what_its_parts_say():
    """Work of gravity is what bending and stretching store, and half of it where all is linear."""
    simulation, _ = rods.heavy_cantilever(1e-3, 40)
    simulation.equilibrium()
    energy = simulation.energy()
    assert energy.bend == pytest.approx(-0.5 * energy.gravity, rel=1e-5)
    assert energy.kinetic == 0.0


def soft_helix():
    from test_helices_statics import soft_helix as build

    return build()


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("step", [0.04, 0.05, 0.055])
def test_soft_helix_takes_long_steps_and_keeps_its_energy(step):
    """10 s from rest, where the published code gives up at 12 ms. From 35 to 60 ms a step in 900 is cut."""
    scene, _ = soft_helix()
    simulation = scene.build(
        integrator="energy_momentum", time_step=step, solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)
    )
    before = simulation.energy().total
    drift = greatest = 0.0
    for _ in range(round(10.0 / step)):
        simulation.step()
        energy = simulation.energy()
        drift, greatest = max(drift, abs(energy.total - before)), max(greatest, energy.kinetic)
    assert simulation.statistics.rejected_steps <= 1
    assert greatest > 1e-4
    assert drift < 1e-6 * greatest


@pytest.mark.parametrize("nodes", [51, 201, 801])
def test_energy_momentum_steps_in_a_plane_take_few_iterations_on_fine_meshes(nodes):
    """If stencils hardly bend within a step, forces must not jump with the sign of their bending."""
    scene = withe.Scene(gravity=(0.0, 0.0, -2.0))
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.4, 0, 0), nodes=nodes, radius=0.01, material=rubber)
    scene.clamp(rod.start)
    simulation = scene.build(integrator="energy_momentum", time_step=0.02)
    assert simulation.plan.planar
    simulation.step(40)
    assert simulation.statistics.rejected_steps == 0
    assert simulation.statistics.iterations < 40 * 8


# Height of the tip after rest, from the published code, to 1e-4 m.
HELIX_HEIGHTS = {0.3: -0.20881, 0.6: -0.19466, 1.0: -0.20712, 2.0: -0.20140}


@pytest.mark.case("dynamics", "Soft helix that swings for 2 s", source="a public rod code")
def test_soft_helix_swings_as_in_published_code():
    scene, arm = soft_helix()
    simulation = scene.build(integrator="implicit_midpoint", time_step=1e-3, bending="tangent")
    record = simulation.run(duration=2.0, record_every=0.1, progress=False)
    for time, height in HELIX_HEIGHTS.items():
        frame = int(np.argmin(np.abs(record.times - time)))
        assert record.times[frame] == pytest.approx(time, abs=1e-9)
        measured(1e3 * (record.positions(arm)[frame, -1, 2] - height), "mm")
        assert record.positions(arm)[frame, -1, 2] == pytest.approx(height, abs=1.5e-4)


def loaded(points, slenderness, event, **options):
    """A clamped rod of unit length, mass and bending stiffness, at rest, that a sudden event bends."""
    stretch = 4.0 * slenderness**2
    scene = withe.Scene(gravity=(0.0, 0.0, -event.get("weight", 0.0)))
    rod = scene.add_rod(
        points=points, stiffness=rods.stiffness(stretch=stretch), line_density=1.0, radius=1.0 / slenderness
    )
    scene.clamp(rod.start)
    if "jump" in event:
        grip = scene.clamp(rod.end)
    else:
        scene.add_force(rod.end, (-event.get("pressure", 0.0), 0.0, event.get("load", 0.0)))
    simulation = scene.build(**options)
    if "curvature" in event:
        simulation.set(rod, natural_curvature=(event["curvature"], 0.0))
    if "jump" in event:
        simulation.move(grip, position=points[-1] + event["jump"])
    return simulation


def greatest_excess(simulation, steps):
    """Energy in store that nobody put in, over the most that was."""
    before, scale, excess = balance(simulation), 0.0, 0.0
    for _ in range(steps):
        simulation.step()
        energy = simulation.energy()
        put_in = before + energy.work - energy.gravity - energy.loads
        scale = max(scale, put_in)
        excess = max(excess, (energy.kinetic + energy.stretch + energy.bend + energy.twist - put_in) / scale)
    assert scale > 0.0
    return excess


def straight(nodes):
    return np.linspace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), nodes)


def coil(nodes, turns):
    angle = 2.0 * np.pi * turns * np.arange(nodes - 1) / (nodes - 1)
    edges = np.column_stack([np.cos(angle), 0.0 * angle, np.sin(angle)]) / (nodes - 1)
    return np.vstack([np.zeros(3), np.cumsum(edges, axis=0)])


@pytest.mark.parametrize(
    ("points", "slenderness", "event", "options"),
    [
        # A coil of many short edges under a load: no edge turns far.
        (coil(600, 10.0), 500.0, {"load": 3.0}, {"time_step": 0.25}),
        # An edge that swings under error control.
        (straight(2), 4000.0, {"weight": 1.8}, {"time_step": 0.2, "tolerance": 1e-3, "duration": 4.0}),
        # Steps that are too inaccurate are taken back, with what they gained.
        pytest.param(
            *(straight(8), 400.0, {"curvature": 12.0}, {"time_step": 0.5, "tolerance": 1e-3, "duration": 2.0}),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["fine coil", "error control", "sudden curvature"],
)
def test_steps_by_default_never_hold_energy_that_nobody_put_in(points, slenderness, event, options):
    simulation = loaded(points, slenderness, event, **options)
    assert greatest_excess(simulation, 4) < 1e-6


@pytest.mark.parametrize(
    ("nodes", "event", "time_step"),
    [
        (40, {"pressure": 20.0, "load": 1.0}, 0.3),
        (200, {"pressure": 20.0, "load": 1.0}, 1.0),
        (3, {"jump": np.array((-0.013, 0.0, 0.003))}, 0.5),
    ],
    ids=["buckling", "fine mesh", "ends that meet"],
)
def test_backward_euler_by_default_cuts_steps_in_which_a_rod_under_pressure_gains_energy(nodes, event, time_step):
    options = {"integrator": "backward_euler", "time_step": time_step}
    uncut = loaded(straight(nodes), 1000.0, event, **options, adaptive=False)
    assert greatest_excess(uncut, 12) > 0.015
    assert greatest_excess(loaded(straight(nodes), 1000.0, event, **options), 12) < 1e-3


CURL_PERIOD = 2.0 * np.pi / 4.730**2  # of the first bending mode [s]


def add_curl(scene):
    """A rod drawn in a curl, straight by nature, and its nodes."""
    s = np.linspace(0.0, 1.0, 16)
    stiffness = rods.stiffness(stretch=1e4, bend=1.0)
    points = np.stack([s, 0.2 * s**3, 0.5 * s**2], axis=1)
    return scene.add_rod(points=points, radius=0.02, line_density=1.0, stiffness=stiffness, natural="straight"), points


def let_go(integrator, steps_a_period):
    """A curl that begins to turn."""
    scene = rods.weightless()
    rod, points = add_curl(scene)
    simulation = scene.build(integrator=integrator, time_step=CURL_PERIOD / steps_a_period)
    simulation.set_velocities(rod, np.cross((0.3, 4.0, 0.5), points))
    return simulation


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("integrator", ["energy_momentum", "fourth_order"])
@pytest.mark.parametrize("steps_a_period", [5, 20])
def test_energy_stays_over_many_steps_however_long(integrator, steps_a_period):
    simulation = let_go(integrator, steps_a_period)
    first = simulation.energy().total
    for _ in range(300):
        simulation.step()
        assert simulation.energy().total == pytest.approx(first, rel=1e-6)


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
def test_midpoint_steps_that_change_the_energy_warn_once_with_the_remedy():
    simulation = let_go("implicit_midpoint", 30)
    with pytest.warns(withe.EnergyDriftWarning, match="integrator='energy_momentum'") as heard:
        simulation.step(200)
    assert len([w for w in heard if w.category is withe.EnergyDriftWarning]) == 1
    assert simulation.statistics.energy_momentum_steps == 0


@pytest.mark.filterwarnings("error::withe.EnergyDriftWarning")
def test_midpoint_steps_that_resolve_the_motion_do_not_warn():
    let_go("implicit_midpoint", 1000).step(2000)


@pytest.mark.parametrize("seed", range(10))
def test_a_fine_mesh_closes_the_balance_as_a_coarse_one_does(seed):
    """Thousands of rows that are each within their rounding error bound may bend a rod, all in the same sense."""
    draw = np.random.default_rng([20, seed])
    slenderness, nodes = 10.0 ** draw.uniform(1.3, 2.7), int(draw.integers(1000, 3000))
    scene = withe.Scene(gravity=draw.uniform(0.3, 3.0) * np.array([0.6, 0.0, -0.8]))
    ends = {"stretch": 16.0 * slenderness**2}  # EA L^2 / EI = 16 (L / d)^2 of a round section
    rod = rods.straight(scene, nodes - 1, (0.0, 1.0, 0.0), stiffness=rods.stiffness(**ends))
    scene.clamp(rod.start)
    if seed % 2:
        scene.clamp(rod.end)
    period = 2.0 * np.pi / (22.373 if seed % 2 else 3.516)
    simulation = scene.build(
        integrator="energy_momentum",
        time_step=draw.uniform(0.03, 0.3) * period,
        planar=seed % 3 == 0,
        solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
    )
    first, moved, worst = balance(simulation), 0.0, 0.0
    for _ in range(6):
        simulation.step()
        energy = simulation.energy()
        moved = max(moved, energy.kinetic + energy.bend + energy.stretch)
        worst = max(worst, abs(balance(simulation) - first))
    assert worst < 1e-8 * moved


@pytest.mark.parametrize(("nodes", "weight"), [(1000, 1e-2), (3000, 1.0), (3000, 1e-3)])
def test_a_stressed_rod_of_a_fine_mesh_falls_as_one_of_a_coarse_mesh_does(nodes, weight):
    """All that a load is may lie below the share of the stresses, and the rounding, that each row may be off by."""

    def fallen(count):
        scene = rods.weightless()
        s, radius = np.linspace(0.0, 1.0, count), 1.0 / np.pi
        points = radius * np.stack([np.sin(s / radius), 0.0 * s, 1.0 - np.cos(s / radius)], axis=1)
        rod = scene.add_rod(
            points=points, radius=1e-3, line_density=1.0, stiffness=rods.stiffness(stretch=1e6), natural="straight"
        )
        scene.clamp(rod.start)
        scene.clamp(rod.end)
        simulation = scene.build(planar=True, time_step=2e-3)
        simulation.equilibrium()
        before = simulation.positions(rod)[count // 2, 2]
        simulation.set(gravity=(0.0, 0.0, -weight))
        simulation.step(20)
        return before - simulation.positions(rod)[count // 2, 2]

    assert fallen(nodes) == pytest.approx(fallen(200), rel=1e-3)


@pytest.mark.parametrize("step", [0.02 / 556, 5e-5, 1e-4])
def test_what_contact_takes_closes_the_balance_however_short_the_steps(step):
    """Some contacts rest while others are hit, in steps without a loss."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.5, density=1200.0)
    scene.add_rod(start=(-0.15, 0, 0.054), end=(0.15, 0, 0.054), nodes=31, radius=4e-3, material=rubber)
    scene.add_sphere((0, 0, -0.03), 0.03)
    simulation = scene.build(time_step=step)
    start = simulation.energy().total
    simulation.run(0.3, progress=False)
    energy = simulation.energy()
    assert energy.total + energy.dissipated == pytest.approx(start, abs=5e-4 * energy.kinetic)
    assert energy.kinetic > 5e-3


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("integrator", ["energy_momentum", "fourth_order"])
@pytest.mark.parametrize("heavy", [1e3, 1e6, 1e9])
def test_a_soft_rod_keeps_its_energy_beside_a_heavy_one_that_flies(integrator, heavy):
    """The energy of the scene is that of the heavy rod, and tells nothing of the other one."""
    scene = withe.Scene(gravity=(0.0, 0.0, -9.81))
    soft, points = add_curl(scene)
    stiffness = rods.stiffness(stretch=1e4 * heavy, bend=heavy)
    other = scene.add_rod(start=(5, 0, 0), end=(6, 0, 0), nodes=4, radius=0.1, line_density=heavy, stiffness=stiffness)
    simulation = scene.build(integrator=integrator, time_step=CURL_PERIOD / 8.0)
    simulation.set_velocities(soft, np.cross((0.3, 4.0, 0.5), points))
    simulation.set_velocities(other, (30.0, 0.0, 0.0))
    first = simulation.energy(soft)
    for _ in range(100):
        simulation.step()
        assert simulation.energy(soft).total == pytest.approx(first.total, abs=1e-6 * first.kinetic)
