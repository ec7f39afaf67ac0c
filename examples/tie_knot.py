"""A trefoil and a reef knot, tied by laying cables down and then moving given points of them, without looking.

What is laid lies over what was laid before: such a diagram is always an unknot. For the trefoil (a thick rubber cable,
the dissertation's fourth) one gripper lifts a strand while the other leads the end below it; then that end is placed
over the next strand. For the reef knot the head of one cable is put over both ends of the other (its second), and these
over that head. Where the grippers reach is found by a rehearsal; noisy trials reach there too. In the end both ends
of each cable are pulled 20 mm apart, and `withe.knots` says which knot it is.

Writes out/tie_knot.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.deployment import Cable, LayPlan, Move, Pattern, Tying, plan, tie
from withe.view import style

FRICTION = 0.8
TAIL = 0.05  # [m]
SMOOTHING = 3e-3  # [m]
PULLED = 0.02  # [m]
LIFT = 0.05  # [m]
KNOTS = {"trefoil": ([1, -1, 1], None), "reef": ([1, -2, 3, -2, 1], 0)}  # Alexander polynomial, signature
COLORS = ("C3", "C0")


def through(*points: tuple[float, float]) -> Pattern:
    """A smooth pattern through points [m]."""
    from scipy.interpolate import CubicSpline

    way = np.array(points)
    share = np.concatenate([[0.0], np.cumsum(np.sqrt(np.linalg.norm(np.diff(way, axis=0), axis=1)))])
    fine = CubicSpline(share, way, bc_type="natural")(np.linspace(0.0, share[-1], 600))
    return Pattern(fine, smoothing=SMOOTHING)


def arc(centre: float, radius: float, first: float, last: float) -> list[tuple[float, float]]:
    """Points on a circle about (centre, 0), angles in degrees."""
    angles = np.radians(np.linspace(first, last, 9))
    return [(centre + radius * np.cos(angle), radius * np.sin(angle)) for angle in angles]


def laid(number: int, pattern: Pattern, way: str) -> LayPlan:
    """Plan for a cable of the dissertation that crosses over itself."""
    return plan(Cable.dlo(number), pattern, way, crossings="over", tail=TAIL)


def trefoil(way: str = "exact") -> tuple[list[LayPlan], list[list[Move]]]:
    """A loop, crossed once, the end beside it; then that end goes under the loop, and over it."""
    loop = [(-0.108, -0.0045), (-0.063, 0), (-0.018, 0), (0.027, 0), (0.072, 0.018), (0.09, 0.063), (0.072, 0.108)]
    back = [(0.027, 0.126), (-0.018, 0.108), (-0.038, 0.0675), (-0.0315, 0.027), (-0.009, -0.0135), (0.036, -0.0495)]
    rope = laid(4, through(*loop, *back, (0.09, -0.052), (0.135, -0.0225), (0.1485, 0.027)), way)
    end, strand = rope.cable.length, 0.232  # [m] from the free end
    up, down = (0, 0, LIFT), (0, 0, 1e-3)
    under = [(0, 0, 0), (-0.032, 0.009, 0), (-0.082, 0.009, 0), (-0.112, 0.004, 0), (-0.112, 0.004, 0)]
    over = [(-0.005, 0, 0.04), (-0.085, -0.005, 0.04), (-0.105, -0.01, 1e-3)]
    lifted = Move(0, strand, [up, up, up, up, down])
    led = Move(0, end, under, [0.0, 0.5, 1.0, 1.2, 1.2])
    pulled = [
        Move(0, end, [(-0.5 * PULLED, 0, 0.01), (-PULLED, 0, 0)]),
        Move(0, 0.0, [(-0.5 * PULLED, 0, 0.01), (-PULLED, 0, 0)]),
    ]
    return [rope], [[lifted, led], [Move(0, end, over)], pulled]


def reef(way: str = "exact") -> tuple[list[LayPlan], list[list[Move]]]:
    """A bight, another over its legs; then the first one's head goes over the ends of the other, and these over it."""
    x = np.linspace(-0.275, 0.0, 10)[:-1]
    width, middle, wide = 0.045, -0.06, 0.08
    first = through(*((a, width) for a in x), *arc(0.0, width, 90, -90), *((a, -width) for a in x[::-1]))
    second = through(
        *[(0.092, 0.008), (0.072, 0.034), (0.035, 0.062), (-0.015, 0.077)],
        *arc(middle, wide, 90, 270),
        *[(-0.015, -0.077), (0.025, -0.066), (0.05, -0.049)],
    )
    cables = [laid(4, first, way), laid(2, second, way)]
    ends = [cable.cable.length for cable in cables]
    head = 0.275 + 0.25 * 2 * np.pi * width
    over_ends = Move(0, head, [(0, 0, LIFT), (0.095, 0, LIFT), (0.095, 0, 1e-3)])
    over_head = [Move(1, at, [(0, 0, 0.04), (0.09, 0, 0.04), (0.1, 0, 2e-3)]) for at in (0.0, ends[1])]
    pulled = [
        Move(cable, at, [(0.5 * side * PULLED, 0, 0.01), (side * PULLED, 0, 0)])
        for cable, side in ((0, -1), (1, 1))
        for at in (0.0, ends[cable])
    ]
    return cables, [[over_ends], over_head, pulled]


