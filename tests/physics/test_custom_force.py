"""Custom forces: an oscillator and a charge in a magnetic field, whose motions are known."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import expm

import withe
from convergence import assert_order

SPRING, DRAG, FIELD = 10.0, 3.0, 5.0  # w [rad/s], d [1/s], b [1/s]: y'' = -d y' + b z', z'' = -w^2 z - d z' - b y'
LENGTH, RADIUS, DENSITY = 0.1, 5e-3, 1000.0
STEPS = {"verlet": (4e-4, 2e-4, 1e-4), "fourth_order": (2e-2, 1e-2, 5e-3)}
STIFF = 200.0  # [rad/s], where steps that it bounds are short
MASS = DENSITY * np.pi * RADIUS**2 * LENGTH / 4 * np.array([1.0, 2.0, 1.0])[:, None]


def bar(scene):
    material = withe.Material(youngs_modulus=1e5, density=DENSITY)
    return scene.add_rod(start=(0, 0, 0), end=(LENGTH, 0, 0), nodes=3, radius=RADIUS, material=material)


def oscillator(integrator, time_step, drag=0.0, field=0.0, spring=SPRING):
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = bar(scene)

    def force(time, positions, velocities):
        push = -(spring**2) * positions * (0, 0, 1) - drag * velocities + field * np.cross(velocities, (1.0, 0, 0))
        return MASS * push

    scene.add_custom_force(force)
    simulation = scene.build(time_step=time_step, integrator=integrator, adaptive=False)
    simulation.set_velocities(rod, (0, 0, 0.1))
    return rod, simulation


@pytest.mark.parametrize(("drag", "field"), [(0.0, 0.0), (DRAG, 0.0), (0.0, FIELD)])
@pytest.mark.parametrize(
    ("integrator", "order"),
    [("implicit_midpoint", 2), ("energy_momentum", 2), ("fourth_order", 4), ("verlet", 2), ("backward_euler", 1)],
)
def test_motion_under_a_custom_force_converges_at_the_order_of_the_scheme(integrator, order, drag, field):
    """Forces of velocities are extrapolated to the middle of a step, which leaves fourth-order steps the second."""
    rates = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 0, -drag, field], [0, -(SPRING**2), -field, -drag]])
    duration = 0.4
    exact = (expm(rates * duration) @ (0, 0, 0, 0.1))[:2]
    errors = []
    for time_step in STEPS.get(integrator, (4e-3, 2e-3, 1e-3)):
        rod, simulation = oscillator(integrator, time_step, drag, field)
        simulation.run(duration, progress=False)
        errors.append(np.linalg.norm(simulation.positions(rod)[1, 1:] - exact))
    if integrator == "fourth_order" and (drag or field):
        order = 2
    assert_order(errors, order=order, slack=0.2)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("resolution", [0.05, 0.5, 1.1])
def test_spring_neither_feeds_an_oscillation_nor_takes_from_it(integrator, resolution):
    """x0 + (dt / 2) v0 gives a matrix of determinant 1 and trace 2 - (w dt)^2, so that
    x^2 + (1 - (w dt)^2 / 4) (v / w)^2 stays as it is, up to w dt = 2. A bar of two edges whose
    nodes go to and fro has a third of its mass, so up to 2 / sqrt(3)."""
    rod, simulation = oscillator(integrator, resolution / STIFF, spring=STIFF)
    kept = []
    for _ in range(400):
        simulation.step()
        z, v = simulation.positions(rod)[1, 2], simulation.velocities(rod)[1, 2]
        kept.append(z**2 + (1 - resolution**2 / 4) * (v / STIFF) ** 2)
    np.testing.assert_allclose(kept, kept[0], rtol=1e-6)


def test_spring_is_stable_for_backward_euler_up_to_its_bound():
    """The matrix at the predicted end of a step has the determinant 1 - a and the trace 2 (1 - a), with a = (w dt)^2.

    The step is stable for a < 4 / 3, or 4 / 9 for the mode in which nodes alternate.
    """
    rod, simulation = oscillator("backward_euler", 0.6 / STIFF, spring=STIFF)
    simulation.step(100)
    assert abs(simulation.positions(rod)[1, 2]) < 1e-6


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "verlet"])
def test_custom_force_is_asked_for_the_state_at_which_it_acts(integrator):
    """A node that falls freely in a step of dt: at its middle, or at its end, with a support that moves."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = bar(scene)
    hand = scene.pin(rod.start)
    seen = []
    scene.add_custom_force(lambda *now: seen.append(now) or np.zeros((3, 3)))
    time_step = 1e-4
    simulation = scene.build(time_step=time_step, integrator=integrator)
    simulation.move(hand, position=(0, 0, 1e-4), over=1e-2)
    simulation.step(10)
    time, positions, velocities = seen[-1]
    part = 1.0 if integrator == "verlet" else 0.5
    assert time == pytest.approx((9 + part) * time_step)
    assert positions[0, 2] == pytest.approx((9 + part) * time_step * 1e-2)
    assert velocities[0, 2] == pytest.approx(1e-2)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "verlet"])
