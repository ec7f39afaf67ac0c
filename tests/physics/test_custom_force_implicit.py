"""Custom forces that are solved for: stiff springs and dampers in time, and equilibria whose place is known."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import expm
from scipy.optimize import brentq

import withe
from cases import measured
from convergence import assert_order, observed_orders

LENGTH, RADIUS, DENSITY = 0.1, 5e-3, 1000.0
MASS = DENSITY * np.pi * RADIUS**2 * LENGTH  # of the bar
SHARES = np.array([0.25, 0.5, 0.25])  # of it at its nodes
IMPLICIT = ("implicit_midpoint", "energy_momentum", "backward_euler", "fourth_order")


def bar(scene, start=(0, 0, 0), nodes=3, modulus=1e7):
    end = np.add(start, (LENGTH, 0, 0))
    material = withe.Material(youngs_modulus=modulus, density=DENSITY)
    return scene.add_rod(start=start, end=end, nodes=nodes, radius=RADIUS, material=material)


def consistent_mass():
    """Consistent mass of a bar of two edges, per direction."""
    return MASS / 12 * np.array([[2.0, 1, 0], [1, 4, 1], [0, 1, 2]])


def oscillator(integrator, time_step, spring, drag=0.0, **options):
    """A bar that moves to and fro along z as a whole, with a spring and a damper as its masses are."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = bar(scene)
    along = np.kron(consistent_mass(), np.diag((0.0, 0, 1)))
    scene.add_custom_force(
        lambda t, x, v: -(spring**2 * along @ x.ravel() + drag * along @ v.ravel()).reshape(-1, 3),
        jacobian=lambda t, x, v: (-(spring**2) * sparse.csr_array(along), -drag * along),
    )
    simulation = scene.build(time_step=time_step, integrator=integrator, **options)
    simulation.check_jacobian()
    simulation.set_velocities(rod, (0, 0, 0.1))
    return rod, simulation


@pytest.mark.parametrize("drag", [0.0, 3.0])
@pytest.mark.parametrize(
    ("integrator", "order"),
    [("implicit_midpoint", 2), ("energy_momentum", 2), ("backward_euler", 1), ("fourth_order", 4)],
)
def test_motion_converges_at_the_order_of_the_scheme(integrator, order, drag):
    """Fourth-order steps too, which extrapolated forces of velocities leave at the second."""
    spring, duration = 10.0, 0.4
    exact = (expm(np.array([[0, 1], [-(spring**2), -drag]]) * duration) @ (0, 0.1))[0]
    errors = []
    for time_step in (4e-2, 2e-2, 1e-2) if integrator == "fourth_order" else (8e-3, 4e-3, 2e-3):
        rod, simulation = oscillator(integrator, time_step, spring, drag, adaptive=False)
        simulation.run(duration, progress=False)
        errors.append(abs(simulation.positions(rod)[1, 2] - exact))
    if order == 4:
        assert (observed_orders(errors) > 3.8).all()
    else:
        assert_order(errors, order=order, slack=0.2)


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("resolution", [0.05, 1.0, 5.0, 50.0])
def test_stiff_spring_keeps_its_energy_at_any_time_step(integrator, resolution):
    """Extrapolated, it would grow without bound from w dt = 2 on."""
    spring = 10.0
    rod, simulation = oscillator(integrator, resolution / spring, spring)
    energy = []
    for _ in range(200):
        simulation.step()
        z, v = simulation.positions(rod)[:, 2], simulation.velocities(rod)[:, 2]
        energy.append(0.5 * (v @ consistent_mass() @ v + spring**2 * z @ consistent_mass() @ z))
    np.testing.assert_allclose(energy, 0.5 * MASS * 0.1**2, rtol=1e-7)
    assert simulation.energy().total == pytest.approx(0.5 * MASS * 0.1**2, rel=1e-7)


@pytest.mark.parametrize("integrator", IMPLICIT)
def test_stiff_damper_stops_a_bar_at_any_time_step(integrator):
    """Midpoint steps leave (1 - r) / (1 + r) of a velocity, r = d dt / 2, fourth-order ones the product of five."""
    drag, time_step = 1e3, 5e-3
    part = 1 / (4 - 4 ** (1 / 3))
    parts = np.array((part, part, 1 - 4 * part, part, part)) if integrator == "fourth_order" else np.ones(1)
    r = 0.5 * drag * time_step * parts
    left = 1 / (1 + drag * time_step) if integrator == "backward_euler" else abs(np.prod((1 - r) / (1 + r)))
    rounding = 1e-13  # of positions, over the step [m/s]
    rod, simulation = oscillator(integrator, time_step, 0.0, drag, adaptive=False)
    before = 0.1
    for _ in range(5):
        simulation.step()
        now = float(np.abs(simulation.velocities(rod)[:, 2]).max())
        assert now == pytest.approx(left * before, rel=1e-6, abs=rounding)
        before = now


