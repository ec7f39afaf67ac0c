"""A stiff cable is placed between posts: a letter that the floor alone would not hold, S or U.

A USB cable (the fifth of the dissertation, Lgb = 80 mm) is laid down between pairs of posts that leave 3 mm on either
side of it. Its free end is held, so that it slides up and down only, until the jaw opens: a free one slides ahead, and
what is laid behind it becomes too long for the bends. While it is laid the jaw keeps it on its pattern; what friction
does not hold then, the posts do. The intuitive way, with the jaw straight above the place where the cable touches
down, misses them.

Writes out/place_cable.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from withe import track
from withe.deployment import Cable, Deployment, Pattern, deploy, plan, posts_along
from withe.view import style

FRICTION = 0.4
HELD = 1.5  # coefficient of friction of a floor that holds the letters; posts replace it
EASING = 0.14  # [m]
LETTERS = {  # turns [rad], radii, straight pieces [m]; places of posts as shares of the length
    "U": ((np.pi,), (0.095,), (0.14, 0.14), np.linspace(0.12, 0.88, 7)),
    "S": ((1.8, -1.8), (0.105, 0.105), (0.09, 0.05, 0.08), np.linspace(0.1, 0.85, 8)),
}
COLORS = {"exact": "C0", "intuitive": "C1"}


def laid(
    letter: str,
    controller: str,
    nodes: int,
    *,
    known: Cable | None = None,
    seed: int = 0,
    noise: float = 0.0,
    static: bool = True,
) -> Deployment:
    """The cable after it was placed, through equilibria or in time, without noise or in a noisy trial.

    `known` is what the planner takes it for. "optimised" plans are improved as if the floor held the cable.
    """
    turns, radii, straights, shares = LETTERS[letter]
    pattern, cable = Pattern.bends(turns, radii, straights, easing=EASING), Cable.dlo(5)
    posts = posts_along(pattern, cable, shares * pattern.length)
    motion = plan(
        known or cable,
        pattern,
        controller,
        posts=posts,
        start="held",
        crossings="over",
        friction=HELD,
        progress=False,
    )
    return deploy(
        motion, cable, friction=FRICTION, seed=seed, noise=noise, quasi_static=static, nodes=nodes, progress=False
    )


def draw(axes: Axes, letter: str, found: dict[str, Deployment], colors: style.Colors) -> None:
    """From above: posts, and where each way of laying left the cable."""
    turns, radii, straights, shares = LETTERS[letter]
    pattern, cable = Pattern.bends(turns, radii, straights, easing=EASING), Cable.dlo(5)
    for post in posts_along(pattern, cable, shares * pattern.length):
        axes.add_patch(plt.Circle((1e3 * post.x, 1e3 * post.y), 1e3 * post.radius, color=colors.grey))
    axes.plot(*(1e3 * pattern.points.T), color=colors.ink, lw=1.0, ls=":", zorder=3, label="pattern")
    for way, result in found.items():
        missed = int((~result.passed).sum())
        axes.plot(
            *(1e3 * result.laid[:, :2].T),
            color=COLORS[way],
            lw=2.5 if way == "exact" else 1.5,
            label=f"{way}: {missed} of {len(result.passed)} posts missed",
        )
    axes.set(aspect="equal", title=letter)
    style.label(axes, x=("x", "mm"), y=("y", "mm"))
    style.legend(axes, side="top", ncols=1)


def main() -> None:
    """Place, check, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--nodes", type=int, default=150, help="of the cable")
    parser.add_argument("--letters", nargs="*", choices=LETTERS, default=list(LETTERS))
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 25 s.", flush=True)

    colors = style.use()
    figure, axes = plt.subplots(1, len(arguments.letters), figsize=(10.0, 4.4), squeeze=False)
    placed = True
    for panel, letter in zip(axes[0], arguments.letters, strict=True):
        found = {way: laid(letter, way, arguments.nodes) for way in track(COLORS, f"placing {letter}", unit="cables")}
        for way, result in found.items():
            print(
                f"{letter}, {way}: passes {result.passed.sum()} of {len(result.passed)} posts on its side", flush=True
            )
        placed &= bool(found["exact"].passed.all()) and not found["intuitive"].passed.all()
        draw(panel, letter, found, colors)
    path = arguments.out / "place_cable.png"
    figure.savefig(path)
    print(f"Wrote {path}.")
    if not placed:
        sys.exit("The exact way must pass every post on its right side, the intuitive one must not.")


if __name__ == "__main__":
    main()
