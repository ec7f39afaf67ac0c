"""Knots: what they are by topology, that pulling keeps them, and the forces that hold them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest

import withe
from withe.knots import signed_crossings, writhe

FloatArray = npt.NDArray[np.float64]


def closed_far_away(points: FloatArray) -> FloatArray:
    """A knot on a line, its ends joined by a wide arc that crosses nothing."""
    middle, half = 0.5 * (points[0] + points[-1]), 0.5 * float(np.linalg.norm(points[-1] - points[0]))
    angle = np.linspace(0.0, np.pi, 60)[1:-1]
    along = (points[-1] - points[0]) / (2.0 * half)
    away = np.array([0.0, 1.0, 0.0])
    return np.concatenate(
        [points, middle + 3.0 * half * (np.outer(np.cos(angle), along) + np.outer(np.sin(angle), away))]
    )


def determinant(points: FloatArray) -> int:
    """Determinant of the knot that a closed polygon makes: by colouring the arcs of a diagram of it."""
    rng = np.random.default_rng(4)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    x = np.concatenate([points, points[:1]]) @ turn
    a, edge = x[:-1], np.diff(x, axis=0)
    crossings: list[tuple[float, float]] = []  # place along the curve of the under pass, and of the over pass
    for i in range(len(a)):
        j = np.arange(i + 2, len(a) - (1 if i == 0 else 0))
        area = edge[i, 0] * edge[j, 1] - edge[i, 1] * edge[j, 0]
        gap = a[j] - a[i]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (gap[:, 0] * edge[j, 1] - gap[:, 1] * edge[j, 0]) / area
            t = (gap[:, 0] * edge[i, 1] - gap[:, 1] * edge[i, 0]) / area
        for k in np.flatnonzero((s > 0) & (s < 1) & (t > 0) & (t < 1)):
            first, second = i + s[k], j[k] + t[k]
            above = a[i, 2] + s[k] * edge[i, 2] > a[j[k], 2] + t[k] * edge[j[k], 2]
            crossings.append((second, first) if above else (first, second))
    under = np.sort([c[0] for c in crossings])
    arc = lambda place: int(np.searchsorted(under, place)) % len(under)  # noqa: E731
    matrix = np.zeros((len(crossings), len(crossings)))
    for row, (low, over) in enumerate(crossings):
        matrix[row, arc(over)] += 2.0
        matrix[row, arc(low - 1e-9)] -= 1.0
        matrix[row, arc(low + 1e-9)] -= 1.0
    return round(abs(float(np.linalg.det(matrix[1:, 1:]))))


def pulled(points: FloatArray, radius: float, by: float, **contact: Any) -> withe.Simulation:
    """A knot without weight, its end edges held, pulled tighter."""
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=1.8e5, poisson_ratio=0.5, density=1180.0)
    rope = scene.add_rod(points=points, radius=radius, material=material, natural="straight", name="rope")
    scene.add_drag(0.5)
    grips = [scene.clamp(node, hold="edge", spin=True) for node in (rope.start, rope.end)]
    scene.enable_contact(**contact)
    simulation = scene.build(integrator="backward_euler", time_step=2.5e-3)
    x = simulation.positions(rope)
    along = (x[-1] - x[0]) / np.linalg.norm(x[-1] - x[0])
    for grip, end, sign in zip(grips, (x[0], x[-1]), (-1.0, 1.0), strict=True):
        simulation.move(grip, position=end + 0.5 * sign * by * along, over=1.0)
    simulation.step(500)
    return simulation


@pytest.mark.case("knots", "Determinant of overhand knots with 1 to 4 turns", source="torus knots, 2 n + 1", exact=True)
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_overhand_knots_are_torus_knots_and_do_not_touch_themselves(n: int) -> None:
    points = withe.knots.overhand_knot(n, length=1.0, radius=1.6e-3, shortening=0.6)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert lengths.sum() == pytest.approx(1.0, abs=1e-9)
    assert determinant(closed_far_away(points)) == 2 * n + 1
    scene = withe.Scene()
    scene.add_rod(points=points, radius=1.6e-3, material=withe.Material(youngs_modulus=1e6, density=1000.0))
    scene.enable_contact()
    assert len(scene.build().contacts()) == 0


@pytest.mark.case("knots", "Signed crossings of reef and granny knots", source="0 and 6", exact=True)
@pytest.mark.parametrize("tails", ["up", "sideways"])
def test_reef_and_granny_differ_by_their_crossings(tails: Literal["up", "sideways"]) -> None:
    view = (0.02, 1.0, 0.01)
    assert signed_crossings(withe.knots.reef_knot(tails=tails), view) == 0
    assert abs(signed_crossings(withe.knots.granny_knot(tails=tails), view)) == 6


@pytest.mark.parametrize("draw", [withe.knots.reef_knot, withe.knots.granny_knot])
def test_knots_with_tails_sideways_are_two_alike_halves_that_do_not_touch(draw: Callable[..., FloatArray]) -> None:
    points = draw(length=1.0, radius=2e-3, tails="sideways")
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(1.0, abs=1e-9)
    assert points == pytest.approx(points[::-1] * [-1.0, -1.0, 1.0], abs=1e-12)
    assert points[0, 2] == pytest.approx(points[1, 2], abs=1e-12)
    assert abs(points[0, 0] - points[-1, 0]) == pytest.approx(np.ptp(points[:, 0]), rel=1e-12)
    scene = withe.Scene()
    scene.add_rod(points=points, radius=2e-3, material=withe.Material(youngs_modulus=1e6, density=1000.0))
    scene.enable_contact()
    assert len(scene.build().contacts()) == 0


def test_a_pulled_knot_stays_the_knot_that_it_is() -> None:
    points = withe.knots.overhand_knot(1, length=0.5, radius=1.6e-3, shortening=0.25, nodes=121)
    simulation = pulled(points, 1.6e-3, 0.06, friction=0.1, friction_model="lagged")
    assert determinant(closed_far_away(simulation.positions("rope"))) == 3
    contacts = simulation.contacts()
    assert len(contacts) > 0
    assert contacts["gap"].min() > -0.05 * 1.6e-3


@pytest.mark.case("knots", "Writhe of a polygon", source="mean of signed crossings over projections")
def test_writhe_of_a_polygon_is_the_mean_of_what_its_diagrams_show() -> None:
    points = withe.knots.overhand_knot(1, nodes=101)
    rng = np.random.default_rng(0)
    ends = [points[0] + 1e3 * (points[0] - points[1]), points[-1] + 1e3 * (points[-1] - points[-2])]
    carried_on = np.concatenate([ends[:1], points, ends[1:]])
    shown = [signed_crossings(carried_on, view) for view in rng.normal(size=(400, 3))]
    assert writhe(points) == pytest.approx(np.mean(shown), abs=3.0 * float(np.std(shown)) / 20.0)


@pytest.mark.case(
    "knots", "Link of a rod that is wound into a plectoneme", source="turns of its end [Calugareanu 1959, White 1969]"
)
@pytest.mark.parametrize("time_step", [2e-3, 5e-3, 2e-2])
def test_link_of_a_held_rod_is_kept_while_it_is_wound_into_a_plectoneme(time_step: float) -> None:
    turns, length = 5.0, 0.4
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=121, radius=2e-3, material=material, name="rod")
    scene.clamp(rod.start, hold="edge")
    far = scene.clamp(rod.end, hold="edge")
    scene.add_drag(0.3)
    scene.add_load(rod, (0, 1e-4, 0))  # so that it knows which way to go
    scene.enable_contact()
    simulation = scene.build(integrator="backward_euler", time_step=time_step)

    def winding(time: float) -> tuple[FloatArray, FloatArray]:
        share = min(time, 1.0)
        c, s = np.cos(2.0 * np.pi * turns * share), np.sin(2.0 * np.pi * turns * share)
        return np.array([length - 0.1 * share, 0, 0]), np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])

    simulation.move(far, path=winding)
    for _ in range(5):
        simulation.step(round(0.3 / time_step))
        assert simulation.link(rod) == pytest.approx(turns * min(simulation.time, 1.0), abs=1e-6)
    assert len(simulation.contacts()) > 0
    assert abs(writhe(simulation.positions(rod))) > 1.0
