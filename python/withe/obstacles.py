"""Floors, planes, spheres and capsules that move: the part of `Simulation` that is about them."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from withe import _core, validation
from withe.directory import Directory
from withe.handles import Obstacle
from withe.motion import Path
from withe.parts import ObstaclePart
from withe.snapshots import Settings

__all__ = ["MovingObstacles"]


class MovingObstacles:
    """What `Control.move` does to obstacles."""

    _directory: Directory
    _settings: Settings
    _world: _core.World

    def _obstacle(self, handle: Any) -> tuple[int, str] | None:
        """Index and name of an obstacle; None where it is something else."""
        name = self._directory.find(handle, ObstaclePart, "obstacle").name if isinstance(handle, Obstacle) else handle
        names = [part.name for part in self._directory.all(ObstaclePart)]
        return (names.index(name), name) if isinstance(name, str) and name in names else None

    def _move_obstacle(
        self, index: int, name: str, position: npt.ArrayLike | None, over: float, path: Path | None
    ) -> None:
        over = validation.non_negative(over, "over")
        if path is not None:
            if position is not None or over != 0.0:
                raise ValueError(f"path of {name!r} must be given alone")
            validation.function(path, f"path of {name!r}")
            now = self._world.time
            validation.vector(path(now), f"path of {name!r} at t = {now:g}")
            self._settings.paths[name] = path
            return
        if position is None:
            raise ValueError(f"position or path of {name!r} must be given")
        self._world.move_obstacle(index, validation.vector(position, f"position of {name!r}"), over)
        self._settings.paths.pop(name, None)