def test_work_of_a_spring_is_what_it_stored(integrator):
    rod, simulation = oscillator(integrator, 4e-4 if integrator == "verlet" else 2e-3)
    simulation.step(500)
    z, v = simulation.positions(rod)[:, 2], simulation.velocities(rod)[:, 2]
    stored = 0.5 * SPRING**2 * float(MASS[:, 0] @ z**2)
    assert simulation.energy().loads == pytest.approx(stored, rel=2e-3)
    assert simulation.energy().total == pytest.approx(0.5 * MASS.sum() * 0.1**2, rel=1e-5)
    assert stored + 0.5 * float(MASS[:, 0] @ v**2) == pytest.approx(0.5 * MASS.sum() * 0.1**2, rel=2e-3)


def test_error_in_a_custom_force_leaves_the_state_as_it_was():
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = bar(scene)
    hand = scene.pin(rod.start)

    def force(time, positions, velocities):
        if time > 0.01:
            raise ZeroDivisionError("magnet")
        return np.zeros((3, 3))

    scene.add_custom_force(force)
    simulation = scene.build(time_step=5e-3)
    simulation.move(hand, position=(0, 0, 1e-3), over=1.0)
    with pytest.raises(ZeroDivisionError, match="magnet"):
        simulation.step(10)
    assert simulation.time == pytest.approx(0.01)
    assert simulation.positions(rod)[0, 2] == pytest.approx(1e-5)


@pytest.mark.parametrize("kind", ["load", "custom"])
def test_functions_that_stay_in_a_plane_are_taken_there_and_others_named(kind):
    """A bar on a pin in the plane normal to y, pulled along x; then out of the plane."""
    ends = []
    for planar in (True, False):
        scene = withe.Scene()
        rod = scene.add_rod(
            start=(0, 0, 0),
            end=(0.1, 0, 0),
            nodes=3,
            radius=RADIUS,
            material=withe.Material(youngs_modulus=1e7, density=1e3),
        )
        scene.pin(rod.start)

        def pull(t, planar=planar):
            return (0.0, 1e-3 if t > 0.02 and planar else 0.0, 0.01 * np.sin(30.0 * t))

        if kind == "load":
            scene.add_force(rod.end, pull, name="wind")
        else:
            scene.add_custom_force(lambda t, x, v, pull=pull: np.array([(0, 0, 0), (0, 0, 0), pull(t)]), name="wind")
        simulation = scene.build(time_step=5e-3, planar=planar)
        assert simulation.plan.planar == planar
        simulation.step(4)
        ends.append(simulation.positions(rod))
        if planar:
            with pytest.raises(ValueError, match=r"'wind' at t = .* must stay in the plane"):
                simulation.step()
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


@pytest.mark.parametrize("stiffness", [0.0, 1e-4, 10.0])
def test_a_free_rod_rests_where_a_custom_force_holds_it_and_is_refused_at_once_where_none_does(stiffness):
    asked = []
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(
        start=(0, 0, 0), end=(0.2, 0, 0), nodes=6, radius=5e-3, material=withe.Material(youngs_modulus=1e6, density=1e3)
    )

    def pull(time, positions, velocities):
        asked.append(time)
        return np.array([0.0, 0.0, 1e-3]) - stiffness * (positions - [[x, 0.0, 0.0] for x in np.linspace(0, 0.2, 6)])

    scene.add_custom_force(pull)
    simulation = scene.build()
    if stiffness:
        simulation.equilibrium()
        assert simulation.positions(rod)[:, 2] == pytest.approx(1e-3 / stiffness, rel=1e-6)
    else:
        with pytest.raises(withe.ConvergenceError, match="no support holds the scene"):
            simulation.equilibrium()
        assert len(asked) < 100


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("hold", ["frame", "edge", "pins", "hand"])
def test_reactions_of_an_equilibrium_carry_the_custom_force_of_its_own_place(hold, given):
    """On held nodes too, at once, and step for step where supports move."""
    stiffness, nodes = 1.0, 11
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.4, density=1100.0)
    rod = scene.add_rod(start=(0, 0, 0.02), end=(0.2, 0, 0.02), nodes=nodes, radius=4e-3, material=rubber)
    if hold == "pins":
        supports = [scene.pin(rod.start), scene.pin(rod.end)]
    elif hold == "hand":
        supports = [scene.grasp(rod, at=0.1, length=0.05)]
    else:
        supports = [scene.clamp(rod.start, hold=hold)]
    pull = -stiffness * np.diag([0.0, 0.0, 1.0])
    slope = sparse.kron(sparse.identity(nodes), pull)
    jacobian = (lambda time, positions, velocities: slope) if given else None
    scene.add_custom_force(lambda time, positions, velocities: positions @ pull, jacobian=jacobian)
    simulation = scene.build(integrator="static", time_step=0.1)

    def out_of_balance():
        borne = sum(simulation.reaction(support).force[2] for support in supports)
        return borne - stiffness * simulation.positions(rod)[:, 2].sum()

    found = simulation.equilibrium()
    assert found.residual < 1e-9
    assert abs(out_of_balance()) < 1e-9
    for support in supports:
        simulation.move(support, position=simulation.get(support, "position") + np.array((0, 0, 0.02)), over=0.3)
    for _ in range(3):
        simulation.step(1)
        assert abs(out_of_balance()) < 1e-9
