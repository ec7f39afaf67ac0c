"""The command `withe deploy`."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from withe.deployment.cable import Cable
from withe.deployment.pattern import Pattern
from withe.deployment.planning import PlanMethod, plan

__all__ = ["add_parser", "run"]

_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}  # [m]


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `deploy` to the commands of a parser."""
    parser = commands.add_parser(
        "deploy",
        help="plan how to lay a cable along a pattern",
        description=(
            "Plan how a gripper lays a cable along a pattern; write NAME_plan.csv (t,x,y,z,qx,qy,qz,qw), NAME_plan.json"
            " and NAME_plan.png, and say where friction will not hold it."
        ),
    )
    parser.add_argument(
        "pattern",
        type=Path,
        help="a CSV file of x, y, one row a point (a third column, z, is not used), in m or as its header says, "
        "'x [mm],y [mm]' say; or a picture with --scale",
    )
    parser.add_argument("--scale", type=float, help="size of a pixel of a picture [m]")
    parser.add_argument("--dlo", type=int, help="one of the five cables of the experiments, 1 to 5")
    parser.add_argument("--length", type=float, help="of the cable [m]")
    parser.add_argument("--radius", type=float, help="of the cable [m]")
    parser.add_argument("--lgb", type=float, help="its gravito-bending length (EI / 2w)^(1/3) [m]")
    parser.add_argument("--friction", type=float, default=0.4, help="coefficient with the floor (default: %(default)s)")
    parser.add_argument("--method", "--controller", choices=get_args(PlanMethod), default="exact")
    parser.add_argument("--speed", type=float, default=0.025, help="along the pattern [m/s] (default: %(default)s)")
    parser.add_argument(
        "--smoothing", type=float, default=1e-3, help="farthest from what is given [m] (default: %(default)s)"
    )
    parser.add_argument("--nodes", type=int, default=301, help="points of the pattern (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("."), help="folder to write to (default: here)")
    parser.add_argument("--no-picture", action="store_true", help="write no PNG file")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Plan, write the files and print where the floor will hold the cable."""
    cable = _cable(arguments)
    if arguments.out.exists() and not arguments.out.is_dir():
        raise ValueError(f"out must be a folder, {str(arguments.out)!r} is a file")
    shape: dict[str, Any] = {"smoothing": arguments.smoothing, "nodes": arguments.nodes}
    if arguments.pattern.suffix.lower() == ".csv":
        pattern = Pattern(_points(arguments.pattern), **shape)
    else:
        pattern = Pattern(image=arguments.pattern, scale=arguments.scale, **shape)
    motion = plan(cable, pattern, arguments.method, friction=arguments.friction, speed=arguments.speed)
    arguments.out.mkdir(parents=True, exist_ok=True)
    stem = arguments.out / f"{arguments.pattern.stem}_plan"
    written = [stem.with_suffix(".csv"), stem.with_suffix(".json")]
    for path in written:
        motion.save(path)
    if not arguments.no_picture:
        written.append(stem.with_suffix(".png"))
        motion.plot(arguments.friction).savefig(written[-1], dpi=120)
    lines = [repr(motion), f"may go at up to {1e3 * motion.fastest:.0f} mm/s"]
    if arguments.method != "intuitive":
        lines.append(str(motion.feasibility(arguments.friction)))
    sys.stdout.write("\n".join([*lines, *map(str, written)]) + "\n")
    return 0


def _cable(arguments: argparse.Namespace) -> Cable:
    sizes = (arguments.length, arguments.radius, arguments.lgb)
    if arguments.dlo is not None and all(size is None for size in sizes):
        return Cable.dlo(arguments.dlo)
    if arguments.dlo is not None or any(size is None for size in sizes):
        raise ValueError("the cable needs --dlo, or --length, --radius and --lgb")
    return Cable(*sizes)


def _points(path: Path) -> npt.NDArray[np.float64]:
    """Columns x, y of a file [m], in the order and units of its header if it has one; there may be a third one, z."""
    lines = path.read_text(encoding="utf-8-sig").splitlines()  # spreadsheets begin with a byte order mark
    sizes = np.ones(2)
    names = ["x", "y", "z"] if lines and _is_row(lines[0], 3) else ["x", "y"]
    if lines and not _is_row(lines[0], len(names)):
        heads = [re.fullmatch(r'\s*"?([xyz])([^a-z].*)?', name, re.IGNORECASE) for name in lines[0].split(",")]
        names = [head[1].lower() if head else "" for head in heads]
        if sorted(names) not in (["x", "y"], ["x", "y", "z"]):
            raise ValueError(f"{path.name} must begin with a row x,y or x,y,z, or with numbers, got {lines[0]!r}")
        named = dict(zip(names, lines[0].split(","), strict=True))
        sizes = np.array([_unit(named[name]) for name in ("x", "y")])
        lines = lines[1:]
    rows = [line for line in lines if line.strip()]
    bad = next((row for row in rows if not _is_row(row, len(names))), None)
    if bad is not None:
        raise ValueError(f"{path.name} must hold rows {','.join(names)}, got {bad!r}")
    numbers = np.array([[float(number) for number in row.split(",")] for row in rows]).reshape(-1, len(names))
    return np.asarray(sizes * numbers[:, [names.index("x"), names.index("y")]])


def _unit(head: str) -> float:
    """Unit of a column whose head may end in one, 'x [mm]', 'x (mm)', 'x_mm' or 'x/mm' [m]."""
    found = re.search(r"[\[(_/\s]\s*([^\W\d_]+)\s*[\])]?\s*\"?\s*$", head)
    if found is None:
        return 1.0
    if found[1].lower() not in _UNITS:
        raise ValueError(f"a pattern must be in {', '.join(_UNITS)}, got a column {head.strip()!r}")
    return _UNITS[found[1].lower()]


def _is_row(line: str, count: int) -> bool:
    numbers = line.split(",")
    try:
        return len(numbers) == count and all(np.isreal(float(number)) for number in numbers)
    except ValueError:
        return False
