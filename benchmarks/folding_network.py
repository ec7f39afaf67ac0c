"""Networks that know how sheets hang beside exact equilibria: errors, size, time. Part of folding.py."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable

import numpy as np
from reporting import OUT, Report, kilobytes, processor_seconds

from withe import folding
from withe.folding.grid import HIGH, WIDE
from withe.folding.sheet_network import SHIPPED
from withe.folding.sheets import Elastica, take

SOURCE = OUT.parent / "networks" / "folding_source.pt"  # from tools/train_networks.py
SOURCE_SECONDS = 120.0  # for which it is trained here where that file is not
GOALS = {  # median, 95 %, most
    "angle": (5e-4, 4e-3, 5e-2),
    "suspended": (1e-3, 8e-3, 5e-2),
    "force_ratio": (5e-4, 2e-3, 2e-2),
}
# The dissertation's own weights against a table of exact equilibria .25 Lgb apart: median and 95 %.
PUBLISHED = {"angle": (0.0015, 0.0054), "suspended": (0.012, 0.025), "force_ratio": (0.0033, 0.029)}


def errors(network: folding.SheetNetwork, exact: Elastica) -> tuple[dict[str, np.ndarray], float]:
    """Median, 95 % and greatest of each error, of the ratio where it is below 1; and the share that is refused."""
    pose = network(exact.x, exact.z)
    found = {}
    for name in GOALS:
        counted = pose.valid & ((exact.force_ratio < 1) | (name != "force_ratio"))
        error = np.abs(getattr(pose, name) - getattr(exact, name))[counted]
        found[name] = np.percentile(error, (50, 95, 100)) if len(error) else np.full(3, np.nan)  # hardly trained
    return found, 1.0 - pose.valid.mean()


def times(ask: Callable[[object, object], object], exact: Elastica, count: int) -> tuple[float, float]:
    """Processor time of one question by itself, and of each in a batch [s]."""
    one = processor_seconds(lambda: [ask(3.0, 2.25) for _ in range(100)], 3) / 100
    many = np.resize(exact.x, count), np.resize(exact.z, count)
    return one, processor_seconds(lambda: ask(*many), 3) / count


def compare(report: Report, quick: bool) -> None:
    """The small network, the dissertation's and exact equilibria side by side, at positions that are new to all."""
    if importlib.util.find_spec("torch") is None:
        print("\nNetworks: torch is not installed")
        return
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    OUT.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(11)
    count = 2_000 if quick else 100_000
    exact = folding.elastica(random.uniform(0.0, WIDE, count), random.uniform(0.0, HIGH, count))
    exact = take(exact, exact.valid)
    networks = {"small": folding.SheetNetwork.load(), "source": _source(quick)}
    single, batch = times(folding.elastica, exact, 2_000 if quick else 20_000)
    rows = [("exact", "0", "0", "0", "", "", f"{1e6 * single:.0f}", f"{1 / batch:.2g}", "")]
    for name, network in networks.items():
        found, refused = errors(network, exact)
        single, batch = times(network, exact, 20_000 if quick else 1_000_000)
        training = network.network.training
        file = SHIPPED if name == "small" else network.save(OUT / "folding_source.pt")
        cells = [" ".join(f"{value:.1e}" for value in found[key]) for key in GOALS]
        spent = f"{training.seconds:.0f} ({training.stopped})"
        times_of = (f"{1e6 * single:.0f}", f"{1 / batch:.2g}", spent)
        rows.append((name, *cells, f"{100 * refused:.2f}", kilobytes(file), *times_of))
        if name == "small" and not quick:
            _hold_against_goals(report, found, 1 / batch, training.seconds)
    published = [" ".join(f"{value:.1e}" for value in PUBLISHED[key]) for key in GOALS]
    rows.append(("source, published", *published, "", "1900", "", "", ""))
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
    torch.set_num_threads(threads)


def _source(quick: bool) -> folding.SheetNetwork:
    """The dissertation's network: trained before, or here for a while."""
    if SOURCE.exists() and not quick:
        return folding.SheetNetwork.load(SOURCE)
    limit = 1.0 if quick else SOURCE_SECONDS
    return folding.train("source", samples=2_000 if quick else None, time_limit=limit)


def _hold_against_goals(report: Report, found: dict[str, np.ndarray], speed: float, seconds: float) -> None:
    for name, bounds in GOALS.items():
        for what, value, bound in zip(("median", "95 %", "most"), found[name], bounds, strict=True):
            report.goal(f"small network, {name}: {what}", float(value), bound, at_least=False)
    report.goal("small network: queries a second, a thread", speed, 1e6)
    report.goal("small network: trained in [s]", seconds, 300.0, at_least=False)