def magnet(scene, stiffness, power=3):
    """Pulls every node to z = 0 with stiffness |z|^power: a force that no step knows from the one before."""

    def force(t, x, v):
        out = np.zeros_like(x)
        out[:, 2] = -stiffness * np.sign(x[:, 2]) * np.abs(x[:, 2]) ** power
        return out

    def jacobian(t, x, v):
        return sparse.diags_array(
            np.column_stack([0 * x[:, :2], -stiffness * power * np.abs(x[:, 2:]) ** (power - 1)]).ravel()
        )

    return scene.add_custom_force(force, jacobian=jacobian)


def test_stiff_nonlinear_spring_stays_bounded_and_converges_at_second_order():
    errors, ends = [], []
    for time_step in (2e-3, 1e-3, 5e-4, 6.25e-5):
        scene = withe.Scene(gravity=(0, 0, 0))
        rod = bar(scene)
        magnet(scene, 1e4)
        simulation = scene.build(time_step=time_step)
        simulation.set_velocities(rod, (0, 0, 1.0))
        simulation.run(0.05, progress=False)
        ends.append(simulation.positions(rod)[1, 2])
    errors = [abs(end - ends[-1]) for end in ends[:-1]]
    assert_order(errors, order=2, slack=0.3)


@pytest.mark.case("statics", "Bar on springs that are a custom force", source="k x = m g")
@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("given", [False, True])
def test_spring_and_weight_are_in_balance_at_their_exact_place(given, planar):
    """Nothing else holds the bar; without a jacobian it is found by differences."""
    stiff = 40.0
    scene = withe.Scene()
    rod = bar(scene)
    ground = np.array([(0, 0, 0), (LENGTH / 2, 0, 0), (LENGTH, 0, 0)])
    scene.add_custom_force(
        lambda t, x, v: -stiff * SHARES[:, None] * (x - ground),
        jacobian=(lambda t, x, v: -stiff * np.diag(np.repeat(SHARES, 3))) if given else None,
    )
    simulation = scene.build(integrator="static", planar=planar)
    found = simulation.equilibrium()
    assert found.stability == "stable"
    heights = simulation.positions(rod)[:, 2]
    assert SHARES @ heights == pytest.approx(-9.81 * MASS / stiff, rel=1e-9)
    again = simulation.equilibrium()
    assert again.iterations <= 3
    np.testing.assert_allclose(simulation.positions(rod)[:, 2], heights, rtol=1e-8)


def test_nonlinear_springs_and_weight_are_in_balance():
    """stiffness |z|^3 at each node of a bar so soft that each carries its own weight, a quarter or a half of it all."""
    scene = withe.Scene()
    rod = bar(scene, modulus=1e2)
    scene.pin(rod.start, free=(0, 0, 1))
    magnet(scene, 1e3)
    simulation = scene.build(integrator="static", planar=True)
    assert simulation.equilibrium().stability == "stable"
    z = simulation.positions(rod)[:, 2]
    assert 1e3 * float(np.abs(z**3).sum()) == pytest.approx(9.81 * MASS, rel=1e-7)


@pytest.mark.case("dynamics", "Frequency of two bars on a spring that is a custom force", source="w^2 = 2 k / m")
def test_spring_between_rods_that_share_no_node_gives_their_frequency():
    """Two bars and a spring between their middles: w^2 = 2 k / m, by steps of any length and by linearisation."""
    stiff = 20.0
    scene = withe.Scene(gravity=(0, 0, 0))
    lower, upper = bar(scene), bar(scene, (0, 0, 0.2))
    pairs = [(lower.rows[i], upper.rows[i], stiff * share) for i, share in enumerate(SHARES)]

    def force(t, x, v):
        out = np.zeros_like(x)
        for a, b, k in pairs:
            pull = k * (x[b, 2] - x[a, 2] - 0.2)
            out[a, 2] += pull
            out[b, 2] -= pull
        return out

    def jacobian(t, x, v):
        matrix = sparse.lil_array((x.size, x.size))
        for a, b, k in pairs:
            for i, j, sign in ((a, a, -1), (b, b, -1), (a, b, 1), (b, a, 1)):
                matrix[3 * i + 2, 3 * j + 2] += sign * k
        return matrix.tocsr()

    scene.add_custom_force(force, jacobian=jacobian)
    frequency = np.sqrt(2 * stiff / MASS) / (2 * np.pi)
    simulation = scene.build(time_step=1 / (400 * frequency))
    found = simulation.linearise().frequencies(13)
    measured(np.min(np.abs(np.asarray(found, complex) - frequency)) / frequency)
    assert np.min(np.abs(np.asarray(found, complex) - frequency)) < 1e-3 * frequency
    simulation.set_velocities(upper, (0, 0, 0.01))
    simulation.set_velocities(lower, (0, 0, -0.01))
    simulation.run(0.25 / frequency, progress=False)  # a quarter of a period
    amplitude = 0.01 / (2 * np.pi * frequency)
    assert simulation.positions(upper)[:, 2].mean() - 0.2 == pytest.approx(amplitude, rel=1e-3)
    np.testing.assert_allclose(simulation.momentum().linear, 0, atol=1e-12)


