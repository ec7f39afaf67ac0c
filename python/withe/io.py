"""Files: arrays with a header in one .npz without pickle, and VTK collections for ParaView."""

from __future__ import annotations

import base64
import errno
import json
import os
import uuid
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.frames import Frames, edges_to_nodes, stencils_to_nodes
from withe.common.log import logger, logs_debug

__all__ = [
    "PlanFile",
    "increasing_times",
    "listed",
    "load_arrays",
    "load_json",
    "load_poses",
    "pose_path",
    "save_arrays",
    "save_json",
    "save_poses",
    "with_gaps",
    "write_collection",
    "write_vtk",
    "written_beside",
]

FloatArray = npt.NDArray[np.float64]
Content = TypeVar("Content")

_HEADER = "header"
_POSE_COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Return a path beside a file to write to; the file is replaced only when it is complete.

    If writing ends early, for example by a full disk or Ctrl-C, the previous file remains.

    Yields
    ------
    pathlib.Path
        Path in the same folder and with the same suffix, by which some writers choose a format.

    Raises
    ------
    OSError
        The file cannot be written, or a device or a pipe has its name; the error names `path` and the reason.
    """
    if path.exists() and not path.is_file() and not path.is_dir():  # a user who may would lose /dev/full
        raise OSError(
            errno.EINVAL, "file cannot take the place of a device or a pipe: give another path than", f"{path}"
        )
    # Not made of the file's name, which may be as long as the system allows.
    temporary = path.with_name(f".withe-{uuid.uuid4().hex}.part{path.suffix[:8]}")
    try:
        yield temporary
        os.replace(temporary, path)
        if logs_debug():
            logger.debug("wrote %s: %d bytes", path, path.stat().st_size)
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, f"{os.strerror(error.errno)}; nothing was written to", os.fspath(path)) from error
    finally:
        temporary.unlink(missing_ok=True)


def save_arrays(
    path: str | os.PathLike[str],
    kind: str,
    version: int,
    header: Mapping[str, Any],
    arrays: Mapping[str, npt.NDArray[Any]],
) -> Path:
    """Write arrays and a header to one .npz file, at once or not at all.

    Parameters
    ----------
    path : path
        Path of the file, ending in .npz.
    kind : str
        Kind of the content, such as "record"; `load_arrays` refuses any other kind.
    version : int
        Version of the layout of this kind.
    header : mapping
        Names, units and other values that JSON supports.
    arrays : mapping of str to ndarray
        Arrays of numbers; objects are refused, so that reading never executes code.

    Returns
    -------
    pathlib.Path
        The written file.

    Raises
    ------
    ValueError
        Another suffix, or an array that holds objects.
    OSError
        The file cannot be written.
    """
    path = validation.file_path(path, ".npz")
    for name, array in arrays.items():
        if array.dtype.hasobject:
            raise ValueError(f"array {name!r} for {path} must hold numbers, got objects")
    named: dict[str, Any] = {**arrays}
    text = json.dumps({"format": f"withe {kind}", "version": version, **header})
    named[_HEADER] = np.array(text)
    with written_beside(path) as temporary, temporary.open("xb") as stream:
        np.savez(stream, **named)
    return path


def load_arrays(
    path: str | os.PathLike[str], kind: str, version: int
) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Read a file that `save_arrays` wrote. The file cannot execute code.

    Returns
    -------
    header : dict
        Header as saved.
    arrays : dict of str to ndarray
        Every array of the file.

    Raises
    ------
    ValueError
        A file that is damaged, not a withe file, of another kind or of another version; the message names the file and
        the reason.
    OSError
        The file cannot be opened.
    """
    path = Path(path)
    with path.open("rb") as stream:
        # NumPy would take anything else for a pickle, and advise to load it unsafely.
        if stream.read(2) != b"PK":
            raise ValueError(f"{path} is not a withe file, or damaged: it is not an npz archive")
        stream.seek(0)
        try:
            with zipfile.ZipFile(stream) as packed:
                # Before anything interprets the bytes: every member has a checksum.
                if changed := packed.testzip():
                    raise ValueError(f"{path} is damaged: the bytes of {changed!r} have changed")
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as archive:
                if not isinstance(archive, np.lib.npyio.NpzFile) or _HEADER not in archive.files:
                    raise ValueError(f"{path} is not a withe file")
                header = _read_header(path, archive[_HEADER], kind, version)
                arrays = {name: archive[name] for name in archive.files if name != _HEADER}
        except ValueError as error:
            if str(path) in str(error):
                raise
            raise ValueError(f"{path} is not a withe file, or damaged: {error}") from error
        except Exception as error:  # NumPy and zipfile raise nearly everything on bytes that they do not understand
            reason = str(error) or type(error).__name__
            raise ValueError(f"{path} is not a withe file, or damaged: {reason}") from error
    return header, arrays


