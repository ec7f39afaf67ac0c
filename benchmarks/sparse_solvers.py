"""Our sparse LDL^T beside Eigen's and CHOLMOD on trees of rods, a pile and nets: builds and runs sparse_solvers.cpp.

    python benchmarks/sparse_solvers.py [--quick] [--executable build/make/benchmarks/sparse_solvers]

One factorisation and one solution of a Newton iteration, on one thread; orders of elimination are found beforehand.
CHOLMOD takes part where the system has it (libsuitesparse-dev). On piles of more and more rods that have settled, our
LDL^T stands beside conjugate gradients, preconditioned by each rod's own band; --quick takes the smallest.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import compiled
import numpy as np
from reporting import Report, Timing, arguments


def main() -> None:
    """Build, run, report."""
    options = arguments(__doc__, ("--executable", {"type": Path, "help": "built already"}))
    runs = compiled.repetitions(
        options.executable or compiled.build("sparse_solvers"),
        {},
        quick=options.quick,
        left_out="settled pile of (250|1000)" if options.quick else "^$",
    )
    seconds: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    unknowns, iterations = {}, {}
    for run in runs:
        scene, solver = run["run_name"].split("/")[:2]
        if run.get("error_occurred"):
            raise RuntimeError(f"{solver}, {scene}: {run['error_message']}")
        seconds[scene][solver].append(1e-6 * run["cpu_time"])
        if "unknowns" in run:
            unknowns[scene] = run["unknowns"]
        if "iterations of CG" in run:
            iterations[scene, solver] = run["iterations of CG"]
    timings = {scene: {solver: Timing(tuple(values)) for solver, values in of.items()} for scene, of in seconds.items()}
    settled = {scene: of for scene, of in timings.items() if scene.startswith("settled")}
    others = {scene: of for scene, of in timings.items() if scene not in settled}
    report = Report("sparse_solvers", quick=options.quick)
    solvers = sorted(next(iter(others.values())), key=lambda solver: (solver != "withe", solver))
    report.table(
        "Microseconds to factorise and solve",
        ("scene", "unknowns", *solvers),
        [
            (
                scene,
                f"{unknowns[scene]:.0f}",
                *(f"{1e6 * of[s].median:.0f} +- {100 * of[s].spread:.0f} %" for s in solvers),
            )
            for scene, of in others.items()
        ],
    )
    piles(report, dict(sorted(settled.items(), key=lambda item: unknowns[item[0]])), unknowns, iterations)
    report.figures["seconds"] = {
        f"{scene}/{solver}": timing.as_json() for scene, of in timings.items() for solver, timing in of.items()
    }
    for scene, of in others.items():
        fastest = min(timing.median for solver, timing in of.items() if solver != "withe")
        report.goal(f"{scene}: over the fastest of the others", of["withe"].median / fastest, 1.0, at_least=False)
    report.write()


def piles(
    report: Report,
    settled: dict[str, dict[str, Timing]],
    unknowns: dict[str, float],
    iterations: dict[tuple[str, str], float],
) -> None:
    """Factors beside conjugate gradients, and how both grow."""
    solvers = sorted(next(iter(settled.values())), key=lambda solver: (solver != "withe", len(solver)))
    rows: list[tuple[str, ...]] = []
    for scene, of in settled.items():
        counts = {s: f" ({iterations[scene, s]:.0f})" if (scene, s) in iterations else "" for s in solvers}
        rows.append((scene, f"{unknowns[scene]:.0f}", *(f"{1e3 * of[s].median:.4g}{counts[s]}" for s in solvers)))
    if len(settled) > 1:
        sizes = np.log([unknowns[scene] for scene in settled])
        grows = {s: np.polyfit(sizes, np.log([of[s].median for of in settled.values()]), 1)[0] for s in solvers}
        rows.append(("exponent of the unknowns", "", *(f"{grows[s]:.2f}" for s in solvers)))
    report.table("Milliseconds (iterations) of a Newton iteration", ("scene", "unknowns", *solvers), rows)
    for scene, of in settled.items():
        fastest = min(timing.median for solver, timing in of.items() if solver != "withe")
        report.goal(f"{scene}: over conjugate gradients", of["withe"].median / fastest, 1.0, at_least=False)


if __name__ == "__main__":
    main()
