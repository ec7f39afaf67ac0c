"""A gripper writes a word with a thread, letter after letter, without lifting it.

The letters are those of `Pattern.word`, as large as the thread allows: it may hang by at most 100 of its
gravito-bending lengths. The thread lies over itself where it crosses itself. By the intuitive way, with the jaw
straight above the place where the thread touches down, it comes to lie more than ten times as far from the word.

Writes out/write_word.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from withe.deployment import Cable, Pattern, deploy, plan
from withe.view import style

GRAVITO_BENDING_LENGTH, RADIUS = 0.0113, 8e-4  # [m], of a soft silicone thread
LONGEST = 85.0  # [Lgb] of a word: with its tail and the way to it the thread hangs by some 90
FRICTION = 0.8
ROUNDED = 0.06  # [heights of an x] by which letters may be rounded
WAYS = {"exact": "C0", "intuitive": "C1"}


def as_large_as_can_be(word: str) -> Pattern:
    """A word's pattern, of a length that the thread allows."""
    unit = Pattern.word(word, 1.0, smoothing=ROUNDED).length
    height = LONGEST * GRAVITO_BENDING_LENGTH / unit
    return Pattern.word(word, height, smoothing=ROUNDED * height, nodes=400)


def main() -> None:
    """Write, measure, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--word", default="tie", help="of letters a to z: the shorter, the larger, the better")
    parser.add_argument("--friction", type=float, default=FRICTION, help="of the floor")
    parser.add_argument("--nodes", type=int, default=250, help="of the thread")
    parser.add_argument("--ways", nargs="*", choices=WAYS, default=list(WAYS))
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 30 s.", flush=True)

    colors = style.use()
    pattern = as_large_as_can_be(arguments.word)
    tail = 4.0 * GRAVITO_BENDING_LENGTH
    thread = Cable(pattern.length + tail + 0.01, RADIUS, GRAVITO_BENDING_LENGTH)
    print(pattern, pattern.feasibility(thread, arguments.friction), sep="\n")
    figure, axes = plt.subplots(len(arguments.ways), 1, figsize=(7.5, 3.6 * len(arguments.ways)))
    for panel, way in zip(np.atleast_1d(axes), arguments.ways, strict=True):
        motion = plan(thread, pattern, way, crossings="over")
        static = way != "intuitive"  # a row of equilibria does not follow a thread that buckles and falls
        found = deploy(
            motion,
            friction=arguments.friction,
            nodes=arguments.nodes,
            quasi_static=static,
        )
        print(f"{way}: {1e3 * found.error:.1f} mm off on the mean, word of {1e3 * pattern.length:.0f} mm", flush=True)
        panel.plot(*(1e3 * pattern.raw.T), color=colors.ink, lw=1.0, ls=":", zorder=3)
        panel.plot(*(1e3 * found.laid[:, :2].T), color=WAYS[way], lw=3.0, solid_capstyle="round")
        panel.set_aspect("equal")
        style.label(panel, x=("x", "mm"), y=("y", "mm"))
        panel.set_title(f"{way}: {1e3 * found.error:.1f} mm off on the mean; dotted: the word")
    path = arguments.out / "write_word.png"
    figure.savefig(path)
    print(f"Wrote {path}.")


if __name__ == "__main__":
    main()
