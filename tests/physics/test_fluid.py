"""Fluids against slender-body theory, and against Stokeslets integrated without segments."""

import itertools

import numpy as np
import pytest

import rods
import withe
from cases import measured
from convergence import assert_order

GAUSS = np.polynomial.legendre.leggauss
PIECE = {"radius": 1e-3, "stiffness": rods.stiffness(bend=1e3, twist=1e3), "line_density": 0.05}


def stokeslets(targets, sources, regularization):
    """8 pi mu times velocity per force, (3 targets, 3 sources) [Cortez, Fauci and Medovikov 2005, eq. 10]."""
    r = targets[:, None] - sources[None]
    square = np.sum(r * r, axis=-1) + regularization**2
    inverse = 1.0 / np.sqrt(square)
    tensor = (inverse + regularization**2 * inverse**3)[..., None, None] * np.eye(3)
    tensor = tensor + inverse[..., None, None] ** 3 * r[..., :, None] * r[..., None, :]
    return tensor.transpose(0, 2, 1, 3).reshape(3 * len(targets), 3 * len(sources))


def smooth_forces(curves, velocity, regularization, points):
    """Forces on pieces of smooth curves that move: Gauss's rule along each curve, velocities asked for at its points.

    Parameters
    ----------
    curves : list of (function, length)
        Function of arc length.
    velocity : function of positions

    Returns
    -------
    positions, forces : ndarray of shape (curves points, 3)
        Of the rod on the fluid, for unit viscosity.
    """
    place, weight = GAUSS(points)
    x = np.concatenate([curve(0.5 * length * (place + 1.0)) for curve, length in curves])
    w = np.concatenate([0.5 * length * weight for _, length in curves])
    density = np.linalg.solve(
        stokeslets(x, x, regularization) * np.repeat(w, 3)[None], 8.0 * np.pi * velocity(x).ravel()
    )
    return x, w[:, None] * density.reshape(-1, 3)


def straight_curve(start, direction):
    return lambda s: np.asarray(start) + s[:, None] * np.asarray(direction)


def falling(direction, fluid, edges=60, starts=((0.0, 0.0, 0.0),), radius=5e-3):
    """Speeds at which stiff straight rods of unit length and weight fall side by side, viscosity one."""
    scene = withe.Scene(gravity=(0.0, 0.0, -20.0))
    scene.add_fluid(1.0, **fluid)
    arms = [
        scene.add_rod(
            start=start,
            end=np.add(start, direction),
            nodes=edges + 1,
            **(PIECE | {"radius": radius}),
        )
        for start in starts
    ]
    simulation = scene.build(integrator="backward_euler", time_step=0.02, planar=False)
    simulation.step(250)  # of ten to a time constant
    return np.array([-simulation.velocities(arm)[:, 2].mean() for arm in arms])


def cylinder(slenderness):
    """Drag of a cylinder over viscosity, length and speed, along and across [Keller and Rubinow 1976]."""
    s = 1.0 / np.log(slenderness)
    along = 2.0 * np.pi * (s + 0.80685 * s**2 + 0.82854 * s**3)
    across = 4.0 * np.pi * (s - 0.19315 * s**2 + 0.21484 * s**3)
    return along, across


@pytest.mark.case("fluid", "Rods that fall along and across themselves", source="slender-body theory")
def test_rods_fall_along_and_across_at_the_speeds_of_slender_body_theory():
    along = falling((0.0, 0.0, 1.0), {})[0]
    across = falling((1.0, 0.0, 0.0), {})[0]
    drag = cylinder(200.0)
    assert along == pytest.approx(1.0 / drag[0], rel=0.03)  # 4 / ln(200)^3
    assert across == pytest.approx(1.0 / drag[1], rel=0.03)
    assert 1.4 < along / across < 2.0


@pytest.mark.case(
    "fluid",
    "Ratio of the two speeds in a resistive fluid",
    source="2 (ln(L / a) - 0.5) / (ln(L / a) + 0.5), resistive-force theory",
)
def test_the_ratio_of_the_two_speeds_tends_to_two_as_rods_become_slender():
    ratios = []
    for slenderness in (1e2, 1e4, 1e8):
        fluid = {"model": "resistive"}
        radius = 1.0 / slenderness
        speeds = [falling(d, fluid, 8, radius=radius)[0] for d in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))]
        ratios.append(speeds[0] / speeds[1])
        logarithm = np.log(slenderness)
        assert ratios[-1] == pytest.approx(2.0 * (logarithm - 0.5) / (logarithm + 0.5), rel=1e-5)
    assert np.all(np.diff(ratios) > 0.0)


