"""Finer meshes and slower hands: how little they change of how cables lie. Part of deployment_tables.py (--refine)."""

from __future__ import annotations

from collections.abc import Callable

from reporting import Report, bar

from withe.deployment import Cable, Deployment, LayPlan, deploy, plan

# Pattern and friction for cable 2: each kind of curve, from held to slipping.
CELLS = (("line", 0.2), ("circle", 0.4), ("sine", 0.4), ("letterU", 0.4), ("letterL", 0.7))
NUMBER = 2
NODES = (100, 200, 400)
SPEEDS = (0.025, 0.0125)  # [m/s]
MESH, SPEED = 0.2, 1.0  # [mm] by which a mean may change


def refine(report: Report, motion_of: Callable[[str, int, str, float], LayPlan]) -> None:
    """Lay five cells by ever more nodes, quasi-statically, and at the usual and half the speed, in time."""
    rows, by_mesh, by_speed = [], [], []
    with bar(len(CELLS) * (len(NODES) + len(SPEEDS)), "refining", "runs") as shown:
        for name, friction in CELLS:
            motion = motion_of(name, NUMBER, "exact", friction)

            def laid(planned: LayPlan, floor: float = friction, **options: object) -> float:
                found: Deployment = deploy(planned, friction=floor, progress=False, **options)  # type: ignore[arg-type]
                shown.advance(1)
                return 1e3 * found.error

            static = [laid(motion, nodes=nodes, quasi_static=True) for nodes in NODES]
            slower = plan(Cable.dlo(NUMBER), motion.pattern, speed=SPEEDS[1], crossings="over")
            timed = [laid(motion), laid(slower)]
            by_mesh.append(max(abs(error - static[-1]) for error in static))
            by_speed.append(abs(timed[1] - timed[0]))
            rows.append((name, friction, *(f"{error:.2f}" for error in (*static, *timed))))
            print(*rows[-1], flush=True)
    header = ("pattern", "friction", *(f"{nodes} nodes" for nodes in NODES), *(f"{100 * v:g} cm/s" for v in SPEEDS))
    report.table(f"Mean error, cable {NUMBER} [mm]: meshes quasi-static, speeds in time with 200 nodes", header, rows)
    report.goal("mesh: a mean's change, most [mm]", max(by_mesh), MESH, at_least=False)
    report.goal("half the speed: a mean's change, most [mm]", max(by_speed), SPEED, at_least=False)
