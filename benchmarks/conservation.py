"""Conservation of momentum, angular momentum and energy in free scenes, for all schemes and several steps.

    python benchmarks/conservation.py [--quick] [--cases COUNT] [--tight]

Fifty drawn scenes fly freely for 1,000 steps of 1/1000, 1/100, 1/20 and 1/5 of their slowest elastic period. Every
implicit integrator that accepts a scene runs it, at default options. The scenes are a rod, joined rods, a ring, a rod
that springs into a curl, and rods that meet; in a plane and in space; with and without viscosity. The benchmark records
the greatest change during the run of

- linear momentum, over sqrt(2 T m), T the kinetic energy at the start, m the mass;
- angular momentum about the origin, over the same times the greatest distance of a node from the origin;
- the energy balance, stored + dissipated - work, over the energy at the start;
- the dissipated energy that came back, which is zero for viscosity.

Thirty drawn robots fall from rest for 20 s, in steps of 5, 1 and 0.25 ms, by the default integrator and by fourth
order. A robot has three rods from a clamp or a pin, with rigid, pinned and revolute joints, springs and tendons.
Nothing dissipates energy there, and no energy balance may change by more than 1e-5 of the greatest kinetic energy.

`simulation.momentum()` reads momenta. Two exact results of theory verify this read-out. The midpoint rule conserves
angular momentum in a plane. A torque-free step of backward Euler changes it by dt times the sum of v1 x (M v0), where
this file computes the mass matrix M.

For driven rods, the work of a support is its mean force times its displacement, plus its mean moment times its
rotation. The impulses of supports equal the changes of momenta. Both are exact while the held part moves uniformly, and
otherwise of second order. The held part has inertia too, and the mean of its velocities at the ends of a step is not
quite its displacement over the time step. (Twice the mean minus the last velocity would oscillate for ever.) In space a
midpoint step turns by its Cayley vector, and energy-momentum steps in a plane have moments that do the work over the
angle. The balances are of second order there.

--tight solves every step to rounding, which separates errors of a scheme from those of the solver's tolerances.
"""

from __future__ import annotations

import inspect
import math
import warnings
from dataclasses import dataclass

import numpy as np
from conservation_cases import KINDS, Case, draw, held, spinning_rod
from reporting import OUT, Report, arguments, bar

import withe

INTEGRATORS = ("backward_euler", "implicit_midpoint", "energy_momentum", "fourth_order")
STEPS_A_PERIOD = (1000, 100, 20, 5)
LOOKS = 50
HELD_STEPS = (5e-3, 1e-3, 2.5e-4)  # [s]


@dataclass(frozen=True)
class Flight:
    """Greatest relative changes along a flight, of a case by a scheme."""

    case: Case
    integrator: str
    steps_a_period: int
    linear: float = math.nan
    angular: float = math.nan
    gained: float = math.nan
    lost: float = math.nan
    fed: float = math.nan
    failure: str = ""

    def as_json(self) -> dict:
        """For the report."""
        return vars(self) | {"case": self.case.number, "kind": self.case.kind}


def balances(simulation: withe.Simulation) -> tuple[float, np.ndarray, np.ndarray]:
    """Energy balance [J], linear and angular momentum."""
    energy, momentum = simulation.energy(), simulation.momentum()
    return energy.total - energy.work + energy.dissipated, momentum.linear, momentum.angular


