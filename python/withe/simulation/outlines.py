"""Outlines of the parts of a simulation, for records and pictures."""

from __future__ import annotations

from typing import NamedTuple

from withe.common.outlines import BodyOutline, ObstacleOutline, SpringOutline, TendonOutline
from withe.parts.directory import Directory
from withe.parts.table import kind_of
from withe.simulation.bodies import body_outlines
from withe.simulation.obstacles import obstacle_outlines

__all__ = ["Outlines", "outlines_of"]


class Outlines(NamedTuple):
    """Outlines of obstacles, springs, tendons and rigid bodies."""

    obstacles: list[ObstacleOutline]
    springs: list[SpringOutline]
    tendons: list[TendonOutline]
    bodies: list[BodyOutline]


def outlines_of(directory: Directory) -> Outlines:
    """Return the outlines of all parts that have one, each kind in the order of the scene."""
    drawn = [
        outline(part, directory.row)
        for part in directory.parts.values()
        if (outline := kind_of(part).outline) is not None
    ]
    return Outlines(
        obstacle_outlines(directory),
        [each for each in drawn if isinstance(each, SpringOutline)],
        [each for each in drawn if isinstance(each, TendonOutline)],
        body_outlines(directory),
    )
