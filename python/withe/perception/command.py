"""The command `withe perceive`."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from withe.common.extras import require
from withe.perception.drawing import draw
from withe.perception.images import read_image
from withe.perception.tracing import trace

__all__ = ["add_parser", "run"]


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `perceive` to the commands of a parser."""
    parser = commands.add_parser(
        "perceive",
        help="find every cable in an image",
        description="Find every cable in an image; write NAME_cables.png (overlay) and NAME_cables.json (every field).",
    )
    parser.add_argument("image", type=Path, help="the picture")
    parser.add_argument("--mask", type=Path, help="a picture whose bright pixels are cables")
    parser.add_argument("--out", type=Path, default=Path("."), help="folder to write to (default: here)")
    parser.add_argument(
        "--method", choices=["withe", "mbest"], default="withe", help="method: withe, or the published mbest"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Trace, write both files and print a summary."""
    cv2 = require("cv2", "vision")
    image = read_image(arguments.image)
    mask = None if arguments.mask is None else read_image(arguments.mask, "mask").max(axis=2) > 127
    tracing = trace(image, mask=mask, method=arguments.method)
    arguments.out.mkdir(parents=True, exist_ok=True)
    stem = arguments.out / f"{arguments.image.stem}_cables"
    picture = stem.with_suffix(".png")
    encoded, content = cv2.imencode(".png", np.ascontiguousarray(draw(image, tracing)[..., ::-1]))
    if not encoded:
        raise ValueError(f"out must take a PNG file, could not write {picture}")
    picture.write_bytes(content.tobytes())
    table = stem.with_suffix(".json")
    table.write_text(json.dumps(tracing.to_dict()), encoding="utf-8")
    doubts = f", {len(tracing.ambiguous)} ambiguous" if tracing.ambiguous else ""
    sys.stdout.write(f"{tracing!r}{doubts}\n{picture}\n{table}\n")
    return 0
