"""Cases of the validation page: the errors and orders that tests find against closed forms and independent answers.

A test is a case if it has the marker `case`:

    @pytest.mark.case("statics", "Tip of a cantilever", source="elastica [Bisshopp and Drucker 1945]")

A test of whole numbers, such as crossings of a knot, has `exact=True` and no error.
`pytest --cases FILE` adds the figures of the cases that ran to FILE, and `--cases -` prints them. The order is that of
`assert_order`. The error is what the test passes to `measured`. For a test without `measured`, it is the greatest
relative difference of `pytest.approx` and `numpy.testing.assert_allclose`. A test that runs with several parameters
counts with its greatest error and the range of its orders.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest


class Figures:
    """Figures of one run of a test."""

    def __init__(self) -> None:
        self.errors: list[float] = []
        self.differences: list[float] = []
        self.orders: list[float] = []
        self.unit = ""

    def as_dict(self) -> dict[str, Any]:
        # A test of orders alone may compare numbers that are equal, such as the time at the end of a run.
        errors = self.errors or (self.differences if any(self.differences) or not self.orders else [])
        return {
            "error": max(errors) if errors else None,
            "unit": self.unit,
            "orders": [min(self.orders), max(self.orders)] if self.orders else None,
        }


_running: Figures | None = None


def measured(error: Any, unit: str = "") -> None:
    """Record an error of the running case; of several values the greatest. Without a unit it is relative."""
    if _running is not None:
        _running.errors.append(float(np.abs(np.asarray(error, dtype=float)).max()))
        _running.unit = unit


def measured_order(order: Any) -> None:
    """Record an observed order of convergence of the running case; of several values that of the finest mesh."""
    if _running is not None:
        _running.orders.append(float(np.asarray(order, dtype=float).flat[-1]))


def _compare(actual: Any, expected: Any) -> None:
    try:
        found, known = np.asarray(actual, dtype=float), np.asarray(expected, dtype=float)
        size = float(np.abs(known).max())
        difference = float(np.abs(found - known).max()) / size if size > 0.0 else math.nan
    except (TypeError, ValueError):
        return
    if _running is not None and math.isfinite(difference):
        _running.differences.append(difference)


class _Approx:
    """Record each comparison with `pytest.approx`."""

    __array_ufunc__ = None
    __array_priority__ = 100
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, approx: Any, expected: Any, *args: Any, **options: Any) -> None:
        self.expected = expected
        self.inner = approx(expected, *args, **options)

    def __eq__(self, actual: object) -> bool:
        _compare(actual, self.expected)
        return bool(self.inner == actual)

    def __repr__(self) -> str:
        return repr(self.inner)


@contextmanager
def recording() -> Iterator[Figures]:
    """Collect the figures of the block."""
    global _running
    approx, allclose = pytest.approx, np.testing.assert_allclose

    def record_allclose(actual: Any, desired: Any, *args: Any, **options: Any) -> None:
        _compare(actual, desired)
        allclose(actual, desired, *args, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pytest, "approx", lambda *args, **options: _Approx(approx, *args, **options))
        patch.setattr(np.testing, "assert_allclose", record_allclose)
        _running = Figures()
        try:
            yield _running
        finally:
            _running = None


def as_text(figures: dict[str, dict[str, Any]]) -> str:
    """Return figures as JSON with one line for each case, in the order of the titles."""
    lines = (f"{json.dumps(title)}: {json.dumps(found)}" for title, found in sorted(figures.items()))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def rounded(value: float | None) -> float | None:
    """Round to two significant digits, which differ less between machines."""
    return None if value is None else float(f"{value:.1e}")


class Recorder:
    """Plugin of pytest behind the option `--cases`."""

    def __init__(self, config: pytest.Config) -> None:
        self.path = config.getoption("cases")
        self.is_worker = hasattr(config, "workerinput")  # of pytest-xdist, whose reports go to the main process
        self.runs: dict[str, list[dict[str, Any]]] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        mark = item.get_closest_marker("case")
        if mark is None:
            return (yield)
        with recording() as figures:
            result = yield
        item.user_properties.append(("case", [mark.args[1], figures.as_dict()]))
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" and report.passed:
            for name, value in report.user_properties:
                if name == "case":
                    self.runs.setdefault(str(value[0]), []).append(value[1])

    def figures(self) -> dict[str, dict[str, Any]]:
        """Return the figures of each case that ran, over all of its parameters."""
        found = {}
        for title, runs in self.runs.items():
            errors = [run["error"] for run in runs if run["error"] is not None]
            orders = [order for run in runs for order in run["orders"] or []]
            found[title] = {
                "error": rounded(max(errors, default=None)),
                "unit": next((run["unit"] for run in runs if run["unit"]), ""),
                "orders": [round(min(orders), 1), round(max(orders), 1)] if orders else None,
            }
        return found

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        if self.is_worker:
            return
        figures = self.figures()
        if self.path == "-":
            terminalreporter.section("cases")
            for title, found in figures.items():
                error = "no error" if found["error"] is None else f"error {found['error']:.1e} {found['unit']}".rstrip()
                order = "" if found["orders"] is None else f", order {found['orders'][0]} to {found['orders'][1]}"
                terminalreporter.write_line(f"{title}: {error}{order}")
            return
        file = Path(self.path)
        known = json.loads(file.read_text()) if file.exists() else {}
        file.write_text(as_text(known | figures))
