"""The command line: ``withe perceive IMAGE``, ``withe deploy PATTERN``, ``withe fold --paper a4``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from withe.deployment import command as deploy
from withe.folding import command as fold
from withe.perception import command as perceive

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; what the user gave wrongly is said in one line."""
    parser = argparse.ArgumentParser(prog="withe", description="Tools around withe: soft robots made of slender rods.")
    commands = parser.add_subparsers(required=True, metavar="command")
    perceive.add_parser(commands)
    deploy.add_parser(commands)
    fold.add_parser(commands)
    parsed = parser.parse_args(arguments)
    try:
        return int(parsed.run(parsed))
    except (ValueError, OSError, ImportError) as error:
        sys.stderr.write(f"withe: {error}\n")
        return 2


if __name__ == "__main__":
    sys.exit(main())
