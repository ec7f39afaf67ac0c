"""Rotation of creases of wide and narrow sheets in half folds, beside table 7.3 of the dissertation.

python benchmarks/folding_spin.py [--quick] [--trials 3]

A sheet is two strips joined at their ends (`WideSheet`). Their friction on the table differs, by a standard deviation
of 10 % to either side. The rest of the noise is that of the other trials. Sheets that snap are not measured, and the
mean is over the others.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from reporting import Report, arguments, bar

from withe import folding

PAPERS = {"A4": folding.Paper.a4(), "cardboard": folding.Paper.cardboard()}
TABLES = (("A4", 0.12), ("cardboard", 0.12), ("cardboard", 0.3))  # paper and friction
WIDTHS = (0.21, 0.025)  # [m]
WAYS = {
    "intuitive": {"method": "intuitive"},
    "local": {"method": "local"},
    "ucs": {"method": "ucs"},
    "ucs closed": {"method": "ucs"},
    "slip": {"method": "slip", "grasp": "free"},
}
REPLANS = {"ucs closed": 5}
CURVATURES = {"cardboard": 4.0}  # [1/Lgb]
PUBLISHED = {  # friction 0.12, by paper and width [deg]
    ("A4", 0.21): {"intuitive": "6.56 1.29", "local": "1.68 .97", "ucs": ".27 .44", "ucs closed": ".35 .38"},
    ("A4", 0.025): {"intuitive": ".36 1.65", "local": ".02 .65", "ucs": ".48 .47", "ucs closed": "-.23 .48"},
    ("cardboard", 0.21): {"intuitive": "1.25 1.43", "local": "none", "ucs": "1.38 1.06", "ucs closed": "1.45 1.48"},
    ("cardboard", 0.025): {"intuitive": ".07 .75", "local": "none", "ucs": "-.70 .31", "ucs closed": "-.35 .82"},
}
SEEDS = 1000
QUICK_MESH = {"edges": 60, "time_step": 0.02}
BOUND = 0.3  # [deg]; greatest rotation of a sheet that does not slide


@dataclass(frozen=True)
class Case:
    """A line of the table."""

    paper: str
    friction: float
    width: float
    way: str

    def __str__(self) -> str:
        return f"{self.paper} {100 * self.width:g} cm, {self.friction:g}, {self.way}"


@dataclass(frozen=True)
class Turned:
    """One fold of a wide sheet."""

    spin: float
    slides: np.ndarray
    failure: str | None
    seconds: float


def cases() -> Iterator[Case]:
    """Yield the cases of the table, line by line."""
    for paper, friction in TABLES:
        for width in WIDTHS:
            for way in WAYS:
                yield Case(paper, friction, width, way)


def turned(plan: folding.Plan, seed: int, replans: int, mesh: Mapping[str, Any]) -> Turned:
    """Fold one sheet, watched by a camera if the plan is updated on the way."""
    begin = time.thread_time()
    sheet = folding.WideSheet(plan.paper, seed, folding.Noise(friction_variation=0.0), **mesh)
    try:
        watched = replans > 0
        found = (
            folding.fold(plan, sheet, replans=replans, progress=False) if watched else sheet.fold(plan, progress=False)
        )
    except ValueError as error:  # no way on
        return Turned(np.nan, np.full(2, np.nan), str(error), time.thread_time() - begin)
    return Turned(np.degrees(found.spin), found.slides, found.failure, time.thread_time() - begin)


def planned(case: Case) -> folding.FoldPlan:
    """Return the plan for the nominal paper."""
    paper = replace(PAPERS[case.paper], friction=case.friction, width=case.width)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # predicted slide
        asked = WAYS[case.way]
        curvature = CURVATURES.get(case.paper) if asked.get("grasp") == "free" else None
        return folding.plan(paper, progress=False, curvature=curvature, **asked)


def row(case: Case, folds: list[Turned]) -> tuple[str, ...]:
    """A line of the table."""
    good = [fold for fold in folds if fold.failure is None]
    published = PUBLISHED[case.paper, case.width].get(case.way, "") if case.friction == TABLES[0][1] else ""
    spins, slides = np.array([fold.spin for fold in good]), 1e3 * np.array([fold.slides.mean() for fold in good])
    return (
        case.paper,
        f"{100 * case.width:g}",
        f"{case.friction:g}",
        case.way,
        f"{len(good)} of {len(folds)}",
        f"{spins.mean():.3f} {spins.std():.3f}" if good else "",
        published,
        f"{np.abs(spins).max():.3f}" if good else "",
        f"{slides.mean():.2f}" if good else "",
        f"{np.mean([fold.seconds for fold in folds]):.0f}",
    )


def main() -> None:
    """Fold, list."""
    options = arguments(__doc__, ("--trials", {"type": int, "default": 3}))
    wanted, count = list(cases()), options.trials
    if options.quick:
        wanted, count = [Case("A4", 0.12, 0.21, "slip")], 1
    report = Report("folding_spin", quick=options.quick)
    rows = []
    with bar(len(wanted) * count, "folding", "folds") as shown:
        for case in wanted:
            folds, plan = [], planned(case)
            for seed in range(SEEDS, SEEDS + count):
                folds.append(turned(plan, seed, REPLANS.get(case.way, 0), QUICK_MESH if options.quick else {}))
                shown.advance(1)
            rows.append(row(case, folds))
            print("  ".join(rows[-1]), flush=True)
            if case.paper == "A4" and case.way == "slip":
                good = all(fold.failure is None for fold in folds)
                most = max(abs(fold.spin) for fold in folds) if good else np.inf
                name = f"A4, {100 * case.width:g} cm wide, slip: greatest spin [deg]"
                report.goal(name, float(most), BOUND, at_least=False)
    header = (
        "paper",
        "width [cm]",
        "friction",
        "way",
        "folded",
        "spin: mean, spread [deg]",
        "published",
        "most",
        "slide [mm]",
        "s a fold",
    )
    report.table("Spin of creases", header, rows)
    report.write()


if __name__ == "__main__":
    main()
