"""Draw the table "Run time at the same error" of `peers` in benchmarks/README.md into benchmarks/pictures/peers.png.

    python benchmarks/peers_picture.py

`tables.py` draws the picture again after each run of `peers`.
"""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).with_name("README.md")
PICTURE = Path(__file__).parent / "pictures" / "peers.png"
COLUMNS = {"withe": 2, "PyElastica": 3, "MuJoCo": 5}  # of the table
SECONDS = {"us": 1e-6, "ms": 1e-3, "s": 1.0}


def run_times(page: str) -> dict[str, dict[str, list[tuple[float, float]]]]:
    """Return errors and run times [s] of each simulator in each scene, from the text of the page."""
    table = re.search(r"^## peers\n.*?\*\*Run time at the same error\*\*\n\n(.*?)\n\n", page, re.DOTALL | re.M)
    if table is None:
        raise ValueError("the page of the benchmarks has no table of run times at the same error")
    found: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for row in table[1].splitlines()[2:]:
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        of_scene = found.setdefault(cells[0], {simulator: [] for simulator in COLUMNS})
        for simulator, column in COLUMNS.items():
            number, _, unit = cells[column].partition(" ")
            if unit in SECONDS:  # others are words, such as "not reached"
                of_scene[simulator].append((float(cells[1].split()[0]), float(number) * SECONDS[unit]))
    return found


def draw(page: str, path: Path = PICTURE) -> None:
    """Draw run times against errors, a panel for each scene."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    from withe.view import style

    colors = style.use()
    scenes = run_times(page)
    figure, panels = plt.subplots(2, 3, figsize=(10.8, 6.0), layout="constrained")
    for axes, (scene, times) in zip(panels.flat, scenes.items(), strict=True):
        for (simulator, points), color, marker in zip(
            times.items(), (colors.blue, colors.orange, colors.green), "os^", strict=True
        ):
            errors, seconds = zip(*points, strict=True) if points else ((), ())
            axes.loglog(errors, [1e3 * each for each in seconds], marker=marker, color=color, label=simulator)
        marks = sorted({error for points in times.values() for error, _ in points})
        shown = [1e3 * second for points in times.values() for _, second in points]
        low, high = np.floor(np.log10(min(shown))), np.ceil(np.log10(max(shown)))
        axes.set(title=scene, xlim=(1.2 * marks[-1], marks[0] / 1.2), ylim=(10.0**low, 10.0**high))
        style.label(axes, x=("relative error", "-"), y=("run time", "ms"))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("")
        axes.set_xticks(marks)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    draw(PAGE.read_text())