def fly(case: Case, integrator: str, steps_a_period: int, steps: int, *, tight: bool = False) -> Flight:
    """One flight."""
    simulation, mass = case.build(integrator, case.period / steps_a_period, tight=tight)
    energy, linear, angular = balances(simulation)
    start = simulation.energy()
    stored = start.kinetic + start.stretch + start.bend + start.twist
    impulse, far = math.sqrt(2.0 * start.kinetic * mass), 0.0
    worst = dict.fromkeys(("linear", "angular", "gained", "lost", "fed"), 0.0)
    most_dissipated = 0.0
    failure = ""
    for _ in range(LOOKS):
        try:
            simulation.step(steps // LOOKS)
        except withe.ConvergenceError as error:
            failure = f"ConvergenceError: {error}"
        now = balances(simulation)
        far = max(far, float(np.linalg.norm(simulation.positions(), axis=1).max()))
        worst["linear"] = max(worst["linear"], float(np.linalg.norm(now[1] - linear)) / impulse)
        worst["angular"] = max(worst["angular"], float(np.linalg.norm(now[2] - angular)) / (impulse * far))
        worst["gained"] = max(worst["gained"], (now[0] - energy) / stored)
        worst["lost"] = max(worst["lost"], (energy - now[0]) / stored)
        if case.kind != "contact":
            dissipated = simulation.energy().dissipated
            most_dissipated = max(most_dissipated, dissipated)
            worst["fed"] = max(worst["fed"], (most_dissipated - dissipated) / stored)
        if failure:
            break
    return Flight(case, integrator, steps_a_period, **worst, failure=failure)


def takes(integrator: str, case: Case) -> bool:
    """Return False for fourth order with losses or contact, since its steps go partly backwards in time."""
    return integrator != "fourth_order" or not (case.viscous or case.kind == "contact")


def worst_of(flights: list[Flight], name: str) -> float:
    """Greatest value of a column."""
    return max((getattr(flight, name) for flight in flights), default=math.nan)


def energy_off(flight: Flight) -> float:
    """Return the energy error that the goal of a scheme bounds."""
    conserves = flight.integrator in ("energy_momentum", "fourth_order")
    return max(flight.gained, flight.lost) if conserves else flight.gained


# --- robots that something holds ---------------------------------------------------------------------------------


def drift(number: int, integrator: str, time_step: float, seconds: float) -> float:
    """Greatest change of the energy balance of a robot that falls from rest, over its greatest kinetic energy."""
    simulation = held(number, integrator, time_step)
    first, _, _ = balances(simulation)
    worst = kinetic = 0.0
    steps = round(seconds / time_step)
    looks = min(steps, 200)
    for _ in range(looks):
        simulation.step(steps // looks)
        worst = max(worst, abs(balances(simulation)[0] - first))
        kinetic = max(kinetic, simulation.energy().kinetic)
    return worst / kinetic


def add_held(report: Report, cases: int, seconds: float) -> None:
    """Report how far the energy of robots drifts by the default integrator and by fourth order, per time step."""
    rows, default = [], inspect.signature(withe.Scene.build).parameters["integrator"].default
    with bar(cases * 6, "robots") as shown:
        for integrator in (default, "fourth_order"):
            found = []
            for time_step in HELD_STEPS:
                found.append([])
                for number in range(cases):
                    found[-1].append(drift(number, integrator, time_step, seconds))
                    shown.advance(1)
            rows += [
                [integrator, f"{1e3 * step:g} ms", figure(float(np.median(each))), figure(max(each))]
                for step, each in zip(HELD_STEPS, found, strict=True)
            ]
            report.goal(f"robots, {integrator}: energy over {seconds:g} s", np.max(found), 1e-5, at_least=False)
    header = ["integrator", "step", "median", "greatest"]
    report.table(f"{cases} robots: greatest change of energy over the greatest kinetic energy", header, rows)


# --- whether the instrument is right --------------------------------------------------------------------------


def euler_identity(periods: float = 0.5, steps: int = 200) -> tuple[float, float]:
    """Backward Euler in a plane: what it lost of J, as a part of it, and how far theory is from that.

    x1 = x0 + dt v1 and no torque, so sum of x1 x (M v1) - x0 x (M v0) = dt sum of v1 x (M v0).
    """
    simulation, rod, mass, period = spinning_rod("backward_euler", periods, steps)
    step = periods * period / steps
    start = simulation.momentum().angular
    before, predicted = simulation.velocities(rod), np.zeros(3)
    for _ in range(steps):
        simulation.step()
        now = simulation.velocities(rod)
        predicted += step * np.cross(now, mass @ before).sum(axis=0)
        before = now
    change = simulation.momentum().angular - start
    scale = float(np.linalg.norm(start))
    return float(np.linalg.norm(change)) / scale, float(np.linalg.norm(change - predicted)) / scale


def midpoint_in_a_plane() -> float:
    """Greatest relative change of J of the same rod by the midpoint rule, over 1,000 steps."""
    simulation, _, _, _ = spinning_rod("implicit_midpoint", 5.0, 1000)
    start = simulation.momentum().angular
    worst = 0.0
    for _ in range(100):
        simulation.step(10)
        worst = max(worst, float(np.linalg.norm(simulation.momentum().angular - start)))
    return worst / float(np.linalg.norm(start))


# --- driven rods ----------------------------------------------------------------------------------------------


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix [Rodrigues]."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def driven(integrator: str, planar: bool, step: float, *, even: bool, seconds: float = 0.4) -> dict[str, float]:
    """A rod whose wall moves and turns, evenly or not: greatest errors of a step's energy balance, over what it holds.

    From the third step on: only then velocities of what is held are known to second order.
    """
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=12, radius=5e-3, material=material, normal=(0, 0, 1))
    wall = scene.clamp(rod.start)
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        planar=planar,
        adaptive=False,
        solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
    )
    axis = np.array((0.0, 1.0, 0.0) if planar else (0.36, 0.8, 0.48))
    if even:
        angle = lambda t: 4.0 * t  # noqa: E731
        place = lambda t: np.array((0.5 * t, 0.0, 0.3 * t))  # noqa: E731
    else:
        angle = lambda t: 1.5 * np.sin(3.0 * t) ** 2  # noqa: E731
        place = lambda t: np.array((0.05 * np.sin(4.0 * t) ** 2, 0.0, 0.3 * t**2))  # noqa: E731
    simulation.move(wall, path=lambda t: (place(t), rotation(axis, angle(t))))
    simulation.step(2)
    errors, scales = np.zeros(3), np.zeros(3)
    for _ in range(round(seconds / step)):
        t, work, momentum = simulation.time, simulation.energy().work, simulation.momentum()
        simulation.step()
        reaction, now = simulation.reaction(wall), simulation.momentum()
        way, turn = place(simulation.time) - place(t), angle(simulation.time) - angle(t)
        done = reaction.force @ way + reaction.moment @ axis * turn
        middle = 0.5 * (place(simulation.time) + place(t))
        impulse = step * reaction.force
        twirl = step * (np.cross(middle, reaction.force) + reaction.moment)
        found = (
            simulation.energy().work - work - done,
            np.linalg.norm(now.linear - momentum.linear - impulse),
            np.linalg.norm(now.angular - momentum.angular - twirl),
        )
        errors = np.maximum(errors, np.abs(found))
        scales = np.maximum(scales, (abs(done), np.linalg.norm(impulse), np.linalg.norm(twirl)))
    return dict(zip(("work", "impulse", "angular impulse"), (errors / scales).tolist(), strict=True))