def _read_header(path: Path, text: npt.NDArray[Any], kind: str, version: int) -> dict[str, Any]:
    try:
        header = json.loads(str(text))
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{path} is not a withe file: its header is unreadable ({error})") from error
    return _checked_header(path, header, kind, version)


def _checked_header(path: Path, header: Any, kind: str, version: int) -> dict[str, Any]:
    if not isinstance(header, dict) or not str(header.get("format", "")).startswith("withe "):
        raise ValueError(f"{path} is not a withe file")
    if header["format"] != f"withe {kind}":
        raise ValueError(f"{path} holds a {header['format']}, expected a withe {kind}")
    if header.get("version") != version:
        raise ValueError(f"{path} is a {kind} of version {header.get('version')!r}, this withe reads version {version}")
    return header


def save_json(path: str | os.PathLike[str], kind: str, version: int, content: Mapping[str, Any]) -> Path:
    """Write numbers and words as JSON, after their kind and the version of their format."""
    path = Path(path)
    with written_beside(path) as beside:
        text = json.dumps({"format": f"withe {kind}", "version": version, **content}, indent=1, allow_nan=False)
        beside.write_text(text, encoding="utf-8")
    return path


def load_json(
    path: str | os.PathLike[str], kind: str, version: int, read: Callable[[dict[str, Any]], Content]
) -> Content:
    """Return the content that `save_json` wrote, converted by `read`.

    Raises
    ------
    ValueError
        A file that is damaged, not a withe file, of another kind or of another version; the message names the file. A
        file in which `read` misses or refuses a value counts as damaged.
    OSError
        The file cannot be opened.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        other = "" if path.suffix == ".json" else "; the file to read is the .json"
        raise ValueError(f"{path} is not a withe file, or damaged: it is not JSON ({error}){other}") from error
    content = _checked_header(path, content, kind, version)
    try:
        return read(content)
    except KeyError as error:
        raise ValueError(f"{path} is a damaged {kind}: it has no {error}") from error
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is a damaged {kind}: {error}") from error


class PlanFile(ABC):
    """A plan of poses that is saved as a table for robots, or as JSON with everything that `load` needs."""

    KIND: ClassVar[str]
    VERSION: ClassVar[int]
    times: FloatArray

    @property
    @abstractmethod
    def _saved_poses(self) -> FloatArray:
        """Positions and quaternions x, y, z, w, of shape (n, 7) [m], [-]."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return the plan as lists and words, for JSON. SI units; numbers that are not finite are None."""

    @staticmethod
    @abstractmethod
    def _parts_of(content: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments of the class from what `to_dict` returned."""

    @property
    def path(self) -> FloatArray:
        """Rows t, x, y, z, qw, qx, qy, qz of shape (n, 8), for hands of a simulation, whose scalar comes first.

        >>> import withe
        >>> plan = withe.folding.plan(withe.folding.Paper.a4())
        >>> hand = scene.grasp(sheet, at=0.005, length=0.01, pose=plan.path[0, 1:])  # doctest: +SKIP
        >>> simulation.move(hand, path=plan.path)  # doctest: +SKIP
        """
        return pose_path(self.times, self._saved_poses)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the plan to a file.

        Parameters
        ----------
        path : path-like
            "NAME.csv": columns t, x, y, z, qx, qy, qz, qw [s], [m], [-], the fields of geometry_msgs' PoseArray and
            trajectory_msgs' MultiDOFJointTrajectory, which `withe.io.load_poses` reads for a hand. "NAME.json": the
            whole plan, which `load` reads.

        Returns
        -------
        Path

        Raises
        ------
        ValueError
            Another suffix.
        OSError
            The file cannot be written.
        """
        path = Path(path)
        if path.suffix == ".csv":
            return save_poses(path, self.times, self._saved_poses)
        if path.suffix != ".json":
            raise ValueError(f"path must end in .csv or .json, got {path.name!r}")
        return save_json(path, self.KIND, self.VERSION, self.to_dict())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a plan that `save` wrote as JSON, equal to the last digit.

        Parameters
        ----------
        path : path-like

        Returns
        -------
        FoldPlan or LayPlan
            Plan of this class.

        Raises
        ------
        ValueError
            A file that is damaged, of another kind (a table of poses is not a plan), or of another version.
        OSError
            The file cannot be opened.

        Examples
        --------
        >>> withe.folding.FoldPlan.load("fold.json").plot()  # doctest: +SKIP
        >>> withe.deployment.LayPlan.load("motion.json").feasibility(0.4)  # doctest: +SKIP
        """
        return load_json(path, cls.KIND, cls.VERSION, lambda content: cls(**cls._parts_of(content)))


def increasing_times(values: Any, what: str) -> FloatArray:
    """Return the times of a plan in a file [s]: two or more that increase from 0. Raise ValueError for others."""
    times = validation.number_array(values, what, ("n",))
    if len(times) < 2 or times[0] != 0.0 or (np.diff(times) <= 0.0).any():
        raise ValueError(f"{what} must be two or more values that increase from 0")
    return times


def listed(values: FloatArray) -> list[Any]:
    """Return numbers for JSON: a number that is not finite becomes None."""
    return [value if np.isfinite(value) else None for value in values.tolist()]


def with_gaps(values: Any, what: str, count: int) -> FloatArray:
    """Return `count` numbers from the result of `listed`; None becomes NaN."""
    known = [0.0 if value is None else value for value in values]
    missing = [value is None for value in values]
    return np.where(missing, np.nan, validation.number_array(known, what, (count,)))


def save_poses(path: str | os.PathLike[str], times: npt.NDArray[np.float64], poses: npt.NDArray[np.float64]) -> Path:
    """Write poses and their times as a table for robots, at once or not at all.

    Parameters
    ----------
    path : path
        Path of the table. Its columns t, x, y, z, qx, qy, qz, qw have a header, and the order of the fields of
        geometry_msgs' Pose and of trajectory_msgs' MultiDOFJointTrajectory.
    times : ndarray of shape (n,) [s]
    poses : ndarray of shape (n, 7) [m], [-]
        x, y, z and the quaternion x, y, z, w.

    Returns
    -------
    pathlib.Path
        The written file.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    path = Path(path)
    with written_beside(path) as beside:
        rows = np.column_stack([times, poses])
        np.savetxt(beside, rows, delimiter=",", header=",".join(_POSE_COLUMNS), comments="", fmt="%.9g")
    return path


def load_poses(path: str | os.PathLike[str]) -> npt.NDArray[np.float64]:
    """Read a table of poses as a path for a hand or a clamp. Columns are found by their names, in any order.

    Parameters
    ----------
    path : path
        A table with a header that has t, x, y, z, qx, qy, qz, qw [s], [m], for example one that `save` of a plan wrote.

    Returns
    -------
    ndarray of shape (n, 8)
        Rows t, x, y, z, qw, qx, qy, qz, as ``simulation.move(hand, path=...)`` expects them: the scalar first.

    Raises
    ------
    ValueError
        A column is missing, or has values that are not numbers.
    OSError
        The file cannot be read.

    Examples
    --------
    >>> from withe import folding, io
    >>> plan = folding.plan(folding.Paper.a4())
    >>> io.load_poses(plan.save("fold.csv")).shape  # doctest: +SKIP
    (251, 8)
    """
    with open(path, encoding="utf-8-sig") as stream:  # spreadsheets begin files with a byte order mark
        names = [name.strip() for name in stream.readline().split(",")]
        missing = [name for name in _POSE_COLUMNS if name not in names]
        if missing:
            raise ValueError(f"{path} must have the columns {', '.join(_POSE_COLUMNS)}, got none named {missing[0]!r}")
        lines = [line for line in stream if line.strip()]
        if not lines:
            raise ValueError(f"{path} must have poses below its header, got none")
        try:
            rows = np.loadtxt(lines, delimiter=",", ndmin=2, usecols=[names.index(name) for name in _POSE_COLUMNS])
        except ValueError as error:
            raise ValueError(f"{path} must hold numbers: {error}") from None
    return pose_path(rows[:, 0], rows[:, 1:])


def pose_path(times: npt.NDArray[np.float64], poses: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Convert poses with the scalar last to rows t, x, y, z, qw, qx, qy, qz for hands, of shape (n, 8)."""
    return np.column_stack([times, poses[:, :3], poses[:, 6], poses[:, 3:6]])


def write_vtk(record: Frames, folder: str | os.PathLike[str]) -> Path:
    """Write a record as a time series for ParaView: one .vtp file per frame, and a .pvd file that lists them.

    Every rod is one polyline. Its points carry radius [m], tension [N] (mean of the two edges at a node), curvature
    (towards d1 and d2) [1/m], twist [rad/m], the first director and the velocity [m/s]. The ends of an open rod have
    the curvature and twist of the nearest inner node. The polyline carries the index of its rod, and the file carries
    the names of the rods. Rigid bodies are surfaces in files of their own, which carry the indices and names of bodies.

    Parameters
    ----------
    record : Record
        Record, or another object with the same read-outs.
    folder : path
        Created if missing; files with the same names are overwritten. The .pvd file is written last: it exists
        there only when every frame is.

    Returns
    -------
    pathlib.Path
        The .pvd file, to be opened in ParaView.

    Raises
    ------
    ValueError
        A record without frames.
    OSError
        The folder cannot be written.
    """
    folder = Path(folder)
    return write_collection(record, folder / "record.pvd", folder)


def write_collection(record: Frames, collection: Path, folder: Path) -> Path:
    """Write a .pvd file, and the frames that it lists into a folder; see `write_vtk`.

    Parameters
    ----------
    record : Record
    collection : pathlib.Path
        File to write, ending in .pvd.
    folder : pathlib.Path
        Folder of the collection, or one in it. Created if missing.

    Returns
    -------
    pathlib.Path
        The .pvd file.

    Raises
    ------
    ValueError
        A record without frames.
    OSError
        The folder cannot be written.
    """
    from xml.sax.saxutils import quoteattr  # imports half of the network, so not with the module

    if len(record) == 0:
        raise ValueError("record has no frames to write")
    folder.mkdir(parents=True, exist_ok=True)
    collection.unlink(missing_ok=True)  # an older one would list frames of two records if writing were cut off
    times = record.times
    digits = max(4, len(str(len(record) - 1)))
    names = [f"frame_{frame:0{digits}d}.vtp" for frame in range(len(record))]
    within = "" if folder == collection.parent else f"{folder.relative_to(collection.parent).as_posix()}/"
    parts: list[tuple[list[str], _Polylines | _Surfaces]] = []
    if record.rods:
        parts.append((names, _Polylines(record)))
    if record.bodies:
        parts.append(([name.replace("frame", "bodies") for name in names], _Surfaces(record)))
    entries = []
    for part, (files, content) in enumerate(parts):
        for frame, name in enumerate(files):
            with written_beside(folder / name) as temporary:
                temporary.write_text(content.document(frame, float(times[frame])), encoding="utf-8")
        entries += [
            f'    <DataSet timestep="{time!r}" group="" part="{part}" file={quoteattr(within + name)}/>'
            for time, name in zip(times.tolist(), files, strict=True)
        ]
    with written_beside(collection) as temporary:
        temporary.write_text(
            '<?xml version="1.0"?>\n'
            '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
            "  <Collection>\n" + "\n".join(entries) + "\n  </Collection>\n</VTKFile>\n",
            encoding="utf-8",
        )
    return collection


class _Polylines:
    """The frames of a record as VTK PolyData documents."""

    def __init__(self, record: Frames) -> None:
        rods = record.rods
        self._rods = rods
        positions, velocities = record.positions(), record.velocities()
        self._positions = [positions[:, rod.rows] for rod in rods]
        self._point_data: dict[str, list[npt.NDArray[np.float64]]] = {
            "radius": [],
            "tension": [],
            "curvature": [],
            "twist": [],
            "d1": [],
            "velocity": [velocities[:, rod.rows] for rod in rods],
        }
        frames = len(record)
        for rod in rods:
            radii = np.broadcast_to(rod.radii, (frames, len(rod.radii)))
            directors = edges_to_nodes(record.directors(rod)[:, :, 0], rod.closed)
            directors /= np.maximum(np.linalg.norm(directors, axis=-1, keepdims=True), 1e-300)
            self._point_data["radius"].append(edges_to_nodes(radii, rod.closed))
            self._point_data["tension"].append(edges_to_nodes(record.tensions(rod), rod.closed))
            self._point_data["curvature"].append(stencils_to_nodes(record.curvatures(rod), rod.closed))
            self._point_data["twist"].append(stencils_to_nodes(record.twists(rod), rod.closed))
            self._point_data["d1"].append(directors)

        counts = np.array([len(rod.rows) for rod in rods])
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        chains = [
            np.append(start + np.arange(count), start) if rod.closed else start + np.arange(count)
            for rod, start, count in zip(rods, starts, counts, strict=True)
        ]
        self._point_count = int(counts.sum())
        self._lines = _data_array("connectivity", np.concatenate(chains)) + _data_array(
            "offsets", np.cumsum([len(chain) for chain in chains])
        )
        self._cell_data = _data_array("rod", np.arange(len(rods)))

    def document(self, frame: int, time: float) -> str:
        """One frame as the text of a .vtp file."""
        points = np.concatenate([positions[frame] for positions in self._positions])
        point_data = "".join(
            _data_array(name, np.concatenate([values[frame] for values in per_rod]))
            for name, per_rod in self._point_data.items()
        )
        names = _string_array("rod_names", [rod.name for rod in self._rods])
        return (
            '<?xml version="1.0"?>\n'
            '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
            "<PolyData>\n"
            f"<FieldData>\n{_data_array('TimeValue', np.array([time]), field=True)}{names}</FieldData>\n"
            f'<Piece NumberOfPoints="{self._point_count}" NumberOfVerts="0" '
            f'NumberOfLines="{len(self._rods)}" NumberOfStrips="0" NumberOfPolys="0">\n'
            f"<Points>\n{_data_array('points', points)}</Points>\n"
            f"<Lines>\n{self._lines}</Lines>\n"
            f'<PointData Scalars="curvature">\n{point_data}</PointData>\n'
            f"<CellData>\n{self._cell_data}</CellData>\n"
            "</Piece>\n</PolyData>\n</VTKFile>\n"
        )


class _Surfaces:
    """The rigid bodies of a record, frame by frame, as VTK PolyData documents."""

    def __init__(self, record: Frames) -> None:
        bodies = record.bodies
        self._names = [body.name for body in bodies]
        self._points = [body.placed(record.body_position(body), record.body_rotation(body)) for body in bodies]
        starts = np.cumsum([0, *(len(body.vertices) for body in bodies)])
        triangles = np.concatenate([body.triangles + start for body, start in zip(bodies, starts, strict=False)])
        counts = [len(body.triangles) for body in bodies]
        self._counts = f'NumberOfPoints="{starts[-1]}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0"'
        self._counts += f' NumberOfPolys="{len(triangles)}"'
        self._polygons = _data_array("connectivity", triangles.ravel())
        self._polygons += _data_array("offsets", 3 * np.arange(1, len(triangles) + 1))
        self._cell_data = _data_array("body", np.repeat(np.arange(len(bodies)), counts))

    def document(self, frame: int, time: float) -> str:
        """One frame as the text of a .vtp file."""
        points = np.concatenate([points[frame] for points in self._points])
        names = _string_array("body_names", self._names)
        return (
            '<?xml version="1.0"?>\n'
            '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
            "<PolyData>\n"
            f"<FieldData>\n{_data_array('TimeValue', np.array([time]), field=True)}{names}</FieldData>\n"
            f"<Piece {self._counts}>\n"
            f"<Points>\n{_data_array('points', points)}</Points>\n"
            f"<Polys>\n{self._polygons}</Polys>\n"
            f'<CellData Scalars="body">\n{self._cell_data}</CellData>\n'
            "</Piece>\n</PolyData>\n</VTKFile>\n"
        )


def _data_array(name: str, values: npt.NDArray[Any], field: bool = False) -> str:
    kind, values = ("Int64", values.astype("<i8")) if values.dtype.kind in "iu" else ("Float64", values.astype("<f8"))
    components = 1 if values.ndim == 1 else values.shape[1]
    size = f' NumberOfTuples="{len(values)}"' if field else f' NumberOfComponents="{components}"'
    return f'<DataArray type="{kind}" Name="{name}"{size} format="binary">{_base64(values.tobytes())}</DataArray>\n'


def _string_array(name: str, words: list[str]) -> str:
    """Strings as VTK keeps them: bytes, each word ended by a zero, in decimal."""
    data = b"".join(word.encode() + b"\0" for word in words)
    numbers = " ".join(str(byte) for byte in data)
    return f'<Array type="String" Name="{name}" NumberOfTuples="{len(words)}" format="ascii">{numbers}</Array>\n'


def _base64(data: bytes) -> str:
    return base64.b64encode(np.uint64(len(data)).astype("<u8").tobytes() + data).decode("ascii")
