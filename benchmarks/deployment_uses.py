"""Table 9.6 of the dissertation from simulation: cables placed between posts, and knots, both ways of laying.

python benchmarks/deployment_uses.py [--quick] [--trials 1] [--uses S U trefoil reef]

Each use without noise, through equilibria where it is placement, and in noisy trials, in time: those of `deploy`, in
Lgb, friction, natural curvature and what the gripper is off by. For placement the planner has measured the cable with
a ruler that is off by .5 mm; for knots it has not. A placement succeeds if the cable passes every post on
its right side; a knot if it is there when its ends were pulled 20 mm apart. Knots are tied without looking: grippers
reach where a rehearsal with exact grasps found the cable. The cases are those of examples/place_cable.py and
examples/tie_knot.py. Ctrl-C makes the table of what there is.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from reporting import ROOT, Report, arguments, bar

sys.path.insert(0, str(ROOT / "examples"))
import place_cable
import tie_knot

from withe.common.progress import Progress
from withe.deployment import Cable, measure, tie, trial_cable
from withe.deployment.cable import LOOP_HEIGHT
from withe.errors import ConvergenceError

WAYS = ("exact", "intuitive")
PUBLISHED = {"S": "9, 0", "U": "9, 0", "trefoil": "9, 0", "reef": "7, 0"}  # of 10: optimal, intuitive
GOALS = {"S": 0.9, "U": 0.9, "trefoil": 0.9, "reef": 0.7}
NODES, QUICK_NODES = 130, 60
RULER = 5e-4  # [m], standard deviation


def placed(letter: str, way: str, seed: int, noise: float, nodes: int = NODES) -> tuple[bool, str]:
    """Whether every post was passed on its right side, and how many were."""
    static = noise == 0.0 and way != "intuitive"
    known = measured(Cable.dlo(5), seed) if noise else None
    found = place_cable.laid(letter, way, nodes, known=known, seed=seed, noise=noise, static=static)
    return bool(found.passed.all()), f"{found.passed.sum()} of {len(found.passed)} posts"


def measured(cable: Cable, seed: int) -> Cable:
    """What a planner knows of the cable of a trial: the height of its loop, by a ruler."""
    height = LOOP_HEIGHT * trial_cable(cable, seed).gravito_bending_length
    read = height + RULER * np.random.default_rng((seed, 1)).normal()
    return replace(cable, gravito_bending_length=measure(height=read).gravito_bending_length)


class Knots:
    """Knots by name; each is rehearsed once."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes
        self._picks: dict[str, tuple] = {}

    def tied(self, name: str, way: str, seed: int, noise: float) -> tuple[bool, str]:
        """Whether the knot is there in the end, and how many moves found no cable."""
        plans, steps = tie_knot.TYING[name](way)
        if name not in self._picks:
            rehearsed = tie_knot.TYING[name]("exact")
            self._picks[name] = tie(*rehearsed, floor=tie_knot.FRICTION, nodes=self.nodes).picks
        found = tie(
            plans, steps, floor=tie_knot.FRICTION, picks=self._picks[name], seed=seed, noise=noise, nodes=self.nodes
        )
        return tie_knot.is_tied(name, found), f"{len(found.missed)} moves missed"


def tried(knots: Knots, use: str, way: str, trials: int, shown: Progress) -> tuple[str, str, str]:
    """Whether it succeeds without noise, in how many noisy trials, and what each came to."""
    attempt = knots.tied if use in tie_knot.TYING else partial(placed, nodes=knots.nodes)
    done, said = [], []
    for seed in range(trials + 1):
        try:
            success, words = attempt(use, way, seed, 1.0 if seed else 0.0)
        except ConvergenceError:
            success, words = False, "engine gave up"
        done.append(success)
        said.append(words)
        shown.advance(1)
    return "yes" if done[0] else "no", f"{sum(done[1:])} of {trials}", "; ".join(said)


def main() -> None:
    """Try, count, compare."""
    options = arguments(
        __doc__,
        ("--trials", {"type": int, "default": 1, "help": "noisy ones of each use and way; the dissertation has 10"}),
        ("--uses", {"nargs": "*", "choices": tuple(GOALS), "default": list(GOALS)}),
        ("--ways", {"nargs": "*", "choices": WAYS, "default": list(WAYS)}),
    )
    uses, ways, trials, nodes = options.uses, options.ways, options.trials, NODES
    if options.quick:
        uses, ways, trials, nodes = ["U"], ["exact"], 0, QUICK_NODES
    report = Report("deployment_uses", quick=options.quick)
    knots = Knots(nodes)
    rows: list[tuple] = []
    with bar(len(uses) * len(ways) * (1 + trials), "trying", "trials") as shown:
        try:
            for use, way in product(uses, ways):
                row = tried(knots, use, way, trials, shown)
                rows.append((use, way, *row, PUBLISHED[use]))
                print(*rows[-1], sep="  ", flush=True)
        except KeyboardInterrupt:
            report.figures["interrupted"] = f"{len(rows)} of {len(uses) * len(ways)} rows"
    for use, way, alone, noisy, *_ in rows:
        if way == "exact":
            report.goal(f"{use}: without noise", float(alone == "yes"), 1.0)
            report.goal(f"{use}: share of noisy trials", int(noisy.split()[0]) / trials if trials else None, GOALS[use])
    header = ("use", "way", "without noise", "noisy trials", "without noise, then each trial", "published, of 10")
    report.table("Uses: exact and intuitive ways of laying", header, rows)
    report.write()


if __name__ == "__main__":
    main()