def add_driven(report: Report) -> None:
    """Books of supports in steps of 4, 2 and 1 ms: exact, or of second order."""
    rows = []
    for integrator in ("implicit_midpoint", "energy_momentum"):
        for planar in (True, False):
            for even in (True, False):
                found = [driven(integrator, planar, step, even=even) for step in (4e-3, 2e-3, 1e-3)]
                for name in found[0]:
                    values = [f[name] for f in found]
                    where, how = "plane" if planar else "space", "evenly" if even else "unevenly"
                    order = math.log2(values[0] / values[2]) / 2.0
                    exact = max(values) < 1e-9
                    rows.append([integrator, where, how, name, *map(figure, values), "-" if exact else f"{order:.1f}"])
                    if not exact:
                        report.goal(f"{integrator} driven {how} in {where}: order of {name}", order, 1.8)
    header = ["integrator", "in", "driven", "of", "4 ms", "2 ms", "1 ms", "order"]
    report.table("Driven rods: work and impulse of a support, greatest errors of a step", header, rows)


# --- printing and drawing ---------------------------------------------------------------------------------------


def plot(flights: list[Flight]) -> None:
    """Changes against the step, a panel a quantity, a colour a scheme."""
    try:
        from matplotlib import pyplot as plt
    except ImportError:
        return
    panels = (
        ("linear", "linear momentum", 1e-9),
        ("angular", "angular momentum", 1e-9),
        ("gained", "energy gained", 1e-3),
    )
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), sharex=True, layout="constrained")
    for axis, (name, title, goal) in zip(axes, panels, strict=True):
        for i, integrator in enumerate(INTEGRATORS):
            own = [flight for flight in flights if flight.integrator == integrator]
            x = [(1.0 + 0.12 * (i - 1.5)) / flight.steps_a_period for flight in own]
            y = [max(getattr(flight, name), 1e-16) for flight in own]
            axis.loglog(x, y, ".", alpha=0.5, label=integrator.replace("_", " "))
        axis.axhline(goal, color="0.4", linewidth=0.8)
        axis.set(title=title, xlabel="step over slowest period", ylabel="greatest relative change")
    axes[0].legend(fontsize=8)
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / "conservation.png", dpi=130)
    plt.close(figure)