TYING = {"trefoil": trefoil, "reef": reef}


def joined(centrelines: tuple[np.ndarray, ...]) -> tuple[np.ndarray, bool]:
    """One curve, and whether it is closed: ends of two cables are joined pairwise, far outside."""
    if len(centrelines) == 1:
        return centrelines[0], False
    first, second = centrelines
    far, near = 3.0, 0.3
    below = [(-far, -near, 0), (-far, -far, 0), (far, -far, 0), (far, -near, 0)]
    above = [(far, near, 0), (far, far, 0), (-far, far, 0), (-far, near, 0)]
    return np.concatenate([first, below, second[::-1], above]), True


def is_tied(name: str, found: Tying) -> bool:
    """True if the final cables form that knot."""
    curve, closed = joined(found.centrelines)
    polynomial, signature = KNOTS[name]
    seen = withe.knots.alexander_polynomial(curve, closed=closed).tolist()
    return seen == polynomial and (signature is None or withe.knots.signature(curve, closed=closed) == signature)


def draw(axes: object, found: Tying, name: str) -> None:
    """Draw the view from above. Higher parts hide lower parts."""
    paper = style.colors().paper
    for panel, title, shapes in zip(axes[: len(found.names)], found.names, found.shapes, strict=True):
        pieces = [
            (points[i : i + 2, 2].mean(), 1e3 * points[i : i + 2, :2], number)
            for number, points in enumerate(shapes)
            for i in range(len(points) - 1)
        ]
        for height, piece, number in sorted(pieces, key=lambda one: one[0]):
            wide = 4.5 if (name, number) != ("reef", 1) else 2.5
            panel.plot(*piece.T, color=paper, lw=wide + 2.5, solid_capstyle="butt", zorder=1 + height)
            panel.plot(*piece.T, color=COLORS[number], lw=wide, solid_capstyle="round", zorder=1 + height)
        panel.set(aspect="equal", xticks=[], yticks=[], title=title)
        panel.spines[:].set_visible(False)
    for panel in axes[len(found.names) :]:
        panel.set_axis_off()


def main() -> None:
    """Tie, name, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--knots", nargs="*", choices=TYING, default=list(TYING))
    parser.add_argument("--nodes", type=int, default=130, help="of each cable")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 90 s.", flush=True)

    style.use()
    found = {}
    for name in withe.track(arguments.knots, "tying", unit="knots"):
        plans, steps = TYING[name]()
        found[name] = tie(plans, steps, friction=FRICTION, nodes=arguments.nodes)
        print(
            f"{name}: tied {int(is_tied(name, found[name]))} of 1, moves that missed {len(found[name].missed)}",
            flush=True,
        )
    columns = max(len(one.names) for one in found.values())
    figure, axes = plt.subplots(len(found), columns, figsize=(3.0 * columns, 2.4 * len(found)), squeeze=False)
    for row, (name, one) in zip(axes, found.items(), strict=True):
        draw(row, one, name)
    path = arguments.out / "tie_knot.png"
    figure.savefig(path)
    print(f"Wrote {path}.")
    if not all(is_tied(name, one) for name, one in found.items()):
        sys.exit("Both knots must be tied.")


if __name__ == "__main__":
    main()