@pytest.mark.parametrize("parts", [2, 4])
def test_a_row_of_joined_rods_falls_through_a_resistive_fluid_as_one_rod(parts):
    """Its slenderness is that of the whole."""
    speeds = []
    for pieces in (1, parts):
        scene = withe.Scene()
        scene.add_fluid(1.0, model="resistive")
        ends = np.linspace(0.0, 1.0, pieces + 1)
        row = [
            scene.add_rod(start=(a, 0, 0), end=(b, 0, 0), nodes=16 // pieces + 1, **PIECE)
            for a, b in itertools.pairwise(ends)
        ]
        for one, other in itertools.pairwise(row):
            scene.join(one.end, other.start)
        simulation = scene.build(integrator="backward_euler", time_step=0.02)
        simulation.step(250)
        speeds.append([simulation.velocities(rod)[[0, -1], 2] for rod in (row[0], row[-1])])
    np.testing.assert_allclose(speeds[1][0][0], speeds[0][0][0], rtol=1e-9)
    np.testing.assert_allclose(speeds[1][1][1], speeds[0][1][1], rtol=1e-9)


@pytest.mark.case("fluid", "Ring that falls in a resistive fluid", source="c_n per length of the circle")
def test_a_ring_meets_the_resistance_of_its_arc_on_any_mesh():
    """It falls along its axis, across all of its length: c_n a unit length, of the circle and not of its chords."""
    weight, radius, wavelength = 0.05 * 9.81, 1e-3, 0.5
    across = 4.0 * np.pi / (np.log(0.18 * wavelength / radius) + 0.5)
    for nodes in (6, 24):
        turn = np.linspace(0.0, 2.0 * np.pi, 2001)[:-1]
        scene = withe.Scene()
        scene.add_fluid(1.0, model="resistive", wavelength=wavelength)
        ring = scene.add_rod(
            points=0.1 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1), nodes=nodes, closed=True, **PIECE
        )
        simulation = scene.build(integrator="backward_euler", time_step=0.02, planar=False)
        simulation.step(250)
        np.testing.assert_allclose(-simulation.velocities(ring)[:, 2], weight / across, rtol=1e-4)


@pytest.mark.case(
    "fluid", "Ring that falls, Stokeslets", source="integral over the circle [Cortez, Fauci and Medovikov 2005, eq. 10]"
)
def test_speed_of_a_falling_ring_converges_at_second_order_to_the_integral_over_a_circle():
    """By symmetry the force is the same all round."""
    radius, regularization = 0.4, 0.05
    angle = 2.0 * np.pi * np.arange(4096) / 4096
    spread = np.sqrt((2.0 * radius * np.sin(0.5 * angle)) ** 2 + regularization**2)
    exact = 0.25 * radius * np.mean(1.0 / spread + regularization**2 / spread**3)
    errors = []
    for edges in (16, 32, 64):
        scene = withe.Scene(gravity=(0.0, 0.0, -20.0))
        scene.add_fluid(1.0, regularization=regularization)
        ring = scene.add_rod(
            points=withe.shapes.circle(radius, edges),
            closed=True,
            radius=0.01,
            stiffness=rods.stiffness(stretch=1e5, bend=1e3, twist=1e3),
            line_density=0.05,
        )
        simulation = scene.build(integrator="backward_euler", time_step=0.01, planar=False)
        simulation.step(400)
        errors.append(-simulation.velocities(ring)[:, 2].mean() / exact - 1.0)
    measured(errors[-1])
    assert abs(errors[-1]) < 1e-3
    assert_order(errors, slack=0.3)


@pytest.mark.case("fluid", "Two rods that fall side by side", source="Stokeslets by Gauss quadrature")
def test_rods_side_by_side_carry_each_other_down_as_stokeslets_integrated_without_segments_say():
    """Forces at blunt ends have no limit as they are resolved: within a few edges they come to a per cent."""
    regularization, gap = 0.02, 0.3
    starts = [(0.0, 0.0, 0.0), (0.0, gap, 0.0)]
    curves = [(straight_curve(start, (1.0, 0.0, 0.0)), 1.0) for start in starts]
    fall = lambda x: np.tile((0.0, 0.0, -1.0), (len(x), 1))  # noqa: E731
    exact_pair = 2.0 / abs(smooth_forces(curves, fall, regularization, 120)[1][:, 2].sum())
    exact = 1.0 / abs(smooth_forces(curves[:1], fall, regularization, 120)[1][:, 2].sum())
    pair = falling((1.0, 0.0, 0.0), {"regularization": regularization}, 60, starts)
    alone = falling((1.0, 0.0, 0.0), {"regularization": regularization}, 60)
    assert pair[0] == pytest.approx(pair[1], rel=1e-9)
    assert alone[0] == pytest.approx(exact, rel=0.02)
    assert pair[0] == pytest.approx(exact_pair, rel=0.02)
    assert pair[0] / alone[0] == pytest.approx(exact_pair / exact, rel=5e-3)
    assert pair[0] > 1.2 * alone[0]


