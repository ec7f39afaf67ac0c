"""Table 9.6 of the dissertation from simulation: cables placed between posts, and knots, both ways of laying.

python benchmarks/deployment_uses.py [--quick] [--trials 1] [--uses S U trefoil reef] [--resume]

Each use runs without noise and in noisy trials. Placement without noise goes through equilibria; noisy trials run in
time. The noise is that of `deploy`: in Lgb, friction, natural curvature and the error of the gripper. For placement the
planner has measured the cable. A ruler that is off by 0.5 mm measures its loop. For the way "optimised", pictures of
the hanging cable show how the cable bends by itself. For knots the planner has not measured the cable. A placement
succeeds if the cable passes every post on its right side; a knot if it is there when its ends were pulled 20 mm apart.
While a cable is placed its free end is held. Knots are tied without looking: grippers reach where a rehearsal with
exact grasps found the cable. The cases are those of examples/place_cable.py and examples/tie_knot.py. Goals are of the
way "exact". Each trial is printed, and written to out/benchmarks/deployment_uses.jsonl, as it ends. Ctrl-C makes the
table of what there is; --resume goes on after that.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product

import numpy as np
from deployment_measuring import PIXEL, photographed
from reporting import RESUME, ROOT, Lines, Report, arguments, bar

sys.path.insert(0, str(ROOT / "examples"))
import place_cable
import tie_knot

from withe.deployment import Cable, hang, measure, measure_curvature, tie, trial_cable
from withe.deployment.cable import LOOP_HEIGHT
from withe.errors import ConvergenceError

WAYS = ("exact", "optimised", "intuitive")  # optimised: placement only
PUBLISHED = {"S": "9, 0", "U": "9, 0", "trefoil": "9, 0", "reef": "7, 0"}  # successes of 10: optimal, intuitive
GOALS = {"S": 0.9, "U": 0.9, "trefoil": 0.9, "reef": 0.7}
NODES, QUICK_NODES = 130, 60
RULER = 5e-4  # [m], standard deviation
SHOWN = 7.0  # [Lgb] of a hanging cable in a picture


def placed(letter: str, way: str, seed: int, noise: float, nodes: int = NODES) -> tuple[bool, str]:
    """Return True if the cable passed every post on its right side, and the number of passed posts."""
    static = noise == 0.0 and way != "intuitive"
    known = measured(Cable.dlo(5), seed, bent=way == "optimised") if noise else None
    found = place_cable.laid(letter, way, nodes, known=known, seed=seed, noise=noise, static=static)
    return bool(found.passed.all()), f"{found.passed.sum()} of {len(found.passed)} posts"


def measured(cable: Cable, seed: int, *, bent: bool) -> Cable:
    """Return a cable as its planner measures it: by the height of its loop and the curl of its end, from two sides."""
    true = trial_cable(cable, seed)
    random = np.random.default_rng((seed, 1))
    read = LOOP_HEIGHT * true.gravito_bending_length + RULER * random.normal()
    lgb = measure(height=read).gravito_bending_length
    if not bent:
        return replace(cable, gravito_bending_length=lgb)
    line = hang(true)
    lower = line[line[:, 2] < SHOWN * cable.gravito_bending_length]
    seen = [
        measure_curvature(lgb, image=photographed(lower[:, [axis, 2]], true.radius, random), scale=PIXEL).curvature
        for axis in range(2)
    ]
    return replace(cable, gravito_bending_length=lgb, natural_curvature=(seen[0], seen[1]))


class Knots:
    """Knots by name; each is rehearsed once."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes
        self._picks: dict[str, tuple] = {}

    def tied(self, name: str, way: str, seed: int, noise: float) -> tuple[bool, str]:
        """Return True if the knot exists at the end, and the number of moves that found no cable."""
        plans, steps = tie_knot.TYING[name](way)
        if name not in self._picks:
            rehearsed = tie_knot.TYING[name]("exact")
            self._picks[name] = tie(*rehearsed, friction=tie_knot.FRICTION, nodes=self.nodes).picks
        found = tie(
            plans, steps, friction=tie_knot.FRICTION, picks=self._picks[name], seed=seed, noise=noise, nodes=self.nodes
        )
        return tie_knot.is_tied(name, found), f"{len(found.missed)} moves missed"


@dataclass(frozen=True)
class Tried:
    """Result of one trial, as a line of a file; seed 0 has no noise."""

    use: str
    way: str
    seed: int
    nodes: int
    success: bool
    words: str

    def __str__(self) -> str:
        noise = f"trial {self.seed}" if self.seed else "no noise"
        return f"{self.use}, {self.way}, {noise}: {'yes' if self.success else 'no'}, {self.words}"


def tried(knots: Knots, use: str, way: str, seed: int) -> Tried:
    """Run one trial, and return its success and result."""
    attempt = knots.tied if use in tie_knot.TYING else partial(placed, nodes=knots.nodes)
    try:
        success, words = attempt(use, way, seed, 1.0 if seed else 0.0)
    except ConvergenceError:
        success, words = False, "engine gave up"
    return Tried(use, way, seed, knots.nodes, success, words)


def main() -> None:
    """Try, count, compare."""
    options = arguments(
        __doc__,
        ("--trials", {"type": int, "default": 1, "help": "noisy ones of each use and way; the dissertation has 10"}),
        ("--uses", {"nargs": "*", "choices": tuple(GOALS), "default": list(GOALS)}),
        ("--ways", {"nargs": "*", "choices": WAYS, "default": list(WAYS)}),
        RESUME,
    )
    uses, ways, trials, nodes = options.uses, options.ways, options.trials, NODES
    if options.quick:
        uses, ways, trials, nodes = ["U"], ["exact"], 0, QUICK_NODES
    report = Report("deployment_uses", quick=options.quick)
    knots, lines = Knots(nodes), Lines("deployment_uses", resume=options.resume)
    known = {(t.use, t.way, t.seed): t for t in (Tried(**line) for line in lines.known) if t.nodes == nodes}
    pairs = [(use, way) for use, way in product(uses, ways) if way != "optimised" or use not in tie_knot.TYING]
    wanted = [(use, way, seed) for use, way in pairs for seed in range(trials + 1)]
    with bar(len(wanted), "trying", "trials") as shown:
        try:
            for key in wanted:
                if key not in known:
                    known[key] = tried(knots, *key)
                    lines.add(asdict(known[key]))
                    print(known[key], flush=True)
                shown.advance(1)
        except KeyboardInterrupt:
            report.figures["interrupted"] = f"{sum(key in known for key in wanted)} of {len(wanted)} trials"
            print("\ninterrupted: --resume goes on", flush=True)
    rows = []
    for use, way in pairs:
        here = [known[use, way, seed] for seed in range(trials + 1) if (use, way, seed) in known]
        if not here:
            continue
        alone, noisy = here[0].success, [one.success for one in here[1:]]
        said = "; ".join(one.words for one in here)
        rows.append((use, way, "yes" if alone else "no", f"{sum(noisy)} of {len(noisy)}", said, PUBLISHED[use]))
        if way == "exact":
            report.goal(f"{use}: without noise", float(alone), 1.0)
            report.goal(f"{use}: share of noisy trials", float(np.mean(noisy)) if noisy else None, GOALS[use])
    header = ("use", "way", "without noise", "noisy trials", "without noise, then each trial", "published, of 10")
    report.table("Uses: ways of laying", header, rows)
    report.write()


if __name__ == "__main__":
    main()
