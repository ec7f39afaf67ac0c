"""The commands `withe run`, `withe view` and `withe plan` for scene files."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from withe.scene.scene import Scene

__all__ = ["add_parser"]


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `run`, `view` and `plan` to the commands of a parser."""
    run = commands.add_parser(
        "run",
        help="simulate a scene file",
        description="Simulate a scene file. Without an output option, print where the free ends of the rods end.",
    )
    run.add_argument("scene", type=Path, help="the scene, a TOML file")
    run.add_argument("--duration", type=float, default=1.0, metavar="S", help="duration [s] (default: 1)")
    run.add_argument("--record-every", type=float, metavar="S", help="time between frames [s] (default: 100 frames)")
    run.add_argument("--film", type=Path, metavar="FILE", help="write a film: .mp4 or .gif")
    run.add_argument("--plot", type=Path, metavar="FILE", help="write a picture of the record: .png, .pdf or .svg")
    run.add_argument("--record", type=Path, metavar="FILE", help="write a record for withe.Record.load: .npz")
    run.set_defaults(run=_run)

    view = commands.add_parser(
        "view", help="look at a scene file", description="Show a scene file in a window, or write a picture of it."
    )
    view.add_argument("scene", type=Path, help="the scene, a TOML file")
    view.add_argument(
        "--equilibrium", action="store_true", help="show the equilibrium, without actuation, instead of the drawn scene"
    )
    view.add_argument("--picture", type=Path, metavar="FILE", help="write a picture (.png) instead of opening a window")
    view.set_defaults(run=_view)

    plan = commands.add_parser(
        "plan", help="print what withe decides for a scene file", description="Print the plan of a scene file."
    )
    plan.add_argument("scene", type=Path, help="the scene, a TOML file")
    plan.set_defaults(run=_plan)


def _run(arguments: argparse.Namespace) -> int:
    for option in ("record", "plot", "film"):  # before the run, which may take long
        path = getattr(arguments, option)
        if path is not None and not path.parent.is_dir():
            raise ValueError(f"folder of --{option} does not exist: {path.parent}")
    simulation = Scene.load(arguments.scene).build()
    record = simulation.run(arguments.duration, record_every=arguments.record_every)
    if arguments.record is not None:
        _say(record.save(arguments.record))
    if arguments.plot is not None:
        record.plot().savefig(arguments.plot)
        _say(arguments.plot)
    if arguments.film is not None:
        record.animate(arguments.film)
        _say(arguments.film)
    if arguments.record is arguments.plot is arguments.film is None:
        for rod in simulation.rods:
            x, y, z = simulation.positions(rod)[-1]
            _say(f"last node of {rod.name!r} at {simulation.time:g} s: ({x:.6g}, {y:.6g}, {z:.6g}) m")
    return 0


def _view(arguments: argparse.Namespace) -> int:
    simulation = Scene.load(arguments.scene).build()
    if arguments.equilibrium:
        simulation.equilibrium()
    if arguments.picture is not None:
        simulation.picture(arguments.picture)
        _say(arguments.picture)
    else:
        try:
            simulation.view()
        except RuntimeError:
            raise ValueError(f"no window can be opened: use withe view {arguments.scene} --picture NAME.png") from None
    return 0


def _plan(arguments: argparse.Namespace) -> int:
    _say(Scene.load(arguments.scene).build().plan)
    return 0


def _say(line: object) -> None:
    sys.stdout.write(f"{line}\n")
