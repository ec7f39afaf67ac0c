"""A sheet of A4 paper is folded in half by its edge, on a floor and onto itself: what contact may cost.

    python benchmarks/contact_fold.py [--quick]

The sheet is planar: 150 edges over 0.297 m, Lgb = (B / 2w)^(1/3) = 48 mm, 0.1 mm thick, with anchored friction on the
floor and on its own layer. A jaw holds the last edge and leads it over along half a circle within 10 s. Processor time
of one thread, best of three.
"""

from __future__ import annotations

import time

import numpy as np
from reporting import Report, arguments, bar

import withe

LENGTH, WIDTH, THICKNESS, LGB = 0.297, 0.21, 1e-4, 0.048  # [m]
WEIGHT = 0.08 * WIDTH * 9.81  # weight of 80 g/m^2 [N/m]
FRICTION, DURATION = 0.3, 10.0  # [-], [s]
CASES = (("backward_euler", 10e-3, 0.5), ("energy_momentum", 5e-3, 2.0))  # integrator, step [s], goal [s]


def fold(integrator: withe.parts.Integrator, time_step: float, edges: int = 150) -> withe.Simulation:
    """The sheet as it lies, and a jaw that is about to lift its edge."""
    scene = withe.Scene()
    bend = 2.0 * WEIGHT * LGB**3
    across = bend * (WIDTH / THICKNESS) ** 2
    stiff = withe.Stiffness(stretch=12.0 * bend / THICKNESS**2, bend=(across, bend), twist=bend)
    height = 0.5 * THICKNESS
    sheet = scene.add_rod(
        start=(0, 0, height),
        end=(LENGTH, 0, height),
        nodes=edges + 1,
        normal=(0, 1, 0),
        section=withe.Rectangle(WIDTH, THICKNESS),
        contact_radius=0.5 * THICKNESS,
        stiffness=stiff,
        line_density=WEIGHT / 9.81,
        name="sheet",
    )
    scene.clamp(sheet.end, hold="edge", name="jaw")
    scene.add_floor(friction=FRICTION)
    scene.enable_contact(friction=FRICTION, friction_model="anchored")
    simulation = scene.build(integrator=integrator, time_step=time_step, planar=True)
    reach = 0.25 * LENGTH

    def path(now: float) -> tuple[np.ndarray, np.ndarray]:
        """Along half a circle, at rest at both ends; the edge turns with it."""
        share = min(now / DURATION, 1.0)
        angle = np.pi * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))
        rise = height + 1.05 * THICKNESS * share
        place = np.array([LENGTH - reach + reach * np.cos(angle), 0.0, rise + reach * np.sin(angle)])
        cosine, sine = np.cos(angle), np.sin(angle)
        return place, np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])

    simulation.move("jaw", path=path)
    return simulation


def main() -> None:
    """Fold by each integrator, and report."""
    quick = arguments(__doc__).quick
    report = Report("contact_fold", quick=quick)
    rows, rounds = [], 1 if quick else 3
    with bar(len(CASES) * rounds, "fold", "folds") as shown:
        for integrator, time_step, most in CASES:
            steps = 20 if quick else round(DURATION / time_step)
            taken = []
            for _ in range(rounds):
                simulation = fold(integrator, time_step)
                start = time.thread_time()
                simulation.step(steps)
                taken.append(time.thread_time() - start)
                shown.advance(1)
            statistics, seconds = simulation.statistics, min(taken)
            contacts = len(simulation.contacts())
            rows.append(
                (
                    integrator,
                    f"{1e3 * time_step:g}",
                    f"{seconds:.2f}",
                    f"{1e3 * seconds / steps:.2f}",
                    f"{statistics.iterations / steps:.1f}",
                    f"{1e6 * seconds / max(statistics.iterations, 1):.0f}",
                    contacts,
                )
            )
            report.goal(f"fold of A4, {integrator} [s]", None if quick else seconds, most, at_least=False)
    header = (
        "integrator",
        "step [ms]",
        "s",
        "ms a step",
        "iterations a step",
        "us an iteration",
        "contacts",
    )
    report.table(f"A fold of A4 within {DURATION:g} s", header, rows)
    report.write()


if __name__ == "__main__":
    main()