def test_a_rod_that_is_pulled_takes_its_neighbour_along_and_only_stokeslets_do_that():
    moved = {}
    for model in ("stokeslets", "resistive"):
        scene = rods.weightless()
        scene.add_fluid(1.0, model=model)
        pulled = rods.straight(scene, 20, radius=5e-3, line_density=1e-3)
        near = scene.add_rod(
            start=(0, 0.1, 0), end=(1, 0.1, 0), nodes=21, radius=5e-3, stiffness=rods.stiffness(), line_density=1e-3
        )
        scene.add_load(pulled, (0.0, 0.0, 0.1))
        simulation = scene.build(time_step=1e-2, planar=False)
        simulation.step(20)
        moved[model] = simulation.velocities(near)[:, 2].mean() / simulation.velocities(pulled)[:, 2].mean()
    assert 0.3 < moved["stokeslets"] < 0.9
    assert moved["resistive"] == 0.0


RADIUS, PITCH, TURNS, THICKNESS, RATE = 0.01, 0.05, 4.0, 1e-3, 5.0
TURN_LENGTH = np.hypot(2.0 * np.pi * RADIUS, PITCH)


def helix_at(s):
    angle = 2.0 * np.pi * s / TURN_LENGTH
    return np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), PITCH * s / TURN_LENGTH], axis=1)


def turning_helix(edges, **fluid):
    """Torque and thrust about the axis that a grip needs to turn a stiff helix in a fluid of viscosity one."""
    scene = rods.weightless()
    scene.add_fluid(1.0, **fluid)
    points = helix_at(np.linspace(0.0, TURNS * TURN_LENGTH, edges + 1))
    helix = scene.add_rod(
        points=points, radius=THICKNESS, stiffness=rods.stiffness(stretch=1e8, bend=1e2, twist=1e2), line_density=1e-6
    )
    grip = scene.clamp(helix.start)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3, planar=False)
    centre = np.zeros(3)

    def path(time):
        turn = rods.rotation((0.0, 0.0, 1.0), RATE * time)
        return centre + turn @ points[0], turn

    simulation.move(grip, path=path)
    simulation.step(20)
    reaction = simulation.reaction(grip)
    hand = simulation.positions(helix)[0]
    return (np.cross(hand, reaction.force) + reaction.moment)[2], reaction.force[2]


@pytest.mark.case("fluid", "Torque and thrust of a turning helix, resistive", source="resistive-force theory")
def test_a_turning_helix_needs_the_torque_and_thrust_of_resistive_force_theory():
    """Torque and thrust per length of a helix of radius a that turns at w, with the angle p to its axis.

    The velocity is v = w a, with the part sin p along the helix. The torque is a (c_n - (c_n - c_t) sin^2 p) v, and the
    thrust is (c_n - c_t) sin p cos p v.
    """
    logarithm = np.log(0.18 * TURN_LENGTH / THICKNESS)
    along, across = 2.0 * np.pi / logarithm, 4.0 * np.pi / (logarithm + 0.5)
    sine, cosine = 2.0 * np.pi * RADIUS / TURN_LENGTH, PITCH / TURN_LENGTH
    length, speed = TURNS * TURN_LENGTH, RATE * RADIUS
    torque, thrust = turning_helix(320, model="resistive", wavelength=TURN_LENGTH)
    assert torque == pytest.approx(length * speed * RADIUS * (across - (across - along) * sine**2), rel=2e-3)
    assert abs(thrust) == pytest.approx(length * speed * (across - along) * sine * cosine, rel=2e-3)


