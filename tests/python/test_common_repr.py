"""Results that hold arrays show themselves in a line or a few, not over pages of a notebook."""

import inspect
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

import withe
from simple_scenes import cantilever
from withe.common.frames import EnergyHistory
from withe.simulation.paths import EquilibriumPath

VECTORS = {"Momentum", "Reaction", "Plan", "Crossing", "Joint", "Ambiguity"}  # arrays of three numbers or two at most


def with_arrays():
    """Public dataclasses that may hold arrays."""
    rooms = (withe, withe.simulation, withe.real2sim, withe.perception)
    found = {getattr(room, name) for room in rooms for name in room.__all__} | {EnergyHistory, EquilibriumPath}
    for kind in sorted(
        (kind for kind in found if inspect.isclass(kind) and is_dataclass(kind)), key=lambda k: k.__name__
    ):
        if kind.__module__.split(".")[1] in ("simulation", "real2sim", "perception", "common"):
            words = [str(field.type) for field in fields(kind)]
            if any("Array" in word and "Callable" not in word for word in words):
                yield kind


@pytest.mark.parametrize("kind", list(with_arrays()), ids=lambda kind: kind.__name__)
def test_public_results_with_arrays_have_a_repr_of_their_own(kind):
    made_by_dataclass = hasattr(kind.__repr__, "__wrapped__")
    assert made_by_dataclass == (kind.__name__ in VECTORS)


def test_long_arrays_are_shown_by_shape_range_and_gaps():
    points = np.zeros((40, 3, 2))
    points[2, 1], points[0, 0, 0] = np.nan, 123.4
    log = withe.real2sim.Log(np.arange(40.0), points, np.isfinite(points[..., 0]), (101, 102, 103))
    assert repr(log) == (
        "Log(times=<(40,), 0 to 39>, pixels=<(40, 3, 2), 0 to 123.4, 2 NaN or infinite>, valid=<(40, 3), 119 true>, "
        "tags=(101, 102, 103))"
    )
    tags = withe.real2sim.Tags(points, [("arm", 0.1 * i) for i in range(3)], sigma=0.5)
    assert repr(tags).startswith("Tags(points=<(40, 3, 2), 0 to 123.4, 2 NaN or infinite>, places=[('arm', 0.0), ")
    assert "sigma=0.5, times=None" in repr(tags)
    many = withe.real2sim.Tags(np.zeros((1, 30, 2)), [("arm", 0.01 * i) for i in range(30)])
    assert "places=<30 in a list>" in repr(many)


def test_what_a_simulation_finds_is_shown_in_a_line():
    _, _, simulation = cantilever(nodes=41)
    assert repr(simulation.linearise()) == "Linearisation(80 unknowns of 41 nodes)"
    for found in (
        simulation.equilibrium(),
        simulation.run(0.02, progress=False).energy(),
        simulation.plan,
        simulation.momentum(),
    ):
        assert "\n" not in repr(found)
        assert len(repr(found)) < 1000
