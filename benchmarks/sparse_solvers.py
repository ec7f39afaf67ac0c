"""Our sparse LDL^T beside Eigen's and CHOLMOD on trees of rods and a pile: builds and runs sparse_solvers.cpp.

    python benchmarks/sparse_solvers.py [--quick] [--executable build/make/benchmarks/sparse_solvers]

One factorisation and one solution of a Newton iteration, on one thread; orders of elimination are found beforehand.
CHOLMOD takes part where the system has it (libsuitesparse-dev).
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import compiled
from reporting import Report, Timing, arguments


def main() -> None:
    """Build, run, report."""
    options = arguments(__doc__, ("--executable", {"type": Path, "help": "built already"}))
    runs = compiled.repetitions(options.executable or compiled.build("sparse_solvers"), {}, quick=options.quick)
    seconds: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    unknowns = {}
    for run in runs:
        scene, solver = run["run_name"].split("/")[:2]
        if run.get("error_occurred"):
            raise RuntimeError(f"{solver}, {scene}: {run['error_message']}")
        seconds[scene][solver].append(1e-6 * run["cpu_time"])
        if "unknowns" in run:
            unknowns[scene] = run["unknowns"]
    timings = {scene: {solver: Timing(tuple(values)) for solver, values in of.items()} for scene, of in seconds.items()}
    report = Report("sparse_solvers", quick=options.quick)
    solvers = sorted(next(iter(timings.values())), key=lambda solver: (solver != "withe", solver))
    report.table(
        "Microseconds to factorise and solve",
        ("scene", "unknowns", *solvers),
        [
            (
                scene,
                f"{unknowns[scene]:.0f}",
                *(f"{1e6 * of[s].median:.0f} +- {100 * of[s].spread:.0f} %" for s in solvers),
            )
            for scene, of in timings.items()
        ],
    )
    report.figures["seconds"] = {
        f"{scene}/{solver}": timing.as_json() for scene, of in timings.items() for solver, timing in of.items()
    }
    for scene, of in timings.items():
        fastest = min(timing.median for solver, timing in of.items() if solver != "withe")
        report.goal(f"{scene}: over the fastest of the others", of["withe"].median / fastest, 1.0, at_least=False)
    report.write()


if __name__ == "__main__":
    main()
