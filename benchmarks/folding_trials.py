"""Sheets of the dissertation's chapter 7 folded in simulation, with noise that no planner sees, beside its table 7.2.

python benchmarks/folding_trials.py [--quick] [--trials 3] [--cases "A4 half" ...]
"""

from __future__ import annotations

import multiprocessing
import os
import warnings
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from itertools import product
from typing import get_args

import numpy as np
from reporting import OUT, Report, arguments, bar

from withe import folding
from withe.folding.planning import Method

CASES = {
    "A4 half": (folding.Paper.a4(), "half"),
    "A4 .25": (folding.Paper.a4(), 0.25),
    "US half": (folding.Paper.us_letter(), "half"),
    "US .20": (folding.Paper.us_letter(), 0.20),
    "cardboard half": (folding.Paper.cardboard(), "half"),
    "cardboard .20": (folding.Paper.cardboard(), 0.20),
}
WAYS = {  # how the planner is asked, and whether the fold is watched
    "intuitive": ({"method": "intuitive"}, False),
    "local": ({"method": "local"}, False),
    "ucs": ({"method": "ucs"}, False),
    "slip": ({"method": "slip", "grasp": "free"}, False),
    "ucs closed": ({"method": "ucs"}, True),
    "slip closed": ({"method": "slip", "grasp": "free"}, True),
}
CURVATURES = {"cardboard half": 4.0, "cardboard .20": 6.5}  # bounds of free moments that such a fold needs [1/Lgb]
PUBLISHED = {  # table 7.2, sheets 21 cm wide [cm]
    "A4 half": {"intuitive": "12.31 .63", "local": "13.51 .13", "ucs": "14.74 .05", "ucs closed": "14.64 .07"},
    "cardboard half": {"intuitive": "5.88 .38", "local": "none", "ucs": "12.8 .27", "ucs closed": "13.75 .19"},
}
FRICTIONS = (0.12, 0.3)
SEEDS = 1000  # the first of them
COARSE = {"edges": 75, "time_step": 0.02}


@dataclass(frozen=True)
class Trial:
    """One fold: what was asked for, and what came of it; no plan where `failure` begins with "no plan"."""

    case: str
    friction: float
    way: str
    seed: int
    length: float = np.nan
    error: float = np.nan
    slide: float = np.nan
    curvature: float = np.nan
    failure: str | None = None


def carry_out(trial: Trial, options: dict) -> Trial:
    """Measure the sheet's Lgb from a picture, plan with that and with the friction of the table's data, and fold."""
    paper, target = CASES[trial.case]
    paper = replace(paper, friction=trial.friction)
    sheet = folding.SimulatedSheet(paper, trial.seed, folding.Noise(), **options)
    measured = folding.measure(image=sheet.strip_picture(), scale=4000.0).gravito_bending_length
    asked, watched = WAYS[trial.way]
    asked = {"curvature": CURVATURES.get(trial.case, 2.5), **asked}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of slide that is predicted: it is measured here
            plan = folding.plan(replace(paper, gravito_bending_length=measured), target, **asked)
    except ValueError as error:
        return replace(trial, failure=f"no plan: {error}")
    try:
        fold = folding.fold(plan, sheet, progress=False) if watched else sheet.fold(plan, progress=False)
    except ValueError as error:
        return replace(trial, failure=f"no plan on the way: {error}")
    return replace(
        trial,
        length=fold.length,
        error=fold.error,
        slide=fold.slide,
        curvature=fold.max_curvature,
        failure=fold.failure,
    )


def run(
    groups: dict[tuple[str, float, str], list[Trial]], options: dict, processes: int
) -> dict[tuple[str, float, str], list[Trial]]:
    """Carry out all trials, in processes: what moves a jaw is Python's, of which one thread runs at a time."""
    total = sum(len(trials) for trials in groups.values())
    with bar(total, "folding", "folds") as shown:
        if processes == 1:
            done = {}
            for key, trials in groups.items():
                done[key] = []
                for trial in trials:
                    done[key].append(carry_out(trial, options))
                    shown.advance(1)
            return done
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(processes, mp_context=context) as pool:
            futures = {
                pool.submit(carry_out, trial, options): (key, i)
                for key, trials in groups.items()
                for i, trial in enumerate(trials)
            }
            try:
                for future in as_completed(futures):
                    key, i = futures[future]
                    groups[key][i] = future.result()
                    shown.advance(1)
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    return groups


