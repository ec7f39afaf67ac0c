"""The command `withe train-mask`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from withe.perception.learned_mask import SHIPPED
from withe.perception.mask_training import STEPS, train_mask

__all__ = ["add_parser", "run"]


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `train-mask` to the commands of a parser."""
    parser = commands.add_parser(
        "train-mask",
        help="train the network that finds cables on any ground",
        description="Train the network of the learned mask on made pictures, and write it as an ONNX file. An "
        "interrupted training resumes if the same command is given again.",
    )
    parser.add_argument("--out", type=Path, default=SHIPPED, help="the file (default: the one that trace uses)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the pictures and weights (default: 0)")
    parser.add_argument("--steps", type=int, default=STEPS, help="steps of four pictures (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=1, help="threads of torch (default: 1)")
    parser.add_argument("--workers", type=int, default=1, help="processes that draw pictures (default: 1)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Train, write the file and print a summary."""
    record = train_mask(
        arguments.out,
        arguments.seed,
        steps=arguments.steps,
        threads=arguments.threads,
        workers=arguments.workers,
    )
    last = record.losses[-100:]
    sys.stdout.write(
        f"{record.steps} steps in {record.seconds / 60:.0f} min, loss {sum(last) / len(last):.3f}\n{record.path}\n"
    )
    return 0
