"""Stability of poses that lay a straight line: of the continuum, of the rod engine, and by a disturbance.

Units: Lgb, w, EI = 2, GJ = 4/3.
"""

import numpy as np
import pytest

import withe
from cases import measured, measured_order
from withe.deployment import StraightLine, grasp
from withe.deployment.grasping import table

STRETCH, STIFF = 1e5, 1e8
DISTURBANCE = 2e-3  # [Lgb] of the jaw across the plane
SNAP = 0.1  # [Lgb] that only a rod that snaps moves by then


def hanging(points, planar=False, stretch=STRETCH):
    """A rod that is straight where nothing acts on it, drawn along points and held at both ends."""
    scene = withe.Scene(gravity=(0, 0, -1))
    stiffness = withe.Stiffness(stretch=2 * stretch, bend=(2.0, 2.0), twist=4.0 / 3.0)
    rod = scene.add_rod(points=points, stiffness=stiffness, line_density=1.0, radius=1e-3, normal=(0, 1, 0))
    held = [scene.clamp(node) for node in (rod.start, rod.end)]
    simulation = scene.build(integrator="static", planar=planar)
    simulation.set(rod, natural_curvature=(0.0, 0.0))
    return simulation, rod, held


def stable_in_the_engine(points):
    """Sign of the least eigenvalue in space, at the equilibrium in the plane that the points come from."""
    flat, rod, _ = hanging(points, planar=True)  # what is drawn has no tension yet
    flat.equilibrium()
    settled = flat.positions(rod)
    if np.abs(settled - points).max() > 0.1:
        return False  # it has left a saddle within the plane
    simulation, rod, _ = hanging(points)
    simulation.set_state(rod, settled)
    return bool(simulation.linearise().frequencies(1)[0] > 0.0)


def laid(suspended, curvature, nodes):
    """A rod held where a grasp says, with the grasp's tangents at both ends."""
    from scipy.interpolate import make_interp_spline

    rows = table().points(suspended, curvature, 2 * STIFF, 0.0)
    curve = make_interp_spline(rows[:, 0], rows[:, 1:4], k=7)
    ends = [0.0, suspended]
    simulation, rod, held = hanging(curve(np.linspace(*ends, nodes)), stretch=STIFF)
    for support, s in zip(held, ends, strict=True):
        simulation.move(support, tangent=curve(s, 1))
    assert simulation.equilibrium().stable
    return simulation, rod, held


def drawn_poses(suspended, count, seed):
    """Positions of jaws all over the region, and the pose of each."""
    line = StraightLine(suspended, STRETCH)
    random = np.random.default_rng(seed)
    angle, reach = random.uniform(0.2, 2.6, 6 * count), suspended * random.uniform(0.3, 1.0, 6 * count)
    pose = line.pose(reach * np.cos(angle), reach * np.sin(angle))
    rows = np.flatnonzero(pose.valid)[:count]
    assert len(rows) == count
    return line, pose, rows


@pytest.mark.case(
    "planners", "Stability of 50 poses of a straight line", source="conjugate points of the continuum", exact=True
)
@pytest.mark.parametrize(("suspended", "seed"), [(5.0, 1), (8.0, 2)])
def test_the_engines_hessian_and_a_disturbance_agree_with_the_continuum_on_25_poses(suspended, seed):
    line, pose, rows = drawn_poses(suspended, 25, seed)
    by_hessian, by_push = [], []
    for row in rows:
        points = line.points(pose.x[row], pose.z[row])
        by_hessian.append(stable_in_the_engine(points))
        simulation, rod, _ = hanging(points)
        simulation.move(rod.end, position=points[-1] + [0.0, DISTURBANCE, 0.0])
        simulation.equilibrium()
        by_push.append(np.abs(simulation.positions(rod) - points).max() < SNAP)
    stable = pose.stable[rows]
    assert 3 < stable.sum() < 25  # both kinds are there
    np.testing.assert_array_equal(by_hessian, stable)
    np.testing.assert_array_equal(by_push, stable)


def test_the_folded_optimum_snaps_and_the_gentle_one_does_not():
    # Figure 9.5, at the suspended length of the dissertation.
    line = StraightLine(17.68, STRETCH)
    assert line.gentle.stable
    assert not line.folded.stable
    for pose in (line.gentle, line.folded):
        points = line.points(pose.x, pose.z)
        simulation, rod, _ = hanging(points)
        simulation.move(rod.end, position=points[-1] + [0.0, 0.12, 0.0])
        simulation.equilibrium()
        moved = np.abs(simulation.positions(rod)[:, 1]).max()
        assert (moved < 0.2) == pose.stable


@pytest.mark.case("planners", "Force of the rod engine at a planned grasp", source="Kirchhoff's equations")
def test_the_engine_converges_to_a_grasp_at_second_order():
    found = grasp(4.0, 0.8, STIFF)
    errors = []
    for nodes in (26, 51, 101):
        simulation, rod, _ = laid(4.0, 0.8, nodes)
        reaction = simulation.reaction(rod.start).force
        errors.append(np.abs(reaction - found.force).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    measured(errors[-1], "w Lgb")
    measured_order(orders)
    assert errors[-1] < 1e-3
    np.testing.assert_allclose(orders, 2.0, atol=0.1)
