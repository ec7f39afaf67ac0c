"""A4 is folded in half on a slippery table, in simulation: on half a circle, and as planned in two ways.

The sheet is a rod of 150 edges with inertia, contact and friction of 0.12, and none of it is in the planner, which
knows the continuum's equilibria. On half a circle the sheet is pushed away until it snaps over (7.18 of Choi's
dissertation); where the accumulated ratio of forces is least it slides by some millimetres. A jaw that may
bend the sheet at its edge can keep the table's force upright all along ("slip", "free"): then nothing slides.
Fails when a planned fold slides by 0.2 mm more or less than is predicted, and when half a circle does not snap.

Writes out/fold_sheet.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from withe import folding
from withe.view import style

EDGES, TIME_STEP = 150, 0.01  # [s]
SLIDE_OFF = 2e-4  # [m]
MOMENTS = 5  # number of pictures of a film


def film(axes: np.ndarray, fold: folding.Fold, jaw: folding.Jaw, title: str, colors: style.Colors) -> None:
    """Draw the sheet from the side at some moments, in front of its shapes between these moments."""
    record = fold.record
    frames = np.linspace(0, len(record) - 1, MOMENTS).round().astype(int)
    positions = 1e3 * record.positions("sheet")
    held = int(np.searchsorted(positions[0, :, 0], 1e3 * jaw.depth + 1e-6))
    length = positions[0, -1, 0]
    for i, (panel, frame) in enumerate(zip(axes, frames, strict=True)):
        panel.axhspan(-12, 0, color=colors.pale)
        panel.axvline(length, color=colors.grey, linestyle=":", linewidth=1)
        before = frames[i - 1] if i else 0
        for ghost in np.linspace(before, frame, 5).round().astype(int)[:-1]:
            panel.plot(positions[ghost, :, 0], positions[ghost, :, 2], color=colors.grey, alpha=0.5, linewidth=0.8)
        panel.plot(positions[frame, :, 0], positions[frame, :, 2], color=colors.blue, linewidth=1.6)
        panel.plot(positions[frame, :held, 0], positions[frame, :held, 2], color=colors.red, linewidth=4)
        panel.text(0.97, 0.93, f"{record.times[frame]:.1f} s", transform=panel.transAxes, ha="right", va="top")
        panel.set(xlim=(-30, 500), ylim=(-12, 190), aspect="equal")
        panel.grid(False)
    style.label(axes[0], y=("z", "mm"))
    axes[0].text(0.0, 1.08, title, transform=axes[0].transAxes, fontsize=10).set_in_layout(False)


def main() -> None:
    """Plan, fold, compare, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--edges", type=int, default=EDGES)
    parser.add_argument("--time-step", type=float, default=TIME_STEP)
    parser.add_argument("--out", type=Path, default=Path("out"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 7 s.", flush=True)

    paper = folding.Paper.a4()
    sheet = folding.SimulatedSheet(paper, edges=options.edges, time_step=options.time_step)
    circle, held, bent = (
        folding.plan(paper, method="intuitive"),
        folding.plan(paper, method="ucs"),
        folding.plan(paper, method="slip", grasp="free"),
    )
    folds = [sheet.fold(plan) for plan in (circle, held, bent)]
    titles = [f"half a circle: the sheet slides by {1e3 * folds[0].slide:.0f} mm and snaps"]
    for name, plan, fold in zip(("least force", "no force along the table"), (held, bent), folds[1:], strict=True):
        titles.append(
            f"{name}: it slides by {1e3 * fold.slide:.2f} mm (predicted {1e3 * plan.slide[-1]:.2f}), "
            f"and the edges miss by {2e3 * abs(fold.error):.2f} mm"
        )
    colors = style.use()
    figure, axes = plt.subplots(3, MOMENTS, figsize=(11.5, 4.2), sharex=True, sharey=True)
    for row, fold, title in zip(axes, folds, titles, strict=True):
        film(row, fold, sheet.jaw, title, colors)
    for panel in axes[-1]:
        style.label(panel, x=("x", "mm"))
    figure.savefig(options.out / "fold_sheet.png")
    plt.close(figure)
    print("\n".join(title[0].upper() + title[1:] + "." for title in titles))
    print(f"Wrote {options.out / 'fold_sheet.png'}.")
    if folds[0].failure is None or any(fold.failure is not None for fold in folds[1:]):
        sys.exit("Half a circle should snap, and the plans should not.")
    if any(abs(fold.slide - plan.slide[-1]) > SLIDE_OFF for plan, fold in zip((held, bent), folds[1:], strict=True)):
        sys.exit("That is not how the sheet should slide.")


if __name__ == "__main__":
    main()
