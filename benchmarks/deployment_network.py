"""Networks that know where to hold a rod beside exact grasps: errors, size, time. Part of deployment.py."""

from __future__ import annotations

from pathlib import Path

import networks
import numpy as np
from reporting import Report, processor_seconds

from withe import deployment
from withe.deployment.grasp_network import CURVATURES, LENGTHS, SHIPPED, STIFFNESSES

DATA = Path(__file__).resolve().parent.parent / "tests" / "data"
NODES = 200  # nodes of a pattern
GOALS = {"position": (2e-3, 1e-2), "rotation": (2e-3, 1e-2)}  # median, 95 %: [Lgb], [rad]
# The dissertation's own weights on the table: median, 95 % and greatest.
PUBLISHED = {"position": (0.073, 0.34, 0.79), "rotation": (0.015, 0.046, 0.077)}
NUMBER = 2  # number of the cable of the pattern


def errors(found: deployment.Grasp, exact: deployment.Grasp) -> dict[str, np.ndarray]:
    """Median, 95 % and greatest distance of positions [Lgb] and of rotation vectors [rad]."""
    away = {name: np.linalg.norm(getattr(found, name) - getattr(exact, name), axis=1) for name in GOALS}
    return {name: networks.percentiles(error) for name, error in away.items()}


def compare(report: Report, quick: bool) -> None:
    """The small network, the dissertation's and exact grasps side by side, where all are new, and on the table."""
    if not networks.torch_is_there():
        return
    asked = _new(200 if quick else 10_000), _table()
    exact = [deployment.grasp(*each) for each in asked]
    pattern = _pattern()
    with networks.one_thread():
        rows = [("exact", *[""] * 5, *_times(deployment.grasp, pattern, 1 if quick else 5), "")]
        for name, network in networks.loaded(
            deployment.GraspNetwork, deployment.train, "deployment", quick, 500
        ).items():
            here, there = (errors(network(*each), known) for each, known in zip(asked, exact, strict=True))
            size, spent = networks.size_and_training(network, SHIPPED if name == "small" else None)
            cells = networks.cells(found[key] for found in (here, there) for key in GOALS)
            times = _times(network, pattern, 1 if quick else 20)
            rows.append((name, *cells, size, *times, spent))
            if name == "small" and not quick:
                _hold_against_goals(report, here, there)
                report.goal(f"small network: a pattern of {NODES} nodes [ms]", float(times[1]), 5.0, at_least=False)
    rows.append(("source, published", "", "", *networks.cells(PUBLISHED[key] for key in GOALS), *[""] * 4))
    header = (
        "grasps",
        "new positions [Lgb]: median 95 % most",
        "new rotations [rad]",
        "table's positions",
        "table's rotations",
        "kB",
        "us a question",
        f"ms a pattern of {NODES} nodes",
        "trained in [s]",
    )
    report.table("Networks beside exact grasps, one thread", header, rows)


def _new(count: int) -> tuple[np.ndarray, ...]:
    """Questions that no network was trained on, 0.5 Lgb and more."""
    random = np.random.default_rng(11)
    length = np.exp(random.uniform(np.log(0.5), np.log(LENGTHS[1]), count))
    return length, random.uniform(-CURVATURES[1], CURVATURES[1], count), random.uniform(*STIFFNESSES, count)


def _table() -> tuple[np.ndarray, ...]:
    rows = np.genfromtxt(DATA / "rod_grasps.csv", delimiter=",", names=True)
    return rows["lsbar"], rows["kappabar"], rows["ksbar"]


def _pattern() -> tuple[np.ndarray, np.ndarray, float]:
    """Questions of the published sine, laid from beginning to end."""
    points = np.genfromtxt(DATA / "patterns" / "sine.csv", delimiter=",", skip_header=1)
    pattern, cable = deployment.Pattern(points, nodes=NODES), deployment.Cable.dlo(NUMBER)
    lgb = cable.gravito_bending_length
    return (cable.length - pattern.arc_length) / lgb, -pattern.curvature * lgb, cable.stretch_stiffness


def _times(ask: object, pattern: tuple, repeats: int) -> tuple[str, str]:
    """Processor time of one question by itself [us], and of a pattern at once [ms]."""
    ask(*pattern)  # type: ignore[operator]
    one = processor_seconds(lambda: [ask(5.0, 0.25) for _ in range(20)], repeats) / 20  # type: ignore[operator]
    many = processor_seconds(lambda: ask(*pattern), repeats)  # type: ignore[operator]
    return f"{1e6 * one:.0f}", f"{1e3 * many:.2f}"


def _hold_against_goals(report: Report, here: dict[str, np.ndarray], there: dict[str, np.ndarray]) -> None:
    for name, bounds in GOALS.items():
        for where, found in (("10,000 new grasps", here), ("the table", there)):
            for what, value, bound in zip(("median", "95 %"), found[name], bounds, strict=False):
                report.goal(f"small network, {name}, {where}: {what}", float(value), bound, at_least=False)
