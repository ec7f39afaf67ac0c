"""One fold of A4 by the poses of a file, open loop, in this engine and in PyElastica: how far the sheet slides.

python benchmarks/folding_replay.py [--quick]

The plan is without moment at the jaw ("ucs"), on a table with friction 0.12, on which it slides some millimetres. The
third answer is that of the continuum: a row of equilibria, what lies sliding as a rigid body by Coulomb's law.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from reporting import HAVE_ELASTICA, OUT, Report, arguments

from withe import folding
from withe.io import load_poses

TOLERANCE = 3e-3  # [m]


def motion_of(path: Path) -> np.ndarray:
    """Rows of time, x, z and angle from a file of poses."""
    rows = load_poses(path)
    angles = np.unwrap(2.0 * np.arctan2(rows[:, 6], rows[:, 4]))
    return np.stack([rows[:, 0], rows[:, 1], rows[:, 3], angles], axis=1)


def in_elastica(plan: folding.Plan, motion: np.ndarray, elements: int, duration: float) -> tuple[np.ndarray, float]:
    """Rows of time and slide of a fold in PyElastica, and processor time."""
    from elastica_sheet import SheetRun, Strip

    from withe.folding.paper_rods import strip_numbers

    paper = plan.paper
    line_density, bend, stretch = strip_numbers(paper)
    strip = Strip(paper.length, paper.thickness, bend, stretch, line_density, paper.friction)
    begin = time.thread_time()
    end = min(duration, motion[-1, 0])
    last = [np.interp(end, motion[:, 0], column) for column in motion.T]
    run = SheetRun(strip, np.vstack([motion[motion[:, 0] < end], last]), plan.jaw.depth, elements=elements)
    rows = [(now, positions[-1, 0] - paper.length) for now, positions in run.frames()]
    return np.array(rows), time.thread_time() - begin


def draw(curves: dict[str, np.ndarray]) -> None:
    """Slides over time."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for (name, rows), style in zip(curves.items(), ("-", "--", ":"), strict=False):
        axes.plot(rows[:, 0], 1e3 * rows[:, 1], style, label=name, linewidth=1.8)
    axes.set(xlabel="time [s]", ylabel="slide [mm]", title="A4 folded in half by the same file of poses, friction 0.12")
    axes.grid(True, color="#e3e7ea")
    axes.legend(frameon=False)
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / "folding_replay.png", dpi=150)
    plt.close(figure)


def main() -> None:
    """Fold, list, draw."""
    options = arguments(__doc__)
    report = Report("folding_replay", quick=options.quick)
    plan = folding.plan(folding.Paper.a4())
    OUT.mkdir(parents=True, exist_ok=True)
    motion = motion_of(plan.save(OUT / "folding_replay.csv"))
    begin = time.thread_time()
    folded = folding.SimulatedSheet(plan.paper).fold(plan, progress=False)
    took = time.thread_time() - begin
    record = folded.record
    curves = {
        "withe": np.stack([record.times, record.positions("sheet")[:, -1, 0] - plan.paper.length], axis=1),
        "continuum": np.stack([plan.times, plan.slide], axis=1),
    }
    rows = [("withe, 150 edges", f"{1e3 * folded.slide:.2f}", f"{took:.1f}")]
    rows.append(("continuum", f"{1e3 * plan.slide[-1]:.2f}", ""))
    report.goal("slide, off from the continuum [m]", abs(plan.slide[-1] - folded.slide), 1e-4, at_least=False)
    if HAVE_ELASTICA:
        for elements in (20,) if options.quick else (40, 60):
            duration = 0.01 if options.quick else np.inf
            found, seconds = in_elastica(plan, motion, elements, duration)
            curves[f"PyElastica, {elements} elements"] = found
            rows.append((f"PyElastica, {elements} elements", f"{1e3 * found[-1, 1]:.2f}", f"{seconds:.0f}"))
            if not options.quick:
                off = abs(found[-1, 1] - folded.slide)
                report.goal(f"slide, off from PyElastica with {elements} elements [m]", off, TOLERANCE, at_least=False)
    report.table("A4 in half, friction 0.12, open loop", ("", "slide [mm]", "processor s"), rows)
    if not options.quick:
        draw(curves)
    report.write()


if __name__ == "__main__":
    main()
