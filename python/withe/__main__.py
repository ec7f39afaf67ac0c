"""The command line: ``withe perceive IMAGE``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from withe.perception import command

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; what the user gave wrongly is said in one line."""
    parser = argparse.ArgumentParser(prog="withe", description="Tools around withe: soft robots made of slender rods.")
    commands = parser.add_subparsers(required=True, metavar="command")
    command.add_parser(commands)
    parsed = parser.parse_args(arguments)
    try:
        return int(parsed.run(parsed))
    except (ValueError, OSError, ImportError) as error:
        sys.stderr.write(f"withe: {error}\n")
        return 2


if __name__ == "__main__":
    sys.exit(main())
