"""How far creases of wide sheets are turned, half folds of A4 and cardboard, beside table 7.3 of the dissertation.

python benchmarks/folding_spin.py [--quick] [--trials 3]

A sheet is two strips joined at their ends whose friction on the table differs (`WideSheet`), by a standard deviation of
10 % to either side; the rest of the noise is that of the other trials.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass, replace

import numpy as np
from reporting import Report, arguments, bar

from withe import folding

PAPERS = {"A4": (folding.Paper.a4(), 0.12), "cardboard": (folding.Paper.cardboard(), 0.3)}
WAYS = {
    "intuitive": {"method": "intuitive"},
    "local": {"method": "local"},
    "ucs": {"method": "ucs"},
    "slip": {"method": "slip", "grasp": "free"},
}
CURVATURES = {"cardboard": 4.0}  # [1/Lgb]
PUBLISHED = {  # 21 cm wide, open loop, friction .12 [deg]
    "A4": {"intuitive": "6.56 1.29", "local": "1.68 .97", "ucs": ".27 .44"},
    "cardboard": {"intuitive": "1.25 1.43", "local": "none", "ucs": "1.38 1.06"},
}
SEEDS = 1000
BOUND = 0.3  # [deg], of what does not slide


@dataclass(frozen=True)
class Turned:
    """One fold of a wide sheet."""

    spin: float
    slides: np.ndarray
    failure: str | None
    seconds: float


def turned(name: str, way: str, seed: int) -> Turned:
    """Plan, and fold."""
    paper, friction = PAPERS[name]
    paper = replace(paper, friction=friction)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of slide that is predicted
        plan = folding.plan(paper, **{"curvature": CURVATURES.get(name, 2.5), **WAYS[way]})
    begin = time.thread_time()
    noise = folding.Noise(friction_variation=0.0)
    found = folding.WideSheet(paper, seed, noise).fold(plan, progress=False)
    return Turned(np.degrees(found.spin), found.slides, found.failure, time.thread_time() - begin)


def main() -> None:
    """Fold, list."""
    options = arguments(__doc__, ("--trials", {"type": int, "default": 3}))
    names, ways, count = list(PAPERS), list(WAYS), options.trials
    if options.quick:
        names, ways, count = names[:1], ["slip"], 1
    report = Report("folding_spin", quick=options.quick)
    rows = []
    with bar(len(names) * len(ways) * count, "folding", "folds") as shown:
        for name in names:
            for way in ways:
                folds = []
                for seed in range(SEEDS, SEEDS + count):
                    folds.append(turned(name, way, seed))
                    shown.advance(1)
                good = [fold for fold in folds if fold.failure is None]
                spins = np.array([fold.spin for fold in good])
                slides = 1e3 * np.array([fold.slides.mean() for fold in good])
                rows.append(
                    (
                        name,
                        f"{PAPERS[name][1]:g}",
                        way,
                        f"{len(good)} of {count}",
                        f"{np.abs(spins).mean():.3f} {np.abs(spins).max():.3f}" if good else "",
                        PUBLISHED[name].get(way, ""),
                        f"{slides.mean():.2f}" if good else "",
                        f"{np.mean([fold.seconds for fold in folds]):.0f}",
                    )
                )
                if name == "A4" and way == "slip":
                    most = float(np.abs(spins).max()) if len(good) == count else np.inf
                    report.goal("A4, slip: greatest spin [deg]", most, BOUND, at_least=False)
    header = ("paper", "friction", "way", "folded", "spin, mean and most [deg]", "published", "slide [mm]", "s a fold")
    report.table("Spin of wide sheets", header, rows)
    report.write()


if __name__ == "__main__":
    main()
