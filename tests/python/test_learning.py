"""Equilibria and runs as torch functions: gradcheck, shapes, and what is refused."""

import itertools
import sys

import numpy as np
import pytest

import withe

TIGHT = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)}
NODES = 7


def drawn(*, planar=False, integrator="backward_euler", viscosity=0.0, drag=None):
    scene = withe.Scene()
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=viscosity)
    s = np.linspace(0.0, 1.0, NODES)
    points = np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)
    arm = scene.add_rod(points=points, radius=1.5e-2, material=material, name="arm")
    scene.clamp(arm.start, name="wall")
    scene.add_force(arm.end, (0, 0, 0.3), name="force")
    if drag is not None:
        scene.add_drag(drag, name="air")
    return scene.build(integrator=integrator, planar=planar or None, adaptive=False, time_step=5e-3, **TIGHT)


def test_without_torch_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ImportError, match=r"needs the package torch.*\[learn\]"):
        withe.learning.equilibrium(drawn(), {"gravity": None})


@pytest.mark.parametrize("planar", [True, False])
def test_gradcheck_of_a_rollout(planar):
    torch = pytest.importorskip("torch")
    sim = drawn(planar=planar)
    arm, random = sim["arm"], np.random.default_rng(1)
    start = sim.positions()
    push = random.normal(size=(NODES, 3))
    push[:1] = 0.0
    if planar:
        push[:, 1] = 0.0
    plane = torch.tensor([1.0, 0.0, 1.0] if planar else [1.0, 1.0, 1.0], dtype=torch.float64)
    curved = torch.tensor(sim.get(arm, "natural_curvature"))

    def of(modulus, curvature, force, velocity, place):
        values = {
            (arm, "youngs_modulus"): 1e6 * modulus,
            (arm, "natural_curvature"): curvature * curved,
            (sim["force"], "force"): force * plane,
            "initial_velocities": velocity * torch.tensor(push),
            "initial_positions": torch.tensor(start) + 0.01 * place * torch.tensor(push),
        }
        x, v = withe.learning.rollout(sim, values, 0.02, 0.01, of=("positions", "velocities"))
        return 10.0 * x[1:], v[1:]

    inputs = [
        torch.tensor(value, dtype=torch.float64, requires_grad=True)
        for value in (1.1, [[1.2, 1.2]], [0.01, 0.0, 0.2], 0.3, 0.1)
    ]
    assert torch.autograd.gradcheck(of, inputs, eps=1e-4, atol=2e-6, rtol=1e-6)
    np.testing.assert_array_equal(sim.positions(), start)


@pytest.mark.parametrize("planar", [True, False])
def test_gradcheck_of_an_equilibrium(planar):
    torch = pytest.importorskip("torch")
    sim = drawn(planar=planar)
    sim.equilibrium()
    arm, wall = sim["arm"], sim["wall"]

    def of(modulus, density, gravity, place):
        down = torch.tensor([0.0, 0.0, -9.81], dtype=torch.float64)
        along = torch.tensor([1.0, 0.0, 0.5], dtype=torch.float64)
        values = {
            (arm, "youngs_modulus"): 1e6 * modulus,
            (arm, "density"): 1200.0 * density,
            "gravity": gravity * down,
            (wall, "position"): place * along,
        }
        return withe.learning.equilibrium(sim, values)

    inputs = [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in (1.1, 0.9, 1.05, 0.01)]
    assert torch.autograd.gradcheck(of, inputs, eps=1e-4, atol=1e-7, rtol=1e-6)


DRAWN = {  # of a rod with drag, each a number that is not what its material or others make of it
    ("arm", "youngs_modulus"): 1.1e6,
    ("arm", "poisson_ratio"): 0.3,
    ("arm", "density"): 1100.0,
    ("arm", "viscosity"): 3e4,
    ("arm", "stretch_stiffness"): 800.0,
    ("arm", "bend_stiffness"): [0.035, 0.05],
    ("arm", "twist_stiffness"): 0.025,
    ("arm", "line_density"): 0.9,
    ("arm", "viscous_time"): 0.02,
    ("arm", "drag"): [0.4, 0.5, 0.6, 0.5, 0.4, 0.3],
    ("arm", "natural_curvature"): [0.3, -0.5],
    ("arm", "natural_twist"): 0.4,
    ("arm", "natural_stretch"): 0.97,
    ("air", "drag"): 0.8,
    ("force", "force"): [0.1, 0.05, 0.2],
    "gravity": [0.5, 1.0, -9.0],
}
OF_MOTION = {("arm", "viscosity"), ("arm", "viscous_time"), ("arm", "drag"), ("air", "drag")}


