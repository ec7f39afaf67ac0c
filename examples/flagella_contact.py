"""Flagella in a bundle, under two energies of contact from the same state: IMCv2, which is finite, and a barrier.

This repeats the comparison of section 5.6.2 of Choi's dissertation, and its friction example, 5.6.3. Steps of 1 ms at
15 rad/s start from states in which the flagella touch. These states are made by 9 s of turning and more under the
barrier, which keeps surfaces apart, and are stored in out/. The example prints iterations and processor time per step,
with the fluid and without the time of its Stokeslets. It also prints the mean distance of equal nodes over the radius,
(5.18). It fails if that distance exceeds 0.05, or if flagella never touch.

`--full` runs from the drawn shape for 250 s as the source did, for its tables 5.1 and 5.2: hours; `--duration` shortens
it. Only steps with a contact count there, as in the source. Writes out/flagella_contact.png.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import flagella
import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

PREPARED, PREPARED_STEP = 9.0, 5e-3  # [s]
STEP = 1e-3  # [s]
MODELS: tuple[withe.parts.ContactModel, ...] = ("imcv2", "barrier")
LABELS = {"imcv2": "IMCv2", "barrier": "barrier"}
BLOCK = 50  # number of steps of one model before those of the other
MOST_APART = 0.05  # relative to the radius


@dataclass
class Run:
    """One simulation and the cost of its steps: arrays with an entry per step, also for steps without contact."""

    simulation: withe.Simulation
    contacts: list[int] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    fluid: list[float] = field(default_factory=list)  # share of the step
    positions: list[np.ndarray] = field(default_factory=list)
    failure: str = ""

    def step(self, keep: bool) -> None:
        """One time step."""
        before, started = self.simulation.statistics, time.thread_time()
        self.simulation.step()
        self.seconds.append(time.thread_time() - started)
        after = self.simulation.statistics
        self.iterations.append(after.iterations - before.iterations)
        self.fluid.append((after.fluid_time - before.fluid_time) / (after.total_time - before.total_time))
        self.contacts.append(flagella.touching(self.simulation))
        if keep:
            self.positions.append(self.simulation.positions())

    def advance(self, steps: int, keep: bool) -> None:
        """Steps until one fails."""
        for _ in range(0 if self.failure else steps):
            try:
                self.step(keep)
            except withe.ConvergenceError as error:
                self.failure = str(error)
                return

    def means(self) -> tuple[float, float, float, float]:
        """Return means over steps with contact: contacts, iterations, milliseconds with and without the fluid."""
        touching = np.array(self.contacts) > 0
        if not touching.any():
            return 0.0, np.nan, np.nan, np.nan
        seconds = np.array(self.seconds)[touching]
        without = seconds * (1.0 - np.array(self.fluid)[touching])
        return (
            float(np.mean(np.array(self.contacts)[touching])),
            float(np.mean(np.array(self.iterations)[touching])),
            1e3 * float(seconds.mean()),
            1e3 * float(without.mean()),
        )


def in_contact(count: int, folder: Path) -> withe.Snapshot:
    """Flagella that touch: read, or made."""
    path = folder / f"flagella_{count}.npz"
    simulation = flagella.build(count, "stokeslets", PREPARED_STEP, contact="barrier")
    try:
        simulation.restore(withe.Snapshot.load(path))
    except (OSError, ValueError):  # not there, or of another version
        print(f"turning {count} flagella for {PREPARED:g} s, and until they touch", flush=True)
        simulation.step(round(PREPARED / PREPARED_STEP))
        while not flagella.touching(simulation):
            simulation.step()
        simulation.snapshot().save(path)
    return simulation.snapshot()


def compare(
    count: int, friction: float, steps: int, start: withe.Snapshot | None, models: tuple[withe.parts.ContactModel, ...]
) -> dict[str, Run]:
    """Both models by turns, from a state or from the drawn shape, and a row of the table each."""
    runs = {}
    for model in models:
        simulation = flagella.build(count, "stokeslets", STEP, contact=model, friction=friction)
        if start is not None:
            simulation.restore(start)
        runs[model] = Run(simulation)
    for done in withe.track(range(0, steps, BLOCK), f"{count} flagella", unit="blocks"):
        for run in runs.values():
            run.advance(min(BLOCK, steps - done), keep=start is not None)
    for model, run in runs.items():
        contacts, iterations, whole, without = run.means()
        touching = np.mean(np.array(run.contacts) > 0) if run.contacts else 0.0
        print(
            f"{count:8d} {friction:9g}  {LABELS[model]:8s} {touching:8.1%} {contacts:9.1f} {iterations:11.2f} "
            f"{whole:10.2f} {without:14.2f} {sum(run.iterations):11d} {sum(run.seconds) / 3600:8.4f} h "
            f"{run.simulation.time:8.2f} s {run.failure}",
            flush=True,
        )
    return runs


def apart(runs: dict[str, Run]) -> np.ndarray:
    """Mean distance of the same nodes over the radius, in every step, (5.18)."""
    first, second = (run.positions for run in runs.values())
    both = min(len(first), len(second))
    difference = np.array(first[:both]) - np.array(second[:both])
    return np.asarray(np.linalg.norm(difference, axis=2).mean(axis=1) / flagella.THICKNESS)


def draw(results: dict[tuple[int, float], dict[str, Run]], path: Path) -> None:
    """A bundle under both models, how far apart they are, and iterations over friction."""
    colors = style.use()
    figure = plt.figure(figsize=(11.0, 4.2))
    axes = figure.add_subplot(1, 3, 1, projection="3d")
    count, friction = max(results, key=lambda key: (-key[1], key[0]))
    runs = results[count, friction]
    for model, dash, width in (("imcv2", "-", 2.0), ("barrier", ":", 1.2)):
        x = 1e2 * runs[model].simulation.positions().reshape(count, flagella.NODES, 3)
        for k, rod in enumerate(x):
            color = colors.cycle[k] if model == "imcv2" else colors.ink
            axes.plot(*rod.T, dash, color=color, linewidth=width, label=LABELS[model] if k == 0 else None)
    axes.set_title(f"{count} flagella after {runs['imcv2'].simulation.time:.0f} s")
    style.label(axes, x=("x", "cm"), y=("y", "cm"), z=("z", "cm"))
    axes.view_init(elev=8, azim=-70)
    style.legend(axes)

    middle, right = figure.add_subplot(1, 3, 2), figure.add_subplot(1, 3, 3)
    for (count, friction), runs in results.items():
        if friction == 0.0:
            distance = apart(runs)
            middle.semilogy(STEP * np.arange(1, len(distance) + 1), distance, label=f"{count} flagella")
    middle.axhline(MOST_APART, color=colors.grey, linestyle="--", linewidth=1.0, label="allowed")
    middle.set_title("mean distance of the same nodes")
    style.label(middle, x=("time in contact", "s"), y="distance / radius of a rod")
    places = np.arange(len(results))
    for model, side, color in (("imcv2", -0.2, colors.blue), ("barrier", 0.2, colors.orange)):
        values = [runs[model].means()[1] for runs in results.values()]
        right.bar(places + side, values, 0.38, color=color, label=LABELS[model])
    names = [f"M = {count}" + (f"\nμ = {friction:g}" if friction else "") for count, friction in results]
    right.set_xticks(places, names)
    right.set_title("cost")
    style.label(right, y="iterations a step")
    for panel in (middle, right):
        style.legend(panel, side="top")
    style.fill_frame(axes, x)
    figure.savefig(path)
    plt.close(figure)


def run_in_full(counts: list[int], frictions: list[float], duration: float) -> None:
    """Tables 5.1 and 5.2: from the drawn shape, both models without friction, IMCv2 with it."""
    steps = round(duration / STEP)
    for count in counts:
        runs = compare(count, 0.0, steps, None, MODELS)
        seconds = [sum(run.seconds) for run in runs.values()]
        print(f"{count:8d} flagella: the barrier takes {seconds[1] / seconds[0]:.2f} of the time of IMCv2")
    for friction in frictions:
        compare(2, friction, steps, None, ("imcv2",))


def main() -> None:
    """Compare, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--counts", type=int, nargs="+", default=[2, 3], help="numbers of flagella")
    parser.add_argument("--frictions", type=float, nargs="*", default=[0.3, 0.7], help="for two flagella, beside none")
    parser.add_argument("--steps", type=int, default=2000, help="of 1 ms, in contact")
    parser.add_argument("--full", action="store_true", help="from the drawn shape, for --duration")
    parser.add_argument("--duration", type=float, default=250.0, help="seconds of turning with --full")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    if min(arguments.counts) < 2:
        parser.error("--counts must be 2 or more")
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 60 s.", flush=True)

    print(
        "flagella  friction  model    touching  contacts  iterations  ms a step  without fluid  iterations  time  end"
    )
    if arguments.full:
        run_in_full(arguments.counts, arguments.frictions, arguments.duration)
        return
    results, wrong = {}, []
    for count, friction in [(n, 0.0) for n in arguments.counts] + [(2, mu) for mu in arguments.frictions]:
        runs = compare(count, friction, arguments.steps, in_contact(count, arguments.out), MODELS)
        results[count, friction] = runs
        most = apart(runs).max()
        imcv2, barrier = (runs[model].means() for model in MODELS)
        print(
            f"{count:8d} {friction:9g}  at most {most:.4f} radii apart; the barrier takes {barrier[2] / imcv2[2]:.2f} "
            f"of the time of IMCv2, {barrier[3] / imcv2[3]:.2f} without the fluid"
        )
        if friction == 0.0 and most > MOST_APART:
            wrong.append(f"{count} flagella end {most:.3f} radii apart")
        if any(run.failure or not any(run.contacts) for run in runs.values()):
            wrong.append(f"{count} flagella, friction {friction:g}: stopped, or never touched")
    draw(results, arguments.out / "flagella_contact.png")
    print(f"Wrote {arguments.out / 'flagella_contact.png'}.")
    if wrong:
        sys.exit("Not as contact should be: " + "; ".join(wrong))


if __name__ == "__main__":
    main()
