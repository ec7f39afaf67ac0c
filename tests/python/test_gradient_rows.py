"""Jacobians by one solve for each unknown, against gradients by the adjoint method and against differences."""

import numpy as np
import pytest

import withe

TIGHT = {"solver": withe.Solver(force_tolerance=1e-11, step_tolerance=1e-11)}


def drawn(seed, planar, joint):
    """Two rods in a row, that a clamp or a hand and gravity, a force, a mass, a spring and a tendon bend."""
    random = np.random.default_rng(seed)
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=random.uniform(1e6, 4e6), density=1100.0)
    middle = np.array([0.2, 0.0, random.uniform(-0.05, 0.05)])
    arm = scene.add_rod(
        start=(0, 0, 0), end=middle, nodes=14, radius=5e-3, material=rubber, normal=(0, 1, 0), name="arm"
    )
    tip = scene.add_rod(
        start=middle, end=middle + np.array([0.15, 0.0, 0.0]), nodes=11, radius=4e-3, material=rubber, name="tip"
    )
    if joint == "revolute":
        scene.join(arm.end, tip.start, kind="revolute", axis=(0, 1, 0), stiffness=0.05, name="joint")
    else:
        scene.join(arm.end, tip.start)
    if seed % 2:
        scene.clamp(arm.start, name="wall")
    else:
        scene.grasp(arm, 0.03, 0.04, name="wall")
    aside = 0.0 if planar else 0.01
    scene.add_force(tip.end, (0.01, aside, 0.02), name="force")
    scene.add_mass(arm.end, 2e-3, name="mass")
    scene.add_tendon(arm, offset=(0, 3e-3), name="tendon")
    simulation = scene.build(integrator="static", planar=planar, **TIGHT)
    simulation.set("tendon", tension=0.3)
    return simulation


UNKNOWNS = [
    ("wall", "position"),
    ("wall", "rotation"),
    ("tendon", "tension"),
    ("mass", "mass"),
    ("arm", "youngs_modulus"),
    ("tip", "density"),
]


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("joint", ["rigid", "revolute"])
def test_jacobians_of_all_nodes_agree_with_adjoint_gradients(planar, joint):
    for seed in range(4):
        simulation = drawn(seed, planar, joint)
        rest = simulation.equilibrium()
        unknowns = UNKNOWNS if planar else [*UNKNOWNS, ("force", "force"), "gravity"]
        jacobian = [rest.jacobian(rod, unknowns) for rod in ("arm", "tip")]
        weights = np.random.default_rng(seed).normal(size=simulation.positions().shape)
        weights *= (1, 0, 1) if planar else 1
        once = weights.copy()
        once[len(simulation.positions("arm")) - 1] = 0.0  # of both rods
        found = rest.gradient(once, unknowns)
        rows = [
            weights[: len(simulation.positions("arm"))].copy(),
            weights[len(simulation.positions("arm")) - 1 :].copy(),
        ]
        rows[0][-1] = rows[1][0] = 0.0
        for place, expected in enumerate(found):
            got = sum(np.tensordot(own, of[place], 2) for own, of in zip(rows, jacobian, strict=True))
            np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_a_jacobian_by_few_numbers_is_that_of_differences():
    simulation = drawn(1, False, "rigid")
    by_force, by_modulus = simulation.equilibrium().jacobian("tip", [("force", "force"), ("arm", "youngs_modulus")])
    for value, step, column in (
        ({"target": "force", "word": "force"}, np.array([0.0, 1e-5, 0.0]), by_force[:, :, 1]),
        ({"target": "arm", "word": "youngs_modulus"}, 10.0, by_modulus),
    ):
        now, ends = simulation.get(value["target"], value["word"]), []
        for sign in (1.0, -1.0):
            simulation.set(value["target"], **{value["word"]: now + sign * step})
            simulation.equilibrium()
            ends.append(simulation.positions("tip"))
        simulation.set(value["target"], **{value["word"]: now})
        found = (ends[0] - ends[1]) / (2.0 * np.max(step))
        np.testing.assert_allclose(column, found, atol=1e-5 * np.abs(found).max())


def test_a_modulus_that_was_set_before_a_stiffness_keeps_its_derivative():
    simulation = drawn(1, False, "rigid")
    simulation.set("arm", bend_stiffness=2.0 * simulation.get("arm", "bend_stiffness"))
    rest = simulation.equilibrium()
    jacobian = rest.jacobian("arm", [("arm", "youngs_modulus")])[0]
    weights = np.zeros_like(simulation.positions())
    weights[5, 2] = 1.0
    assert jacobian[5, 2] == pytest.approx(rest.gradient(weights, [("arm", "youngs_modulus")])[0], rel=1e-9)
