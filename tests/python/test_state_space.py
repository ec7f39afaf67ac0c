"""One step as a map between states that are vectors, against closed forms, invariants and differences."""

import numpy as np
import pytest
from scipy.sparse import issparse

import withe

TIGHT = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)}
NODES = 9


def drawn(*, planar, integrator, joint=False, support="frame", drag=0.0, viscosity=0.0, **options):
    """A curved arm, perhaps with a branch."""
    scene = withe.Scene()
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=viscosity)
    s = np.linspace(0.0, 1.0, NODES)
    points = np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)
    arm = scene.add_rod(points=points, radius=1.5e-2, material=material, name="arm")
    if support == "pin":
        scene.pin(arm.start, free=(1, 0, 1) if not planar else (1, 0, 0))
    elif support:
        scene.clamp(arm.start, hold=support)
    if joint:
        tip = points[5] + [0.02, 0.0 if planar else 0.1, 0.1]
        branch = scene.add_rod(start=points[5], end=tip, nodes=4, radius=1e-2, material=material)
        scene.join(arm.node(5), branch.start)
    if drag:
        scene.add_drag(drag)
    scene.add_force(arm.end, (0, 0, 0.3), name="force")
    return scene.build(integrator=integrator, planar=planar or None, **{"time_step": 2e-3, **TIGHT, **options})


def shaken(simulation, size=0.1, seed=1):
    """The state somewhere else, and in motion."""
    random = np.random.default_rng(seed)
    count = len(simulation.state_difference(simulation.copy()))
    scale = np.repeat([0.02 * size, 20.0 * size], count // 2)
    simulation.displace_state(scale * random.normal(size=count))


def differences(simulation, inputs=()):
    """The step's Jacobian by extrapolated central differences; `inputs` are (change, size)."""
    reached = simulation.copy()
    reached.step()
    count = len(simulation.state_difference(simulation))

    def along(change, size):
        def central(h):
            ends = []
            for sign in (1.0, -1.0):
                other = simulation.copy()
                change(other, sign * h)
                other.step()
                ends.append(other.state_difference(reached))
            return (ends[0] - ends[1]) / (2.0 * h)

        return (4.0 * central(0.5 * size) - central(size)) / 3.0

    columns = []
    for i in range(count):
        direction = np.eye(count)[i]
        size = 1e-4 if i < count // 2 else 1e-2
        columns.append(along(lambda other, h, d=direction: other.displace_state(h * d), size))
    return np.stack(columns, 1), [along(change, size) for change, size in inputs]


@pytest.mark.parametrize("support", [None, "frame", "edge", "pin"])
@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "fourth_order", "energy_momentum"])
def test_the_jacobian_of_a_step_is_that_of_differences(integrator, planar, joint, support):
    viscosity = 0.0 if integrator == "fourth_order" else 100.0
    sim = drawn(
        planar=planar,
        integrator=integrator,
        joint=joint,
        support=support,
        drag=0.1,
        viscosity=viscosity,
        adaptive=False,
    )
    shaken(sim)
    arm = sim["arm"]
    A, B = sim.step_jacobian([(arm, "youngs_modulus"), (sim["force"], "force"), "gravity"])
    assert issparse(A)
    assert issparse(B)
    found, inputs = differences(
        sim,
        [
            (lambda other, h: other.set(other["arm"], youngs_modulus=1e6 + h), 1e3),
            (lambda other, h: other.set(other["force"], force=(0, 0, 0.3 + h)), 1e-2),
            (lambda other, h: other.set(gravity=(0, 0, -9.81 + h)), 1e-1),
        ],
    )
    half = len(found) // 2
    weigh = np.repeat([1.0, sim.time_step], half)
    even = weigh[:, None] * (A.toarray() - found) / weigh[None, :]
    assert np.abs(even).max() < 2e-6 * np.abs(weigh[:, None] * found / weigh).max()
    for column, expected in zip((0, 3, 6), inputs, strict=True):
        np.testing.assert_allclose(
            weigh * B.toarray()[:, column], weigh * expected, rtol=0, atol=2e-6 * np.abs(weigh * expected).max()
        )