@pytest.mark.case("statics", "Compass needle under its weight", source="balance of moments")
@pytest.mark.parametrize("planar", [False, True])
def test_moments_of_a_compass_needle_balance_its_weight(planar):
    """A stiff bar on a pin, with a moment m t x B for a field along z, against its weight.

    The balance m g L / 2 cos a = m B cos a would hold at any angle, so the field is tilted.
    """
    strength = 3e-2  # N m
    field = np.array((0.3, 0.0, 1.0)) / np.hypot(0.3, 1.0)
    scene = withe.Scene()
    rod = bar(scene, nodes=2, modulus=1e9)
    scene.pin(rod.start)

    def torque(t, x, v):
        tangent = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
        moment = strength * np.cross(tangent, field)
        return np.zeros_like(x), np.stack([0.25 * moment, 0.75 * moment])

    scene.add_custom_force(torque, moments=True)
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    simulation.set(gravity=(0, 0, -9.5))
    simulation.equilibrium()
    simulation.set(gravity=(0, 0, -9.81))
    assert simulation.equilibrium().iterations <= 6  # as of Newton's method with derivatives of the moments
    x = simulation.positions(rod)
    angle = np.arctan2(x[1, 2], x[1, 0])

    def out_of_balance(a):
        tangent = np.array((np.cos(a), 0, np.sin(a)))
        return strength * np.cross(tangent, field)[1] + 0.5 * MASS * 9.81 * LENGTH * np.cos(a)

    assert angle == pytest.approx(brentq(out_of_balance, angle - 0.1, angle + 0.1), abs=1e-6)


def test_custom_moments_are_those_of_add_moment():
    """At a free node, at one between two edges and at a clamp; in steps and at rest, in space."""
    ends = []
    moment, rows = np.array((2e-5, -1e-4, 5e-5)), np.array([0, 2, 5])
    for custom in (False, True):
        scene = withe.Scene(gravity=(0, 0, 0))
        rod = scene.add_rod(
            start=(0, 0, 0),
            end=(LENGTH, 0, 0),
            nodes=6,
            radius=2e-3,
            material=withe.Material(youngs_modulus=1e6, density=DENSITY),
        )
        scene.clamp(rod.start)
        if custom:

            def turn(t, x, v):
                moments = np.zeros_like(x)
                moments[rows] = moment
                return np.zeros_like(x), moments

            scene.add_custom_force(turn, moments=True, jacobian=lambda t, x, v: sparse.csr_array((x.size, x.size)))
        else:
            for row in rows:
                scene.add_moment(rod.node(row), moment)
        simulation = scene.build(time_step=1e-3)
        simulation.step(20)
        moving = simulation.positions(rod)
        work = simulation.energy().loads
        simulation.equilibrium()
        ends.append((moving, work, simulation.positions(rod)))
    np.testing.assert_allclose(ends[1][0], ends[0][0], atol=1e-9)
    assert ends[1][1] == pytest.approx(ends[0][1], rel=1e-6)
    np.testing.assert_allclose(ends[1][2], ends[0][2], atol=1e-8)


def test_a_wrong_jacobian_is_named_by_its_entry():
    scene = withe.Scene()
    bar(scene)

    def wrong(t, x, v):
        matrix = -40.0 * np.eye(x.size)
        matrix[5, 7] = 3.0
        return matrix

    scene.add_custom_force(lambda t, x, v: -40.0 * x, jacobian=wrong, name="spring")
    simulation = scene.build()
    with pytest.raises(
        ValueError, match=r"'spring' must be .* force on node 1 along z by the position of node 2 along y"
    ):
        simulation.check_jacobian("spring")