def directional(of, values, direction, size=1e-4):
    """Derivative of a function of values as each changes by its own share, by central differences."""
    torch = pytest.importorskip("torch")
    ends = [{key: values[key] * (1.0 + side * size * direction[key]) for key in values} for side in (1.0, -1.0)]
    with torch.no_grad():
        return float(of(ends[0]) - of(ends[1])) / (2.0 * size)


@pytest.mark.parametrize("runs", [False, True])
def test_gradients_by_any_two_values_are_those_of_differences_whichever_is_named_first(runs):
    torch = pytest.importorskip("torch")
    sim = drawn(viscosity=2e4, drag=0.5)
    random = np.random.default_rng(3)
    weights = torch.tensor(random.normal(size=(NODES, 3)))

    def of(values):
        if runs:
            return (weights * withe.learning.rollout(sim, values, 0.05)[-1]).sum()
        return (weights * withe.learning.equilibrium(sim, values)).sum()

    for pair in itertools.combinations([key for key in DRAWN if runs or key not in OF_MOTION], 2):
        values = {key: torch.tensor(DRAWN[key], dtype=torch.float64, requires_grad=True) for key in pair}
        found = []
        for named in (values, dict(reversed(values.items()))):
            value = of(named)
            found.append((float(value.detach()), *torch.autograd.grad(value, list(values.values()))))
        assert all(torch.equal(one, other) for one, other in zip(found[0][1:], found[1][1:], strict=True)), pair
        assert found[0][0] == found[1][0]
        for key, gradient in zip(pair, found[0][1:], strict=True):
            way = {each: float(each == key) for each in pair}
            slope = float((gradient * values[key].detach()).sum())
            assert slope == pytest.approx(directional(of, values, way), rel=1e-4, abs=1e-8), (pair, key)


def test_a_value_that_is_named_twice_is_refused():
    torch = pytest.importorskip("torch")
    sim = drawn()
    modulus = torch.tensor(1e6, dtype=torch.float64)
    with pytest.raises(ValueError, match="'youngs_modulus' of 'arm' is given twice"):
        withe.learning.equilibrium(sim, {(sim["arm"], "youngs_modulus"): modulus, ("arm", "youngs_modulus"): modulus})


def test_only_what_needs_a_gradient_has_one_and_losses_may_leave_the_plane():
    torch = pytest.importorskip("torch")
    sim = drawn(planar=True)
    modulus = torch.tensor(1e6, dtype=torch.float64, requires_grad=True)
    gravity = torch.tensor([0.0, 0.0, -9.81], dtype=torch.float64)
    values = {(sim["arm"], "youngs_modulus"): modulus, "gravity": gravity}
    x = withe.learning.rollout(sim, values, 0.02)
    assert x.shape == (len(sim.copy().run(0.02, progress=False).times), NODES, 3)
    (x + 1.0).pow(2).sum().backward()
    assert modulus.grad.shape == ()
    assert modulus.grad != 0.0
    assert gravity.grad is None
    assert not withe.learning.rollout(sim, {"gravity": gravity}, 0.02).requires_grad


def test_what_is_no_tensor_of_float64_is_refused():
    torch = pytest.importorskip("torch")
    sim = drawn()
    arm = sim["arm"]
    double = torch.tensor(1e6, dtype=torch.float64)
    for values, message in (
        ({(arm, "youngs_modulus"): double.float()}, r"must be float64.*double\(\)"),
        ({(arm, "youngs_modulus"): 1e6}, "must be a torch.Tensor"),
        ({}, "must map"),
        ({(arm, "colour"): double}, "colour"),
        ({"colour": double}, "values must not hold 'colour'"),
        ({(sim["wall"], "position"): double}, "a rollout does not take 'position' of a support"),
        ({"initial_positions": torch.tensor(sim.positions() + 1.0)}, "a support holds"),
    ):
        with pytest.raises(ValueError, match=message):
            withe.learning.rollout(sim, values, 0.02)
    with pytest.raises(ValueError, match="a support has position"):
        withe.learning.equilibrium(sim, {(sim["wall"], "rotation"): double})
    with pytest.raises(ValueError, match="of must be"):
        withe.learning.rollout(sim, {(arm, "youngs_modulus"): double}, 0.02, of="colours")
    with pytest.raises(ValueError, match=r"must be a withe\.Simulation"):
        withe.learning.equilibrium(arm, {(arm, "youngs_modulus"): double})
