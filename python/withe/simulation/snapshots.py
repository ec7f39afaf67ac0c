"""Snapshots: the whole state of a simulation at one moment, which can be restored bit for bit."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import io
from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.hands import pose_of
from withe.parts.kinds import LOAD_KINDS, SUPPORT_KINDS, BodyPart, Grasp, LoadPart, ObstaclePart, Pass, SupportPart
from withe.parts.parameters import RodParameters
from withe.simulation.motion import POSE_WORDS, PathTable, Turn, Waypoints
from withe.simulation.session import Session
from withe.simulation.settings import Settings
from withe.simulation.surfaces import find_friction_fields

__all__ = ["Snapshot", "adopt", "check_fits", "matched", "restore"]

FloatArray = npt.NDArray[np.float64]

_FILE_VERSION = 8


class Snapshot:
    """The whole state of a simulation at one moment. Made by `Simulation.snapshot`, or read with `load`.

    Any simulation of the same scene with the same options can restore it, and continues bit for bit. Files and pickles
    do not contain functions of time (of loads and paths). A simulation that restores such a snapshot must already have
    these functions.
    """

    _scene: Directory | None = None  # scene of the snapshot, if known: simulations of this scene can restore it

    def __init__(
        self,
        state: bytes,
        time: float,
        settings: Settings,
        missing: tuple[str, ...] = (),
        scene: Directory | None = None,
        fields: tuple[tuple[str, ...], ...] = (),
    ) -> None:
        self._state = state
        self._time = time
        self._settings = settings
        self._missing = missing  # names of loads, supports and obstacles whose functions are not in the file
        self._scene = scene
        self._fields = fields  # whose fields of friction are not in the file, see `Settings.frictions`

    @property
    def time(self) -> float:
        """Time of the snapshot [s]."""
        return self._time

    def __repr__(self) -> str:
        return f"Snapshot(t = {self._time:g} s)"

    def _function_names(self) -> tuple[str, ...]:
        """Loads, supports and obstacles whose functions no file can hold."""
        paths = (name for (name, _), path in self._settings.paths.items() if not isinstance(path, Turn | Waypoints))
        fields = (obstacle for _, obstacle, _ in self._settings.friction_fields.values())
        return tuple(sorted({*self._settings.functions, *paths, *fields, *self._missing}))

    def _field_names(self) -> tuple[tuple[str, ...], ...]:
        """Whose fields of friction no file can hold."""
        return tuple(sorted({*self._settings.frictions, *self._fields}))

    def __getstate__(self) -> dict[str, Any]:
        settings = self._settings.copy()
        settings.functions = {}
        settings.loads = {name: replace(load, function=None) for name, load in settings.loads.items()}
        settings.paths = {key: path for key, path in settings.paths.items() if isinstance(path, Turn | Waypoints)}
        settings.friction_fields, settings.frictions = {}, {}
        return {
            "_state": self._state,
            "_time": self._time,
            "_settings": settings,
            "_missing": self._function_names(),
            "_fields": self._field_names(),
        }

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Snapshot):
            return NotImplemented
        return self._state == other._state

    def __hash__(self) -> int:
        return hash(self._state)

    def save(self, path: str | os.PathLike[str]) -> FilePath:
        """Write the snapshot to one .npz file.

        Parameters
        ----------
        path : str or path
            File to write, with the suffix .npz.

        Returns
        -------
        pathlib.Path
            Path of the file.

        Raises
        ------
        ValueError
            A path with another suffix.
        OSError
            The file cannot be written.

        See Also
        --------
        load : Read the file.
        """
        settings = self._settings
        arrays: dict[str, npt.NDArray[Any]] = {
            "state": np.frombuffer(self._state, np.uint8),
            "gravity": settings.gravity,
        }
        for index, rod in enumerate(settings.rods):
            arrays |= {f"rod_{index}_{word}": values for word, values in rod.arrays().items()}
        supports = []
        for number, (name, (index, part)) in enumerate(settings.supports.items()):
            entry = {"name": name, "index": index, "kind": part.kind, "node": part.node_name, "point": part.node[1]}
            supports.append(entry | (_written(part.grasp) if part.grasp is not None else {}))
            arrays[f"support_{number}_free"] = part.free
            if part.axis is not None:
                arrays[f"support_{number}_axis"] = part.axis
            for half in POSE_WORDS:
                moving = settings.paths.get((name, half))
                if isinstance(moving, Turn | Waypoints):
                    arrays |= {f"support_{number}_{half}_{word}": values for word, values in moving.arrays().items()}
        loads = []
        for number, load in enumerate(settings.loads.values()):
            loads.append({"name": load.name, "kind": load.kind, "node": load.node, "follower": load.follower})
            arrays[f"load_{number}_value"] = load.value
            if load.axis is not None:
                arrays[f"load_{number}_axis"] = load.axis
        header = {
            "time": self._time,
            "actuated": None if settings.actuated < 0.0 else settings.actuated,
            "rods": len(settings.rods),
            "masses": settings.masses,
            "drags": settings.drags,
            "fluids": settings.fluids,
            "supports": supports,
            "loads": loads,
            "functions": self._function_names(),
            "friction_fields": self._field_names(),
        }
        return io.save_arrays(path, "snapshot", _FILE_VERSION, header, arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Snapshot:
        """Read a snapshot that `save` wrote. The file cannot execute code.

        Parameters
        ----------
        path : str or path
            File to read.

        Returns
        -------
        Snapshot

        Raises
        ------
        ValueError
            A file that is damaged, not a snapshot, or of another version.
        OSError
            The file cannot be opened.

        See Also
        --------
        save : Write a snapshot.
        Simulation.restore : Restore the state.
        """
        header, arrays = io.load_arrays(path, "snapshot", _FILE_VERSION)
        try:
            return cls._from_file(header, arrays)
        except (KeyError, TypeError, AttributeError, ValueError, OverflowError) as error:
            raise ValueError(f"{path} is a damaged snapshot: {error}") from error

    @classmethod
    def _from_file(cls, header: dict[str, Any], arrays: dict[str, npt.NDArray[Any]]) -> Snapshot:
        rods = []
        for index in range(validation.integer(header["rods"], "rods", 0, 10_000_000)):
            mine = {
                name.removeprefix(f"rod_{index}_"): values
                for name, values in arrays.items()
                if name.startswith(f"rod_{index}_")
            }
            rods.append(RodParameters.from_arrays(mine, len(mine["stretch_stiffness"]), f"rod {index}"))
        supports: dict[str, tuple[int, SupportPart]] = {}
        paths: PathTable = {}
        for number, entry in enumerate(header["supports"]):
            name, kind = str(entry["name"]), validation.choice(entry["kind"], "kind", SUPPORT_KINDS)
            free = validation.number_array(arrays[f"support_{number}_free"], "free", (3, 3))
            index = validation.integer(entry["index"], "index", 0, 10_000_000)
            # The restoring simulation finds the node of a rod by the name.
            point = validation.integer(entry.get("point", 0), "point", 0, 10_000_000)
            grasp = _read(entry) if kind == "hand" else None
            axis = arrays.get(f"support_{number}_axis")
            if axis is not None:
                axis = validation.unit_vector(axis, "axis")
            supports[name] = index, SupportPart(name, kind, (-1, point), str(entry["node"]), free, grasp, axis)  # type: ignore[arg-type]
            for half in POSE_WORDS:
                if (way := _read_path(arrays, f"support_{number}_{half}_")) is not None:
                    paths[name, half] = way
        loads: dict[str, LoadPart] = {}
        for number, entry in enumerate(header.get("loads", [])):  # absent in the first files
            name, kind = str(entry["name"]), validation.choice(entry["kind"], "kind", LOAD_KINDS)
            rod, node = (validation.integer(index, "node", 0, 10_000_000) for index in entry["node"])
            axis = arrays.get(f"load_{number}_axis")
            loads[name] = LoadPart(
                name,
                kind,  # type: ignore[arg-type]
                (rod, node),
                validation.number_array(arrays[f"load_{number}_value"], "value", (3,), ("edges", 3)),
                None,
                validation.truth(entry["follower"], "follower"),
                None if axis is None else validation.unit_vector(axis, "axis"),
            )
        settings = Settings(
            rods=rods,
            masses={str(name): validation.non_negative(mass, name) for name, mass in header["masses"].items()},
            drags={str(name): validation.non_negative(drag, name) for name, drag in header["drags"].items()},
            fluids={str(name): validation.positive(fluid, name) for name, fluid in header["fluids"].items()},
            gravity=validation.vector(arrays["gravity"], "gravity"),
            supports=supports,
            paths=paths,
            loads=loads,
            actuated=_actuated(header),
        )
        missing = tuple(str(name) for name in header["functions"])
        fields = tuple(tuple(str(name) for name in names) for names in header["friction_fields"])
        state = arrays["state"]
        if state.dtype != np.uint8 or state.ndim != 1:
            raise ValueError("its state must be bytes")
        return cls(state.tobytes(), validation.number(header["time"], "time"), settings, missing, fields=fields)


def restore(session: Session, snapshot: Snapshot) -> None:
    """Restore a snapshot; see `Simulation.restore`.

    Raises
    ------
    ValueError
        A snapshot of another scene, a damaged one, or one that needs functions of time that the session does not have.
    """
    settings = matched(session, snapshot)
    session.world.restore(snapshot._state)
    adopt(session, settings)


def matched(session: Session, snapshot: Snapshot) -> Settings:
    """Return the settings for `adopt` after the engine has restored a snapshot; see `restore`."""
    return _matched(snapshot, session.settings, session.directory, session.scene)


def check_fits(session: Session, snapshot: Snapshot) -> None:
    """Refuse a snapshot that the engine cannot restore; nothing is changed.

    Raises
    ------
    ValueError
        A snapshot of another scene, or a damaged one.
    """
    if snapshot._scene is not session.scene:
        session.world.copy().restore(snapshot._state)


def adopt(session: Session, settings: Settings) -> None:
    """Adopt the settings of a restored snapshot, and update the values that depend on them."""
    parts = session.directory.parts
    for name in set(parts) - set(session.scene.parts) - set(settings.supports):
        del parts[name]
    parts.update({name: part for name, (_, part) in settings.supports.items()})
    parts.update(settings.loads)
    session.settings = settings
    find_friction_fields(session)


def _held_node(part: SupportPart, directory: Directory) -> Pass:
    """Return the node of a rod or the point of a body that a support of a snapshot holds."""
    if not directory.is_body(part.node_name):
        return directory.node(part.node_name, f"node held by {part.name!r}")[0]
    body = directory.find(part.node_name, BodyPart, f"body held by {part.name!r}")
    if part.node[1] >= len(directory.layout.body_points[body.index]):
        raise ValueError(f"snapshot belongs to another scene: body {body.name!r} has no point that {part.name!r} holds")
    return -1 - body.index, part.node[1]


def _matched(snapshot: Snapshot, mine: Settings, directory: Directory, scene: Directory) -> Settings:
    """Return the settings of a snapshot, completed by the simulation that restores it.

    Parameters
    ----------
    snapshot : Snapshot
    mine : Settings
        Of that simulation now.
    directory, scene : Directory
        Its parts now, and those of the scene as it was drawn.

    Raises
    ------
    ValueError
        A snapshot of another scene, or one that needs functions of time that the simulation does not have.
    """
    settings = snapshot._settings.copy()
    counts = [len(rod.stretch_stiffness) for rod in mine.rods]
    if (
        [len(rod.stretch_stiffness) for rod in settings.rods] != counts
        or settings.masses.keys() != mine.masses.keys()
        or settings.drags.keys() != mine.drags.keys()
        or settings.fluids.keys() != mine.fluids.keys()
    ):
        raise ValueError("snapshot belongs to another scene")
    for name, (index, part) in settings.supports.items():
        settings.supports[name] = index, replace(part, node=_held_node(part, directory))
        known = scene.parts.get(name)
        if known is not None and not isinstance(known, SupportPart):
            raise ValueError(f"snapshot belongs to another scene: {name!r} is not a support of this scene")
    for names, friction in mine.frictions.items():
        if names in snapshot._fields:
            settings.frictions[names] = friction
    for names in snapshot._fields:
        if names not in settings.frictions:
            raise ValueError(
                "snapshot files do not store functions of position: set the friction of "
                f"{' and '.join(map(repr, names))} on this simulation first"
            )
    for name in snapshot._missing:
        drawn = scene.parts.get(name)
        varies = any(name in names for names in settings.frictions)
        own: PathTable = {key: path for key, path in mine.paths.items() if key[0] == name}
        if (name in settings.supports or isinstance(drawn, ObstaclePart)) and own:
            settings.paths = own | settings.paths
        elif varies:
            continue
        elif name in mine.functions:
            settings.functions[name] = mine.functions[name]
        elif isinstance(drawn, LoadPart) and drawn.function is not None:
            settings.functions[name] = drawn.function
        else:
            raise ValueError(
                f"snapshot files do not store functions of time: set the function of {name!r} on this simulation first"
            )
    return settings


def _actuated(header: dict[str, Any]) -> float:
    value = header.get("actuated")
    return -math.inf if value is None else validation.non_negative(value, "actuated")


def _read_path(arrays: dict[str, npt.NDArray[Any]], prefix: str) -> Turn | Waypoints | None:
    """That along which something moves, if it is in a file."""

    def read(*shapes: tuple[str, tuple[int | str, ...]]) -> list[FloatArray]:
        return [validation.number_array(arrays[prefix + word], word, shape) for word, shape in shapes]

    if prefix + "drawn" in arrays:
        return Turn(*read(("tangents", (2, 3)), ("rolls", (2,)), ("times", (2, 2)), ("drawn", (2, 3))))
    if prefix + "times" in arrays:
        return Waypoints(*read(("times", ("poses",)), ("positions", ("poses", 3)), ("rotations", ("poses", 3, 3))))
    return None


def _written(grasp: Grasp) -> dict[str, Any]:
    """A hand, for the header of a file."""
    return {
        "at": grasp.at,
        "length": grasp.length,
        "pose": None if grasp.pose is None else [grasp.pose[0].tolist(), grasp.pose[1].tolist()],
        "stiffness": None if grasp.stiffness is None else grasp.stiffness.tolist(),
        "force_limit": grasp.force_limit if math.isfinite(grasp.force_limit) else None,
        "edges": list(grasp.edges),
        "slides": grasp.slides,
        "friction": grasp.friction,
        "feed_rate": grasp.feed_rate,
    }


def _read(entry: dict[str, Any]) -> Grasp:
    """That back."""
    pose, stiffness, limit = entry["pose"], entry["stiffness"], entry["force_limit"]
    rate = entry["feed_rate"]
    return Grasp(
        at=validation.number(entry["at"], "at"),
        length=validation.non_negative(entry["length"], "length"),
        pose=None if pose is None else pose_of(tuple(pose), "pose"),
        stiffness=None if stiffness is None else validation.per_item(stiffness, "stiffness", 6, "directions"),
        force_limit=math.inf if limit is None else validation.positive(limit, "force_limit"),
        edges=tuple(validation.integer(edge, "edge", 0, 10_000_000) for edge in entry["edges"]),
        slides=validation.truth(entry["slides"], "slides"),
        friction=validation.non_negative(entry["friction"], "friction"),
        feed_rate=None if rate is None else validation.number(rate, "feed_rate"),
    )
