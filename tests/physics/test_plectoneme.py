"""Strands of a twisted rod that wind about each other, against the helices of Clauvelin, Audoly and Neukirch 2009."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from cases import measured

EXAMPLE = Path(__file__).resolve().parent.parent.parent / "examples" / "plectoneme.py"


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("plectoneme", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("force", "angle", "moment"),
    [(0.001, 0.15997, 0.00841), (0.005, 0.23776, 0.02857), (0.01, 0.28136, 0.04863), (0.03, 0.36528, 0.11432)],
)
def test_theory_of_plectonemes_has_its_tabulated_values(
    example: ModuleType, force: float, angle: float, moment: float
) -> None:
    known = example.theory_at(force)
    assert known.angle == pytest.approx(angle, abs=6e-6)
    assert known.moment == pytest.approx(moment, abs=6e-6)


@pytest.mark.case("knots", "Angle and moment of a plectoneme", source="[Clauvelin, Audoly and Neukirch 2009]")
def test_strands_of_a_plectoneme_wind_at_the_angle_and_press_with_the_force_of_theory(example: ModuleType) -> None:
    simulation, rod = example.wind(0.03, turns=2, edge=1.0)
    found, half = example.measure(simulation, rod)
    known = example.theory_at(found.force)
    assert found.force == pytest.approx(0.03 * (half / example.RADIUS) ** 2, rel=1e-6)  # the pull reaches the wall
    assert half == pytest.approx(example.RADIUS, rel=0.05)
    measured([found.angle / known.angle - 1.0, found.moment / known.moment - 1.0])
    assert found.angle == pytest.approx(known.angle, rel=0.03)
    assert found.moment == pytest.approx(known.moment, rel=0.03)
    assert found.pressure == pytest.approx(known.pressure, rel=0.05)
