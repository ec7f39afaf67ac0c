"""The command `withe fold`."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from withe.folding.endings import plan
from withe.folding.paper import Paper, folded_share

__all__ = ["add_parser", "run"]

_PAPERS = {"a4": Paper.a4, "us_letter": Paper.us_letter, "cardboard": Paper.cardboard, "origami": Paper.origami}


def _target(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        pass
    try:
        folded_share(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `fold` to the commands of a parser."""
    parser = commands.add_parser(
        "fold",
        help="plan how a gripper folds paper",
        description="Plan how a gripper folds paper; write poses and times as CSV, or everything as JSON.",
    )
    parser.add_argument("--paper", choices=sorted(_PAPERS), default="a4", help="a known one (default: a4)")
    parser.add_argument("--length", type=float, metavar="M", help="of the sheet, along the fold's way [m]")
    parser.add_argument("--width", type=float, metavar="M", help="of the sheet [m]")
    parser.add_argument("--thickness", type=float, metavar="M", help="of the sheet [m] (default: 1e-4)")
    parser.add_argument("--lgb", type=float, metavar="M", help="gravito-bending length [m], if not the paper's")
    parser.add_argument("--friction", type=float, help="coefficient between sheet and table (default: 0.12)")
    parser.add_argument(
        "--target",
        type=_target,
        default="half",
        help="where the edge comes down [m], or the share folded: half, third, quarter, 2/5",
    )
    parser.add_argument("--method", choices=["ucs", "slip", "local", "intuitive"], default="ucs")
    parser.add_argument("--grasp", choices=["moment_free", "free"], default="moment_free")
    parser.add_argument("--curvature", type=float, metavar="K", help="bound of a free grasp [1/Lgb] (default: 2.5)")
    parser.add_argument("--manifold", choices=["exact", "network"], default="exact")
    parser.add_argument("--ending", choices=["auto", "slow", "plunge"], default="auto", help="how the edge comes down")
    parser.add_argument("--out", type=Path, default=Path("fold.csv"), help="NAME.csv or NAME.json")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Plan, write the file and print a summary of the plan."""
    _require_writable(arguments.out)
    given = {
        "length": arguments.length,
        "width": arguments.width,
        "thickness": arguments.thickness,
        "gravito_bending_length": arguments.lgb,
        "friction": arguments.friction,
    }
    paper = replace(_PAPERS[arguments.paper](), **{name: value for name, value in given.items() if value is not None})
    found = plan(
        paper,
        arguments.target,
        method=arguments.method,
        grasp=arguments.grasp,
        curvature=arguments.curvature,
        manifold=arguments.manifold,
        ending=arguments.ending,
    )
    file = found.save(arguments.out)
    jump = found.jumps_at
    end = f"slides {1e3 * found.slide[-1]:.1f} mm" if jump is None else f"jumps at {jump:.1f} s, before the end"
    if found.plunges_at is not None:
        end = f"slides {1e3 * found.slide[found.times <= found.plunges_at][-1]:.1f} mm, plunges at {jump:.1f} s"
    sys.stdout.write(f"{found!r}\npredicted: {end}\n{file}\n")
    return 0


def _require_writable(out: Path) -> None:
    """Refuse a file that could not be written before anything is planned for it."""
    if out.suffix not in (".csv", ".json"):
        raise ValueError(f"out must end in .csv or .json, got {out.name!r}")
    if not out.parent.is_dir():
        raise ValueError(f"out must be in an existing folder, got {str(out)!r}")