@pytest.mark.parametrize(
    ("jacobian", "message"),
    [
        (lambda t, x, v: np.eye(3), "jacobian of custom force 'spring' must have"),
        (lambda t, x, v: sparse.eye_array(4), r"'spring' must have the shape \(9, 9\), got \(4, 4\)"),
        (lambda t, x, v: sparse.diags_array([np.nan] * 9), "'spring' must be finite"),
    ],
)
def test_a_jacobian_of_the_wrong_kind_is_named(jacobian, message):
    scene = withe.Scene()
    bar(scene)
    scene.add_custom_force(lambda t, x, v: -40.0 * x, jacobian=jacobian, name="spring")
    simulation = scene.build()
    with pytest.raises(ValueError, match=message):
        simulation.step()
    assert simulation.time == 0.0


def test_snapshot_and_copy_go_on_bit_by_bit():
    rod, simulation = oscillator("implicit_midpoint", 0.05, 10.0)
    simulation.step(3)
    kept, other = simulation.snapshot(), simulation.copy()
    simulation.step(5)
    other.step(5)
    end = simulation.positions(rod)
    np.testing.assert_array_equal(other.positions(rod), end)
    simulation.restore(kept)
    simulation.step(5)
    np.testing.assert_array_equal(simulation.positions(rod), end)


@pytest.mark.parametrize("integrator", ["verlet", "implicit_midpoint"])
def test_linearising_changes_nothing_that_follows(integrator):
    ends = []
    for read in (False, True):
        rod, simulation = oscillator(integrator, 1e-4, 10.0)
        for _ in range(20):
            simulation.step()
            if read:
                simulation.linearise()
        ends.append((*simulation.positions(rod).ravel(), *vars(simulation.energy()).values()))
    np.testing.assert_array_equal(ends[0], ends[1])


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("kind", ["ground", "cubic"])
@pytest.mark.parametrize("seed", range(3))
def test_springs_that_resist_only_elsewhere_hold_a_scene(kind, planar, seed):
    """Ground that a bar falls onto, and springs without stiffness where the bar is drawn."""
    rng = np.random.default_rng([83, seed])
    stiffness, height = 10 ** rng.uniform(1.5, 3.0), rng.uniform(0.0, 0.05)
    scene = withe.Scene(gravity=(0, 0, -9.81))
    rod = bar(scene, start=(0, 0, height if kind == "ground" else 0.0), nodes=9)
    drawn = np.linspace((0.0, 0.0, 0.0), (LENGTH, 0.0, 0.0), 9)

    def force(_t, x, _v):
        if kind == "ground":
            return np.stack([0 * x[:, 0], 0 * x[:, 0], -stiffness * np.minimum(x[:, 2], 0.0)], axis=1)
        stretch = x - drawn
        return -1e6 * stiffness * stretch * (stretch**2).sum(axis=1, keepdims=True)

    def jacobian(_t, x, _v):
        stretch = x - drawn
        if kind == "ground":
            blocks = [-stiffness * (z < 0.0) * np.diag((0.0, 0.0, 1.0)) for z in x[:, 2]]
        else:
            blocks = [-1e6 * stiffness * (d @ d * np.eye(3) + 2.0 * np.outer(d, d)) for d in stretch]
        return sparse.block_diag(blocks, format="csr"), sparse.csr_array((27, 27))

    scene.add_custom_force(force, jacobian=jacobian)
    simulation = scene.build(integrator="static", planar=planar)
    found = simulation.equilibrium()
    assert found.stable
    holding = force(0.0, simulation.positions(rod), None).sum(axis=0)
    np.testing.assert_allclose(holding, (0.0, 0.0, MASS * 9.81), atol=1e-7 * MASS * 9.81)


def test_where_no_equilibrium_is_found_the_error_tells_the_force_that_is_out_of_balance():
    scene = withe.Scene(gravity=(0, 0, -9.81))
    bar(scene)
    scene.add_custom_force(
        lambda t, x, v: 0.0 * x, jacobian=lambda t, x, v: (sparse.csr_array((9, 9)), sparse.csr_array((9, 9)))
    )
    simulation = scene.build(integrator="static")
    with pytest.raises(withe.ConvergenceError, match=r"only custom forces hold.*\(time 0 s, residual") as failure:
        simulation.equilibrium()
    assert failure.value.residual == pytest.approx(0.5 * MASS * 9.81, rel=1e-6)
    assert failure.value.node == 1
