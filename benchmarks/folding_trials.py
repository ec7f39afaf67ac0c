"""Sheets of the dissertation's chapter 7 folded in simulation, with noise that no planner sees, beside its table 7.2.

python benchmarks/folding_trials.py [--quick] [--trials 3] [--cases "A4 half" ...] [--ways ucs ...] [--resume]

Every fold is printed, and written to out/benchmarks/folding_trials.jsonl, as it ends. Ctrl-C makes the tables of what
there is; --resume goes on after that.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import asdict, dataclass, replace
from itertools import product

import numpy as np
from reporting import OUT, RESUME, Lines, Report, arguments

from withe import folding

CASES = {
    "A4 half": (folding.Paper.a4(), "half"),
    "A4 .25": (folding.Paper.a4(), 0.25),
    "US half": (folding.Paper.us_letter(), "half"),
    "US .20": (folding.Paper.us_letter(), 0.20),
    "cardboard half": (folding.Paper.cardboard(), "half"),
    "cardboard .20": (folding.Paper.cardboard(), 0.20),
    "origami .30": (folding.Paper.origami(), 0.30),
}
REPLANS = 5
LEFT = (0.02, 0.3)  # remaining uncertainty of Lgb and friction of measured and watched sheets
WAYS = {  # arguments of the planner, and true if the fold is watched
    "intuitive": ({"method": "intuitive"}, False),
    "local": ({"method": "local"}, False),
    "ucs": ({"method": "ucs"}, False),
    "slip": ({"method": "slip", "grasp": "free"}, False),
    "ucs closed": ({"method": "ucs", "replans": REPLANS, "uncertainty": LEFT}, True),
    "slip closed": ({"method": "slip", "grasp": "free"}, True),
    "ucs as a strip": ({"method": "ucs"}, False),
}
STRIP = "ucs as a strip"  # method of the dissertation for a square
ONLY = {STRIP: ("origami .30",)}
CURVATURES = {"cardboard half": 4.0, "cardboard .20": 6.5}  # bounds of free moments that such a fold needs [1/Lgb]
CORNERS = ("origami .30",)  # cases that bear no moment
PUBLISHED = {  # table 7.2, sheets 21 cm wide [cm]
    "A4 half": {"intuitive": "12.31 .63", "local": "13.51 .13", "ucs": "14.74 .05", "ucs closed": "14.64 .07"},
    "cardboard half": {"intuitive": "5.88 .38", "local": "none", "ucs": "12.8 .27", "ucs closed": "13.75 .19"},
}
FRICTIONS = (0.12, 0.3)
SEEDS = 1000  # the first of them
COARSE = {"edges": 75, "time_step": 0.02}


Key = tuple[str, float, str]  # case, friction, way


def trial_of(key: Key, seed: int, sheet: dict) -> folding.Trial:
    """One fold. The seed determines the difference between its sheet and the paper."""
    case, friction, way = key
    paper, target = CASES[case]
    asked, watched = WAYS[way]
    if case in CORNERS:
        asked = {**asked, "grasp": "moment_free"}
    return folding.Trial(
        replace(paper, friction=friction),
        target,
        seed,
        replans=REPLANS if watched else 0,
        planner={**asked, "curvature": CURVATURES.get(case) if asked.get("grasp") == "free" else None},
        sheet=sheet,
        believed=replace(paper, outline=folding.Paper.a4().outline, friction=friction) if way == STRIP else None,
        name=name_of(key),
    )


def name_of(key: Key) -> str:
    """Name of a trial."""
    return ", ".join(map(str, key))


@dataclass(frozen=True)
class Folded:
    """Result of one trial, as a line of a file."""

    case: str
    friction: float
    way: str
    seed: int
    sheet: dict
    length: float
    error: float
    slide: float
    curvature: float
    needed: float
    plunges: bool
    blocked: str | None
    failure: str | None
    seconds: float

    @property
    def key(self) -> Key:
        """Which group it belongs to."""
        return self.case, self.friction, self.way

    @classmethod
    def of(cls, key: Key, outcome: folding.Outcome) -> Folded:
        """Return a fold from an outcome of `run_trials`."""
        return cls(
            *key,
            outcome.trial.seed,
            dict(outcome.trial.sheet),
            outcome.length,
            outcome.error,
            outcome.slide,
            outcome.max_curvature,
            outcome.needed_friction,
            outcome.plunges,
            outcome.blocked,
            outcome.failure,
            outcome.seconds,
        )

    def __str__(self) -> str:
        head = f"{self.case}, {self.friction:g}, {self.way}, seed {self.seed}: "
        done = f"error {1e3 * self.error:.2f} mm, slide {1e3 * self.slide:.2f} mm"
        return f"{head}{self.failure or done} ({self.seconds:.0f} s)"


def run(wanted: dict[Key, list[folding.Trial]], options: argparse.Namespace) -> list[Folded]:
    """Carry out trials, and print and write each at its end. Return the completed ones."""
    lines = Lines("folding_trials", resume=options.resume)
    asked = [(key, trial.seed, trial.sheet) for key, trials in wanted.items() for trial in trials]
    folds = [fold for fold in (Folded(**line) for line in lines.known) if (fold.key, fold.seed, fold.sheet) in asked]
    done = {(fold.key, fold.seed) for fold in folds}
    left = [trial for key, trials in wanted.items() for trial in trials if (key, trial.seed) not in done]
    left.sort(key=lambda trial: trial.seed)  # after an interruption all lines have nearly the same number of folds
    keys = {name_of(key): key for key in wanted}
    try:
        for outcome in folding.run_trials(left, workers=options.processes):
            folds.append(Folded.of(keys[outcome.trial.name], outcome))
            lines.add(asdict(folds[-1]))
            print(folds[-1], flush=True)
    except KeyboardInterrupt:
        print(f"\ninterrupted: {len(folds)} folds of {len(asked)} are in the table; --resume goes on", flush=True)
        return folds
    return folds


def row(folds: list[Folded], count: int) -> tuple[str, ...]:
    """A line of the table."""
    first, folded = folds[0], [fold for fold in folds if fold.failure is None]
    published = PUBLISHED.get(first.case, {}).get(first.way, "") if first.friction == FRICTIONS[0] else ""
    of = f"{len(folds)}" if len(folds) == count else f"{len(folds)}, {count - len(folds)} not run"
    head = (first.case, f"{first.friction:g}", first.way, f"{len(folded)} of {of}")
    asked = [fold.needed for fold in folds if np.isfinite(fold.needed)]
    needed = f"{np.median(asked):.3f}" if asked else ""
    plunges, blocked = sum(fold.plunges for fold in folds), sum(infeasible(fold) for fold in folds)
    ends = (f"{plunges}" if plunges else "", f"{blocked}" if blocked else "")
    seconds = f"{np.mean([fold.seconds for fold in folds]):.0f}"
    if not folded:
        why = "no plan" if all((fold.failure or "").startswith("no plan") for fold in folds) else "none folds"
        return (*head, why, published, "", "", "", needed, *ends, seconds)
    lengths, errors = np.array([f.length for f in folded]), np.abs([f.error for f in folded])
    slides, curvatures = [f.slide for f in folded], [f.curvature for f in folded]
    return (
        *head,
        f"{100 * lengths.mean():.2f} {100 * lengths.std():.2f}",
        published,
        f"{1e3 * np.median(errors):.2f} {1e3 * errors.max():.2f}",
        f"{1e3 * np.mean(slides):.2f} {1e3 * np.std(slides):.2f}",
        f"{max(curvatures):.0f}",
        needed,
        *ends,
        seconds,
    )


def infeasible(fold: Folded) -> bool:
    """True if the planner found no way, or none within the uncertainty of the sheet."""
    return fold.blocked is not None or (fold.failure or "").startswith("no plan: no path")


def goals(report: Report, groups: dict[Key, list[Folded]]) -> None:
    """Return cases on the slippery table, without and with a camera."""
    for (case, friction, way), folds in groups.items():
        soft = case in ("A4 half", "A4 .25", "US half", "origami .30")
        if friction != FRICTIONS[0] or not (way == "slip" or (soft and way == "ucs closed")):
            continue
        bound = (0.5e-3 if way == "slip" else 1e-3) if soft else 5e-3
        strict = way == "slip" and soft
        good = [f.failure is None and abs(f.error) < bound and (not strict or abs(f.slide) < 1e-3) for f in folds]
        refused = [not soft and infeasible(fold) for fold in folds]
        said = "" if soft else ", or said to be infeasible"
        share = float(np.mean(np.logical_or(good, refused)))
        report.goal(f"{case}, {way}: share of {len(folds)} within {1e3 * bound:g} mm{said}", share, 0.95)


def draw(groups: dict[Key, list[Folded]]) -> None:
    """Draw errors of all trials, per case. Failed trials are at the border."""
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
                for fold in groups.get((case, friction, way), []):
                    places.append(i + 0.8 * (j + 0.5) / len(ways) - 0.4)
                    errors.append(1e3 * abs(fold.error) if fold.failure is None else 300.0)
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
        ("--ways", {"nargs": "*", "choices": list(WAYS), "default": list(WAYS)}),
        ("--processes", {"type": int, "default": os.cpu_count() or 1}),
        ("--edges", {"type": int, "default": 150, "help": "of the sheet"}),
        ("--time-step", {"type": float, "default": 0.01, "help": "[s]"}),
        RESUME,
    )
    cases, frictions, ways, count = options.cases, options.frictions, options.ways, options.trials
    sheet = {"edges": options.edges, "time_step": options.time_step}
    if options.quick:
        cases, frictions, count, ways, sheet, options.processes = cases[:1], frictions[:1], 1, ["ucs closed"], COARSE, 1
    report = Report("folding_trials", quick=options.quick)
    keys = [key for key in product(cases, frictions, ways) if key[0] in ONLY.get(key[2], CASES)]
    wanted = {key: [trial_of(key, SEEDS + i, sheet) for i in range(count)] for key in keys}
    folds = run(wanted, options)
    groups = {key: [fold for fold in folds if fold.key == key] for key in wanted}
    groups = {key: folds for key, folds in groups.items() if folds}
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
        "needs friction",
        "plunges",
        "said infeasible",
        "s a fold",
    )
    rows = [row(folds, count) for folds in groups.values()]
    report.table("Folds: mean and spread; error: median and greatest", header, rows)
    report.figures["slowest [s]"] = max((fold.seconds for fold in folds), default=0.0)
    report.figures["failures"] = [str(fold) for fold in folds if fold.failure]
    if folds:
        goals(report, groups)
    if groups:
        draw(groups)
    report.write()


if __name__ == "__main__":
    main()