@pytest.mark.case("fluid", "Torque and thrust of a turning helix, Stokeslets", source="Stokeslets by Gauss quadrature")
def test_a_turning_helix_of_segments_needs_what_stokeslets_integrated_along_the_curve_say():
    regularization = 2e-3
    turn = lambda x: RATE * np.cross((0.0, 0.0, 1.0), x)  # noqa: E731
    x, force = smooth_forces([(helix_at, TURNS * TURN_LENGTH)], turn, regularization, 330)
    expected = np.cross(x, force)[:, 2].sum(), force[:, 2].sum()
    torque, thrust = turning_helix(160, regularization=regularization)
    measured([torque / expected[0] - 1.0, thrust / expected[1] - 1.0])
    assert torque == pytest.approx(expected[0], rel=5e-3)
    assert thrust == pytest.approx(expected[1], rel=1e-2)
    # Resistive-force theory is known to be within some tens of per cent [Rodenborn and others 2013].
    resistive, _ = turning_helix(160, model="resistive", wavelength=TURN_LENGTH)
    torque, _ = turning_helix(160)
    assert torque == pytest.approx(resistive, rel=0.35)


def swaying(integrator, model, step, duration=0.4):
    """A light curved arm, clamped, that falls in a fluid: positions, dissipated, unbalanced energy."""
    scene = withe.Scene(gravity=(0.0, 0.0, -1.0))
    scene.add_fluid(0.1, model=model)
    arm = scene.add_rod(
        points=withe.shapes.helix(0.3, 0.4, 1.0, 13),
        radius=0.02,
        stiffness=rods.stiffness(stretch=20.0, bend=0.05, twist=0.05),
        line_density=0.1,
    )
    scene.clamp(arm.start)
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        adaptive=False,
        solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
    )
    simulation.step(round(duration / step))
    energy = simulation.energy()
    return simulation.positions(arm), energy.dissipated, energy.total - energy.work + energy.dissipated


@pytest.mark.parametrize("model", ["stokeslets", "resistive"])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_steps_in_a_fluid_converge_at_the_order_of_their_scheme(integrator, model):
    steps = 0.4 / np.array([320, 640, 1280, 2560])
    runs = [swaying(integrator, model, step) for step in steps]
    differences = [np.abs(b[0] - a[0]).max() for a, b in itertools.pairwise(runs)]
    assert_order(differences, order=1 if integrator == "backward_euler" else 2, slack=0.3)


@pytest.mark.parametrize("model", ["stokeslets", "resistive"])
def test_what_rods_lose_to_a_fluid_is_booked_as_dissipated(model):
    start = swaying("energy_momentum", model, 0.01, 0.0)[2]
    _, dissipated, end = swaying("energy_momentum", model, 0.01)
    assert dissipated > 3e-4
    assert end == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint"])
def test_rods_almost_without_mass_are_stable_at_steps_far_above_mass_over_drag(integrator):
    """A force computed once a step would need steps below 2 mass / resistance, here 2e-5 s."""
    tips = []
    for step in (1e-2, 1e-3):
        scene = rods.weightless()
        scene.add_fluid(1.0)
        arm = rods.straight(scene, 24, radius=0.01, line_density=5e-5)
        scene.clamp(arm.start)
        scene.add_force(arm.end, (0.0, 0.1, 0.2))
        simulation = scene.build(integrator=integrator, time_step=step, planar=False)
        simulation.step(round(0.5 / step))
        tips.append(simulation.positions(arm)[-1])
    assert np.linalg.norm(tips[0] - (1.0, 0.0, 0.0)) > 0.02
    assert tips[0] == pytest.approx(tips[1], abs=2e-3)


@pytest.mark.parametrize("density", [1.0, 1000.0])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint"])
def test_light_rods_that_nearly_touch_move_together_and_steadily(integrator, density):
    """Pressing fluid out of a gap of a twentieth of the radius meets far more resistance than moving a single rod."""
    scene = rods.weightless()
    rubber = withe.Material(youngs_modulus=3e6, poisson_ratio=0.5, density=density)
    scene.add_fluid(1.0, regularization=1.02e-3)
    near = [
        scene.add_rod(start=(x, y, 0.0), end=(x, y, -0.2), nodes=41, radius=1e-3, material=rubber)
        for x, y in ((0.0, 0.0), (2.05e-3, 0.0), (1.025e-3, 1.775e-3))
    ]
    for rod in near:
        scene.clamp(rod.start)
    scene.add_load(near[0], (2e-3, 1e-3, 0.0))
    simulation = scene.build(integrator=integrator, time_step=2e-3, planar=False)
    speeds = []
    for _ in range(8):
        simulation.step(25)
        speeds.append(np.abs(np.concatenate([simulation.velocities(rod) for rod in near])).max())
    assert max(speeds) < 1.2e-3
    assert speeds[-1] == pytest.approx(speeds[-2], rel=0.1)