def row(trials: list[Trial]) -> tuple[str, ...]:
    """A line of the table."""
    first, folded = trials[0], [trial for trial in trials if trial.failure is None]
    published = PUBLISHED.get(first.case, {}).get(first.way, "") if first.friction == FRICTIONS[0] else ""
    head = (first.case, f"{first.friction:g}", first.way, f"{len(folded)} of {len(trials)}")
    if not folded:
        why = "no plan" if all((trial.failure or "").startswith("no plan") for trial in trials) else "none folds"
        return (*head, why, published, "", "", "")
    lengths, errors = np.array([t.length for t in folded]), np.abs([t.error for t in folded])
    slides, curvatures = [t.slide for t in folded], [t.curvature for t in folded]
    return (
        *head,
        f"{100 * lengths.mean():.2f} {100 * lengths.std():.2f}",
        published,
        f"{1e3 * np.median(errors):.2f} {1e3 * errors.max():.2f}",
        f"{1e3 * np.mean(slides):.2f} {1e3 * np.std(slides):.2f}",
        f"{max(curvatures):.0f}",
    )


def goals(report: Report, groups: dict[tuple[str, float, str], list[Trial]]) -> None:
    """On the slippery table: what is folded without a camera, and with one."""
    for (case, friction, way), trials in groups.items():
        soft = case in ("A4 half", "A4 .25", "US half")
        if friction != FRICTIONS[0] or way not in ("slip", "ucs closed") or (way == "slip" and not soft):
            continue
        bound = 0.5e-3 if way == "slip" else 1e-3 if soft else 5e-3
        good = [t.failure is None and abs(t.error) < bound and (way != "slip" or abs(t.slide) < 1e-3) for t in trials]
        report.goal(f"{case}, {way}: share within {1e3 * bound:g} mm", float(np.mean(good)), 0.95)


def draw(groups: dict[tuple[str, float, str], list[Trial]]) -> None:
    """Errors of all trials, case by case, those that failed at the border."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    frictions = sorted({friction for _, friction, _ in groups})
    cases = list(dict.fromkeys(case for case, _, _ in groups))
    figure, axes = plt.subplots(
        len(frictions), 1, figsize=(1.5 + 1.7 * len(cases), 3.0 * len(frictions)), squeeze=False, layout="constrained"
    )
    ways = [way for way in WAYS if any(key[2] == way for key in groups)]
    for panel, friction in zip(axes[:, 0], frictions, strict=True):
        for j, way in enumerate(ways):
            places, errors = [], []
            for i, case in enumerate(cases):
                for trial in groups.get((case, friction, way), []):
                    places.append(i + 0.8 * (j + 0.5) / len(ways) - 0.4)
                    errors.append(1e3 * abs(trial.error) if trial.failure is None else 300.0)
            panel.plot(places, np.maximum(errors, 1e-2), ".", label=way, alpha=0.7)
        panel.set(yscale="log", ylim=(8e-3, 400), ylabel="error of the crease [mm]", title=f"friction {friction:g}")
        panel.set_xticks(range(len(cases)), cases)
        panel.axhline(250, color="#8a9299", linestyle=":", linewidth=1)
        panel.grid(True, axis="y", color="#e3e7ea")
    axes[0, 0].legend(frameon=False, fontsize=8, ncols=2)
    axes[-1, 0].set_xlabel("above the dotted line: no plan, or no fold")
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / "folding_trials.png", dpi=150)
    plt.close(figure)


def main() -> None:
    """Fold, list, compare."""
    options = arguments(
        __doc__,
        ("--trials", {"type": int, "default": 3}),
        ("--cases", {"nargs": "*", "choices": list(CASES), "default": list(CASES)}),
        ("--frictions", {"nargs": "*", "type": float, "default": list(FRICTIONS)}),
        ("--processes", {"type": int, "default": os.cpu_count() or 1}),
    )
    ways = [way for way, (asked, _) in WAYS.items() if asked["method"] in get_args(Method)]
    cases, frictions, count, sheet = options.cases, options.frictions, options.trials, {}
    if options.quick:
        cases, frictions, count, ways, sheet = cases[:1], frictions[:1], 1, ["ucs closed"], COARSE
    report = Report("folding_trials", quick=options.quick)
    groups = {key: [Trial(*key, SEEDS + i) for i in range(count)] for key in product(cases, frictions, ways)}
    groups = run(groups, sheet, 1 if options.quick else options.processes)
    header = (
        "case",
        "friction",
        "way",
        "folded",
        "length [cm]",
        "published",
        "error [mm]",
        "slide [mm]",
        "curv. [1/m]",
    )
    report.table("Folds: mean and spread; error: median and greatest", header, [row(t) for t in groups.values()])
    report.figures["failures"] = [
        f"{t.case}, {t.friction:g}, {t.way}, seed {t.seed}: {t.failure}"
        for ts in groups.values()
        for t in ts
        if t.failure
    ]
    goals(report, groups)
    draw(groups)
    report.write()


if __name__ == "__main__":
    main()