def figure(value: float) -> str:
    """Format a number for a table."""
    return "-" if math.isnan(value) else f"{value:.1e}"


def add_tables(report: Report, flights: list[Flight]) -> None:
    """By scheme and step, and by kind of scene."""
    names = ("linear", "angular", "gained", "lost", "fed")
    for title, keys, key in (
        ("Greatest changes, by integrator and steps a period", STEPS_A_PERIOD, lambda f: f.steps_a_period),
        ("Greatest changes, by integrator and scene", KINDS, lambda f: f.case.kind),
    ):
        rows = []
        for integrator in INTEGRATORS:
            for wanted in keys:
                own = [f for f in flights if f.integrator == integrator and key(f) == wanted]
                if own:
                    failures = sum(bool(f.failure) for f in own)
                    rows.append([integrator, wanted, len(own), *(figure(worst_of(own, n)) for n in names), failures])
        report.table(title, ["integrator", "", "flights", *names, "not converged"], rows)


def add_goals(report: Report, flights: list[Flight]) -> None:
    """Add the goals of all flights."""
    for integrator in INTEGRATORS:
        own = [flight for flight in flights if flight.integrator == integrator]
        report.goal(f"{integrator}: linear momentum", worst_of(own, "linear"), 1e-9, at_least=False)
        if integrator != "backward_euler":  # it loses angular momentum at first order in the step
            report.goal(f"{integrator}: angular momentum", worst_of(own, "angular"), 1e-9, at_least=False)
        if integrator != "backward_euler":  # its forces act at the end of a step, and their work differs slightly
            report.goal(f"{integrator}: dissipated comes back", worst_of(own, "fed"), 1e-9, at_least=False)
        if integrator == "implicit_midpoint":  # the plain rule has no bound, and warns
            continue
        conserves = integrator in ("energy_momentum", "fourth_order")
        limit = 1e-6 if conserves else 1e-3
        what = "energy, either way" if conserves else "energy gained"
        report.goal(f"{integrator}: {what}", max(map(energy_off, own), default=math.nan), limit, at_least=False)
    report.goal("flights that did not converge", sum(bool(f.failure) for f in flights), 0, at_least=False)


def main() -> None:
    """Fly all."""
    options = arguments(
        __doc__,
        ("--cases", {"type": int, "default": 50, "help": "how many"}),
        ("--tight", {"action": "store_true", "help": "solve every step to rounding"}),
    )
    warnings.simplefilter("ignore", UserWarning)  # long steps and coarse meshes are drawn on purpose
    report = Report("conservation", quick=options.quick)
    cases = [draw(i) for i in range(3 if options.quick else options.cases)]
    steps = 50 if options.quick else 1000
    plans = [(c, i, n) for c in cases for i in INTEGRATORS for n in STEPS_A_PERIOD if takes(i, c)]
    flights = []
    with bar(len(plans), "flights") as shown:
        for case, integrator, steps_a_period in plans:
            flights.append(fly(case, integrator, steps_a_period, steps, tight=options.tight))
            shown.advance(1)
    add_tables(report, flights)

    losses = {n: euler_identity(steps=n) for n in (100, 200, 400)}
    rows = [[n, f"{lost:.3e}", f"{apart:.1e}"] for n, (lost, apart) in losses.items()]
    report.table("Angular momentum that backward Euler loses", ["steps", "lost of J", "theory apart by"], rows)
    order = math.log2(losses[200][0] / losses[400][0])
    add_driven(report)
    add_held(report, 2 if options.quick else 30, 0.2 if options.quick else 20.0)

    add_goals(report, flights)
    report.goal("backward Euler's loss of J: order", order, 0.9)
    report.goal(
        "backward Euler's loss of J: theory apart by", max(a for _, a in losses.values()), 1e-10, at_least=False
    )
    # In each of 12 edges and 1,000 steps axial forces round by EA eps x / l, x the distance from the origin.
    report.goal("midpoint in a plane: J", midpoint_in_a_plane(), 1e-11, at_least=False)
    report.figures["flights"] = [flight.as_json() for flight in flights]
    plot(flights)
    report.write()


if __name__ == "__main__":
    main()
