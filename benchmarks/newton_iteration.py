"""One Newton iteration beside LAPACK's dpbsv on the same band: builds and runs newton_iteration.cpp.

    python benchmarks/newton_iteration.py [--quick] [--executable build/make/benchmarks/newton_iteration]

dpbsv comes from reference LAPACK where the system has it (liblapack3), and from OpenBLAS on one thread: the system's,
or the one that SciPy carries.
"""

from __future__ import annotations

import ctypes
from collections import defaultdict
from pathlib import Path

import compiled
import scipy
from reporting import Report, Timing, arguments

NODES = (101, 201, 1001, 10001)
SYSTEM = [Path("/usr/lib", name) for name in ("x86_64-linux-gnu", "aarch64-linux-gnu")]


def _lapack_version(library: ctypes.CDLL, symbol: str) -> str:
    numbers = [ctypes.c_int() for _ in range(3)]
    getattr(library, symbol)(*(ctypes.byref(number) for number in numbers))
    return ".".join(str(number.value) for number in numbers)


def _lapacks() -> dict[str, tuple[Path, str, str]]:
    """Return the available LAPACK libraries by label: the file, the name of dpbsv in it, and its version."""
    found = {}
    reference = [path for folder in SYSTEM for path in (folder / "lapack").glob("liblapack.so.3")]
    own = [path for folder in SYSTEM for path in folder.glob("openblas*/libopenblas.so.0")]
    carried = list((Path(scipy.__file__).parent.parent / "scipy.libs").glob("libscipy_openblas-*"))
    for label, paths, prefix in (("reference", reference, ""), ("OpenBLAS", own, ""), ("OpenBLAS", carried, "scipy_")):
        if label in found or not paths:
            continue
        library = ctypes.CDLL(str(paths[0]))
        version = f"LAPACK {_lapack_version(library, prefix + 'ilaver_')}"
        if label == "OpenBLAS":
            config = getattr(library, f"{prefix}openblas_get_config")
            config.restype = ctypes.c_char_p
            version += f", {config().decode()}"
        found[label] = paths[0], f"{prefix}dpbsv_", version
    return found


def _run(executable: Path, lapacks: dict, quick: bool) -> dict[tuple[str, int], Timing]:
    """All of them in random order, again and again; seconds by name and number of nodes."""
    environment = {
        "WITHE_LAPACKS": ";".join(f"{label}={path}={symbol}" for label, (path, symbol, _) in lapacks.items())
    }
    seconds = defaultdict(list)
    for run in compiled.repetitions(executable, environment, quick=quick):
        name, nodes = run["name"].split("/")[:2]
        # Processor time of both. That of dpbsv is measured by hand, without the copy of the band, and called real.
        seconds[name, int(nodes)].append(1e-6 * run["real_time" if "dpbsv" in name else "cpu_time"])
    return {key: Timing(tuple(values)) for key, values in seconds.items()}


def main() -> None:
    """Build, run, report."""
    options = arguments(__doc__, ("--executable", {"type": Path, "help": "built already"}))
    lapacks = _lapacks()
    timings = _run(options.executable or compiled.build("newton_iteration"), lapacks, options.quick)
    report = Report("newton_iteration", quick=options.quick)
    names = sorted({name for name, _ in timings}, key=lambda name: (name.startswith("dpbsv"), name))

    def cell(name: str, nodes: int) -> str:
        timing = timings[name, nodes]
        return f"{1e6 * timing.median:.1f} +- {100 * timing.spread:.0f} %"

    rows = [(name, *(cell(name, nodes) for nodes in NODES)) for name in names]
    per_node = {nodes: 1e6 * timings["newton", nodes].median / nodes for nodes in NODES}
    rows.append(("newton, a node", *(f"{per_node[nodes]:.2f}" for nodes in NODES)))
    fastest = {nodes: min((timings[f"dpbsv {x}", nodes].median for x in lapacks), default=None) for nodes in NODES}
    ratios = {n: timings["newton", n].median / fastest[n] if fastest[n] else None for n in NODES}
    rows.append(("newton / faster dpbsv", *(f"{ratios[n]:.2f}" if ratios[n] else "-" for n in NODES)))
    report.table("Microseconds", ("nodes", *map(str, NODES)), rows)
    report.table("Libraries", ("name", "version"), [(label, version) for label, (_, _, version) in lapacks.items()])
    report.figures["seconds"] = {f"{name}/{nodes}": timing.as_json() for (name, nodes), timing in timings.items()}
    for nodes in NODES[:3]:
        report.goal(f"{nodes} nodes: an iteration over dpbsv", ratios[nodes], 1.6, at_least=False)
        report.goal(f"{nodes} nodes: us a node", per_node[nodes], 0.55, at_least=False)
    report.goal("cost a node at 10001 over that at 101", per_node[10001] / per_node[101], 1.25, at_least=False)
    report.write()


if __name__ == "__main__":
    main()
