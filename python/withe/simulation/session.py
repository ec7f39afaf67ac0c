"""A running scene, the argument of every function that changes or reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.parts.body_surfaces import place_surfaces
from withe.parts.contacts import drawn_frictions
from withe.parts.description import describe, parameters_of
from withe.parts.directory import Directory
from withe.parts.kinds import CustomForcePart, DragPart, FluidPart, LoadPart, MassPart, RodPart, SupportPart
from withe.parts.loops import open_loops
from withe.parts.options import BuildOptions, check_tolerances
from withe.simulation.settings import Settings

__all__ = ["Session"]

FloatArray = npt.NDArray[np.float64]


class Journal(Protocol):
    """Receiver of the values that are set."""

    def note(self, session: Session, method: str, part: Any, values: Mapping[str, Any], over: float) -> None:
        """Note values of a call, for a part or the scene, with the duration of their ramp [s]."""


@dataclass(eq=False)
class Session:
    """A running scene.

    Attributes
    ----------
    scene, gravity, options
        Scene, gravity and options at the build. They never change.
    directory : Directory
        Present parts: those of the scene, and those added since.
    settings : Settings
        Values set since the build.
    world : _core.World
        The engine.
    drawn_loads, custom_forces : tuple
        Loads and custom forces of the scene, in its order.
    journal : Journal or None
        Journal of a differentiable run, while it runs.
    contact_then : ContactDescription or None
        Contact description of a stored session.
    left_rings : list of (str, float)
        Rings that the engine has released because their rods have left them: name and time [s]; not yet reported.
    restorations : int
        Number of restorations of a snapshot or of a frame of a record.
    longest_meant : float [s]
        Longest time step that is intended by measurement: up to it, no `CoarseStepWarning` is given.
    """

    scene: Directory
    gravity: FloatArray
    options: BuildOptions
    directory: Directory
    settings: Settings
    world: _core.World
    drawn_loads: tuple[LoadPart, ...]
    custom_forces: tuple[CustomForcePart, ...]
    journal: Journal | None = None
    contact_then: _core.ContactDescription | None = None
    left_rings: list[tuple[str, float]] = field(default_factory=list)
    restorations: int = 0
    longest_meant: float = 0.0

    @classmethod
    def begin(cls, scene: Directory, gravity: FloatArray, options: BuildOptions) -> Session:
        """Build a scene that no other code changes.

        Raises
        ------
        ValueError
            A scene that cannot be built.
        """
        place_surfaces(scene)
        open_loops(scene)
        description = describe(scene, gravity, options.bending)
        if rods := scene.all(RodPart):
            check_tolerances(
                options, max(float(rod.lengths.sum()) for rod in rods), min(float(rod.lengths.min()) for rod in rods)
            )
        drawn_loads = tuple(scene.all(LoadPart))
        settings = Settings(
            rods=parameters_of(scene),
            masses={part.name: part.mass for part in scene.all(MassPart)},
            drags={part.name: part.coefficient for part in scene.all(DragPart)},
            fluids={part.name: part.viscosity for part in scene.all(FluidPart)},
            gravity=gravity.copy(),
            supports={part.name: (index, part) for index, part in enumerate(scene.all(SupportPart))},
            functions={part.name: part.function for part in drawn_loads if part.function is not None},
            frictions=drawn_frictions(scene),
        )
        return cls(
            scene=scene,
            gravity=gravity,
            options=options,
            directory=scene.copy(),
            settings=settings,
            world=_core.World(description, options.engine()),
            drawn_loads=drawn_loads,
            custom_forces=tuple(scene.all(CustomForcePart)),
        )

    def copy(self) -> Session:
        """Return an independent session in the same state."""
        return replace(
            self,
            directory=self.directory.copy(),
            settings=self.settings.copy(),
            world=self.world.copy(),
            journal=None,
            left_rings=[],
        )

    def note(self, method: str, part: Any, values: Mapping[str, Any], over: float = 0.0) -> None:
        """Note the values of a call, for a part, two bodies, or None (the scene), also in the journal, if any."""
        name = getattr(part, "name", None)
        for word in ["move"] if method == "move" else values:
            self.settings.ramps.pop((word, name), None)
            if over > 0.0:
                self.settings.ramps[word, name] = self.world.time
        if self.journal is not None:
            self.journal.note(self, method, part, values, over)

    @property
    def contact(self) -> _core.ContactDescription:
        """Return the contact description with the present friction coefficients."""
        return self.contact_then if self.contact_then is not None else self.world.contact

    @property
    def loads(self) -> list[LoadPart]:
        """All loads, in the order of the engine."""
        return [*self.drawn_loads, *self.settings.loads.values()]
