"""Networks that know how sheets hang beside exact equilibria: errors, size, time. Part of folding.py."""

from __future__ import annotations

from collections.abc import Callable

import networks
import numpy as np
from reporting import Report, processor_seconds

from withe import folding
from withe.folding.grid import HIGH, WIDE
from withe.folding.sheet_network import SHIPPED
from withe.folding.sheets import Elastica, take

GOALS = {  # median, 95 %, most
    "angle": (5e-4, 4e-3, 5e-2),
    "suspended": (1e-3, 8e-3, 5e-2),
    "force_ratio": (5e-4, 2e-3, 2e-2),
}
# The dissertation's own weights against a table of exact equilibria 0.25 Lgb apart: median and 95 %.
PUBLISHED = {"angle": (0.0015, 0.0054), "suspended": (0.012, 0.025), "force_ratio": (0.0033, 0.029)}


def errors(network: folding.SheetNetwork, exact: Elastica) -> tuple[dict[str, np.ndarray], float]:
    """Median, 95 % and greatest of each error, of the ratio where it is below 1; and the share that is refused."""
    pose = network(exact.x, exact.z)
    found = {}
    for name in GOALS:
        counted = pose.valid & ((exact.force_ratio < 1) | (name != "force_ratio"))
        found[name] = networks.percentiles(np.abs(getattr(pose, name) - getattr(exact, name))[counted])
    return found, 1.0 - pose.valid.mean()


def times(ask: Callable[[object, object], object], exact: Elastica, count: int) -> tuple[float, float]:
    """Processor time of one question by itself, and of each in a batch [s]."""
    one = processor_seconds(lambda: [ask(3.0, 2.25) for _ in range(100)], 3) / 100
    many = np.resize(exact.x, count), np.resize(exact.z, count)
    return one, processor_seconds(lambda: ask(*many), 3) / count


def compare(report: Report, quick: bool) -> None:
    """The small network, the dissertation's and exact equilibria side by side, at positions that are new to all."""
    if not networks.torch_is_there():
        return
    random = np.random.default_rng(11)
    count = 2_000 if quick else 100_000
    exact = folding.elastica(random.uniform(0.0, WIDE, count), random.uniform(0.0, HIGH, count))
    exact = take(exact, exact.valid)
    with networks.one_thread():
        single, batch = times(folding.elastica, exact, 2_000 if quick else 20_000)
        rows = [("exact", "0", "0", "0", "", "", f"{1e6 * single:.0f}", f"{1 / batch:.2g}", "")]
        for name, network in networks.loaded(folding.SheetNetwork, folding.train, "folding", quick, 2_000).items():
            found, refused = errors(network, exact)
            single, batch = times(network, exact, 20_000 if quick else 1_000_000)
            size, spent = networks.size_and_training(network, SHIPPED if name == "small" else None)
            cells = networks.cells(found[key] for key in GOALS)
            asked = f"{1e6 * single:.0f}", f"{1 / batch:.2g}"
            rows.append((name, *cells, f"{100 * refused:.2f}", size, *asked, spent))
            if name == "small" and not quick:
                _hold_against_goals(report, found, 1 / batch, network.network.training.seconds)
    published = networks.cells(PUBLISHED[key] for key in GOALS)
    rows.append(("source, published", *published, "", networks.PUBLISHED_SIZE, "", "", ""))
    header = (
        "manifold",
        "angle [rad]: median 95 % most",
        "lifted [Lgb]",
        "ratio where < 1",
        "refused [%]",
        "kB",
        "us a query",
        "a second",
        "trained in [s]",
    )
    report.table("Networks beside exact equilibria, one thread", header, rows)


def _hold_against_goals(report: Report, found: dict[str, np.ndarray], speed: float, seconds: float) -> None:
    for name, bounds in GOALS.items():
        for what, value, bound in zip(("median", "95 %", "most"), found[name], bounds, strict=True):
            report.goal(f"small network, {name}: {what}", float(value), bound, at_least=False)
    report.goal("small network: queries a second, a thread", speed, 1e6)
    report.goal("small network: trained in [s]", seconds, 300.0, at_least=False)
