"""The command line: ``withe run``, ``perceive``, ``track``, ``train-mask``, ``deploy``, ``fold``."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from withe.deployment import command as deploy
from withe.folding import command as fold
from withe.perception import command as perceive
from withe.perception import track_command as track
from withe.perception import train_command as train_mask
from withe.scene import command as scene

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; what the user gave wrongly, and what is warned of, is said in one line."""
    parser = argparse.ArgumentParser(prog="withe", description="Tools around withe: soft robots made of slender rods.")
    commands = parser.add_subparsers(required=True, metavar="command")
    scene.add_parser(commands)
    perceive.add_parser(commands)
    track.add_parser(commands)
    train_mask.add_parser(commands)
    deploy.add_parser(commands)
    fold.add_parser(commands)
    parsed = parser.parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", UserWarning)
            warnings.showwarning = _said
            return int(parsed.run(parsed))
    except (ValueError, OSError, ImportError, RuntimeError) as error:
        sys.stderr.write(f"withe: {_reason(error)}\n")
        return 2


def _reason(error: Exception) -> str:
    """Return the message of an error, without the error number of the operating system."""
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.strerror}: {os.fsdecode(error.filename)!r}"
    return str(error)


def _said(message: Warning | str, *_: Any, **__: Any) -> None:
    """In one line, as errors are: where in withe it was said helps nobody at a command line."""
    sys.stderr.write(f"withe: {message}\n")


if __name__ == "__main__":
    sys.exit(main())