@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint"])
def test_at_an_equilibrium_the_jacobian_is_that_of_the_linear_equations(integrator, planar, joint):
    sim = drawn(planar=planar, integrator=integrator, joint=joint)
    sim.equilibrium()
    linear = sim.linearise()
    K, M, h = linear.stiffness, linear.mass, sim.time_step
    one = np.eye(len(K))
    if integrator == "backward_euler":
        velocity = np.linalg.solve(M + h * h * K, np.hstack([-h * K, M]))
        position = np.hstack([one, 0 * one]) + h * velocity
    else:
        velocity = np.linalg.solve(M + 0.25 * h * h * K, np.hstack([-h * K, M - 0.25 * h * h * K]))
        position = np.hstack([one, 0.5 * h * one]) + 0.5 * h * velocity
    weigh = np.repeat([1.0, h], len(K))
    A, B = sim.step_jacobian(["gravity"])
    expected = np.vstack([position, velocity])
    assert np.abs(weigh[:, None] * (A.toarray() - expected) / weigh).max() < 1e-10
    # The derivative by a force on a node takes a forward solve.
    A, B = sim.step_jacobian([(sim["force"], "force")])
    node = sim.positions(sim["arm"]).shape[0] - 1
    at_tip = linear.displacement[3 * node : 3 * node + 3].T
    rate = np.linalg.solve(M + (1.0 if integrator == "backward_euler" else 0.25) * h * h * K, h * at_tip)
    moved = (1.0 if integrator == "backward_euler" else 0.5) * h * rate
    np.testing.assert_allclose(B.toarray(), np.vstack([moved, rate]), rtol=0, atol=1e-10 * np.abs(rate).max())


@pytest.mark.parametrize("support", [None, "frame"])
def test_a_midpoint_step_in_a_plane_is_symplectic(support):
    sim = drawn(planar=True, integrator="implicit_midpoint", support=support, adaptive=False, time_step=5e-3)
    shaken(sim)
    A = sim.step_jacobian()[0].toarray()
    M = sim.linearise().mass
    zero = np.zeros_like(M)
    form = np.block([[zero, M], [-M, zero]])
    scale = np.repeat([1.0, sim.time_step], len(M))
    weighed = np.outer(scale, scale) * (A.T @ form @ A - form)
    assert np.abs(weighed).max() < 1e-10 * np.abs(np.outer(scale, scale) * form).max()


@pytest.mark.parametrize("planar", [True, False])
def test_displacing_a_state_and_taking_differences_are_inverse(planar):
    sim = drawn(planar=planar, integrator="implicit_midpoint", joint=True)
    sim.run(0.05, progress=False)
    before = sim.copy()
    np.testing.assert_allclose(sim.state_difference(before), 0.0, atol=1e-15)
    by = np.random.default_rng(2).normal(size=len(sim.state_difference(before)))
    by[: len(by) // 2] *= 0.01
    sim.displace_state(by)
    np.testing.assert_allclose(sim.state_difference(before), by, rtol=0, atol=1e-13 * np.abs(by).max())
    moved = (sim.positions() - before.positions()).ravel()
    displacement = sim.linearise().displacement
    np.testing.assert_allclose(displacement @ by[: len(by) // 2], moved, atol=1e-15)
    np.testing.assert_allclose(
        displacement @ by[len(by) // 2 :], (sim.velocities() - before.velocities()).ravel(), atol=1e-13
    )


def test_asking_for_a_step_jacobian_leaves_the_simulation_as_it_was():
    sims = [drawn(planar=False, integrator="implicit_midpoint", joint=True) for _ in range(2)]
    for sim in sims:
        sim.run(0.02, progress=False)
    sims[0].step_jacobian([(sims[0]["arm"], "natural_curvature")])
    for sim in sims:
        sim.step(5)
    np.testing.assert_array_equal(sims[0].positions(), sims[1].positions())


@pytest.mark.parametrize("nothing", [(), []])
def test_a_jacobian_by_nothing_that_acts_has_no_columns(nothing):
    sim = drawn(planar=True, integrator="backward_euler")
    A, B = sim.step_jacobian(nothing)
    assert B.shape == (A.shape[0], 0)
    np.testing.assert_array_equal(A.toarray(), sim.step_jacobian()[0].toarray())


def test_loads_that_vary_with_time_act_as_they_do_in_the_step():
    found = []
    for force in ((0, 0, 0.5), lambda t: (0, 0, 0.5 * t / 3e-3)):
        sim = drawn(planar=True, integrator="implicit_midpoint")
        sim.step()  # of 2 ms; the middle of the next one is at 3 ms
        sim.set(sim["force"], force=force)
        found.append(sim.step_jacobian([(sim["arm"], "youngs_modulus")]))
    for matrix, same in zip(*found, strict=True):
        np.testing.assert_allclose(matrix.toarray(), same.toarray(), rtol=1e-12, atol=1e-12 * abs(same).max())


def test_what_is_no_state_vector_is_refused():
    sim = drawn(planar=True, integrator="implicit_midpoint")
    other = drawn(planar=True, integrator="implicit_midpoint", support="edge")
    count = len(sim.state_difference(sim))
    positions = sim.positions()
    for call, message in (
        (lambda: sim.displace_state(np.zeros(3)), "numbers, got 3"),
        (lambda: sim.displace_state(np.full(count, np.nan)), "finite"),
        (lambda: sim.state_difference(np.zeros(3)), "must be a copy"),
        (lambda: sim.state_difference(other), "same supports"),
        (lambda: sim.step_jacobian(["initial_positions"]), "wrt must not hold initial states"),
        (lambda: sim.step_jacobian([(sim["arm"], "colour")]), "no 'colour'"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    np.testing.assert_array_equal(sim.positions(), positions)
