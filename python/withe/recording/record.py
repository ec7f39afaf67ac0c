"""Records: the read-outs of a simulation, frame by frame.

A `Record` has the same read-outs as a `Simulation`, with one more axis in front: the frames. It holds NumPy arrays
only, so it can be pickled and saved to one file, and reading it needs no engine.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from withe import io, view
from withe.common import validation
from withe.common.frames import ENERGIES, EnergyHistory
from withe.common.outlines import (
    BodyOutline,
    Named,
    ObstacleOutline,
    RodOutline,
    SpringOutline,
    TendonOutline,
    index_of,
)
from withe.export import export

__all__ = ["ROD_READOUTS", "EnergyHistory", "Record", "RunGradient"]

FloatArray = npt.NDArray[np.float64]

_FILE_VERSION = 1
_SURFACE = ("vertices", "triangles")
_UNITS = {
    "times": "s",
    "positions": "m",
    "velocities": "m/s",
    "directors": "1",
    "curvatures": "1/m",
    "twists": "rad/m",
    "tensions": "N",
    "spins": "rad/s",
    "energy": "J",
    "radii": "m",
}
_OTHER_FORMATS = "use export for other programs: .csv, .glb, .pvd, .usda"
ROD_READOUTS = ("directors", "curvatures", "twists", "tensions", "spins")


class RunGradient(Protocol):
    """Gradients of a differentiable run."""

    def gradient(self, by: Mapping[str, Any], wrt: Sequence[Any], /) -> list[Any]:
        """See `Record.gradient`."""


class Record:
    """Frames of a run, made by `Simulation.run` or read with `Record.load`.

    Methods and properties by purpose:

    * read the scene: `times`, `rods`, `bodies`, `obstacles`, `springs`, `tendons`, `energy`, `keys`, `units`
    * read rods: `positions`, `velocities`, `directors`, `spins`, `curvatures`, `twists`, `tensions`
    * read parts: `body_position`, `body_rotation`, `obstacle_position`
    * read pictures: `plot`, `view`, `picture`, `animate`
    * files: `save`, `load`, `export`, `to_vtk`
    * differentiate: `gradient`

    Arrays that methods return are copies, with the frame as first axis. Rods, bodies and obstacles are
    given by handle or by name.

    See Also
    --------
    Simulation.run : Run a simulation and record its frames.
    withe.view.animate : Render a record into a film.
    BatchRecord : Records of a batch.

    Examples
    --------
    >>> record = simulation.run(duration=2.0, record_every=0.02)
    >>> tip = record.positions("arm")[:, -1]
    >>> tip.shape
    (101, 3)
    """

    def __init__(
        self,
        rods: Iterable[RodOutline],
        arrays: Mapping[str, npt.NDArray[Any]],
        extras: Iterable[str] = (),
        obstacles: Iterable[ObstacleOutline] = (),
        springs: Iterable[SpringOutline] = (),
        tendons: Iterable[TendonOutline] = (),
        derivatives: RunGradient | None = None,
        bodies: Iterable[BodyOutline] = (),
    ) -> None:
        self._derivatives = derivatives
        self._rods = tuple(rods)
        self._springs = tuple(springs)
        self._tendons = tuple(tendons)
        self._bodies = tuple(bodies)
        self._obstacles = tuple(obstacles)
        self._arrays = dict(arrays)
        self._extras = tuple(extras)
        self._check()

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_derivatives": None}

    def gradient(self, by: Mapping[str, Any], wrt: Sequence[Any]) -> list[Any]:
        """Return derivatives of a scalar L of this run, by the adjoint method.

        The cost is one pass backwards through the steps, for any number of parameters.

        Parameters
        ----------
        by : mapping
            Derivatives of L by read-outs, each shaped like the read-out of the record:

            * "positions" [1/m] and "velocities" [s/m], of shape (frames, nodes, 3), or by rods
            * "directors", "curvatures", "twists", "tensions", "spins" of rods
            * "reaction_forces" [1/N] and "reaction_moments" [1/(N m)] of supports and hands, of shape (frames, 3), for
              `Simulation.reaction` and `Simulation.wrench` at each frame after the first

            For example ``{"positions": dL_dx, "curvatures": {arm: dL_dk}}``.
        wrt : sequence
            Parameters, as in `Equilibrium.gradient`. Runs also have

            * "initial_positions" and "initial_velocities", of shape (nodes, 3); directors turn with their edges
            * "viscosity" of a resistive fluid
            * "friction" of an obstacle, or of a pair: ``((arm, floor), "friction")``
            * "friction" between rods, and "slip_tolerance"

            The values "position" and "rotation" of a support and "position" of an obstacle displace it during the whole
            run, with the same initial state of all free nodes. The value "points" of a rod needs a run that begins in
            the drawn state. The sequence may be empty if only ``calls`` are of interest.

        Returns
        -------
        list
            Derivative of L by the initial value of each item of `wrt`, shaped like `Simulation.get`. The attribute
            ``calls`` has the derivatives by values that were set during the run: one entry per call of `set` and
            `move`, in order. An entry has ``time`` [s], ``call``, ``target``, ``over`` and ``gradients``, a dict from
            parameters to derivatives, shaped like the value that was set. For a ramp, the value is its end; for a
            rotation, a rotation vector; a discrete_curvature is under natural_curvature, by the smooth one.

        Raises
        ------
        ValueError
            A run without ``differentiable=True``. A run without a gradient, with the reason (contact without a given
            stiffness, anchored friction, restitution below 1, Stokeslets, integrator "verlet"). A wrong shape, a
            derivative out of the plane of a planar scene, or a friction of 0.

        See Also
        --------
        Simulation.run : Run with ``differentiable=True``.
        Equilibrium.gradient : Derivatives of an equilibrium.
        withe.learning.rollout : A run as a function of torch.

        Notes
        -----
        The gradient is the exact derivative of the computed steps, subdivision included. With the midpoint rules, calls
        of `move` have no gradient of reaction moments. Records from files, and unpickled ones, have no gradient.
        """
        if self._derivatives is None:
            raise ValueError(
                "this record has no gradient: run with differentiable=True, and compute gradients before the record is "
                "saved"
            )
        return self._derivatives.gradient(by, wrt)

    def _check(self) -> None:
        """Refuse arrays that do not fit together."""
        frames = len(self._array("times", ()))
        positions = self._array("positions", (frames, None, 3))
        nodes = positions.shape[1]
        self._array("velocities", (frames, nodes, 3))
        for index, rod in enumerate(self._rods):
            if rod.rows.ndim != 1 or rod.rows.dtype.kind != "i" or len(rod.rows) < 2:
                raise ValueError(f"rows of rod {rod.name!r} must be two or more integers")
            if rod.rows.min() < 0 or rod.rows.max() >= nodes:
                raise ValueError(f"rows of rod {rod.name!r} must lie in 0..{nodes - 1}")
            for name, values, shape in (
                ("radii", rod.radii, (rod.edges,)),
                ("widths", rod.widths, (rod.edges, 2)),
            ):
                if values is not None and (values.shape != shape or values.dtype.kind != "f"):
                    raise ValueError(
                        f"{name} of rod {rod.name!r} must be floats of shape {shape}, "
                        f"got {values.dtype} of shape {values.shape}"
                    )
            self._array(f"rod_{index}_directors", (frames, rod.edges, 3, 3))
            self._array(f"rod_{index}_curvatures", (frames, rod.stencils, 2))
            self._array(f"rod_{index}_twists", (frames, rod.stencils))
            self._array(f"rod_{index}_tensions", (frames, rod.edges))
            if f"rod_{index}_spins" in self._arrays:  # missing in old files
                self._array(f"rod_{index}_spins", (frames, rod.edges))
        for index, body in enumerate(self._bodies):
            _check_surface(body)
            self._array(f"body_{index}_position", (frames, 3))
            self._array(f"body_{index}_rotation", (frames, 3, 3))
        for index, obstacle in enumerate(self._obstacles):
            self._array(f"obstacle_{index}_place", (frames, 3))
            if obstacle.kind == "shape":
                _check_surface(obstacle)
            elif obstacle.kind not in ("plane", "capsule") or obstacle.axis.shape != (3,) or not obstacle.radius >= 0.0:
                raise ValueError(f"obstacle {obstacle.name!r} must be a plane or a capsule with an axis and a radius")
        for spring in self._springs:
            if len(spring.rows) != 2 or not all(0 <= row < nodes for row in spring.rows):
                raise ValueError(f"rows of spring {spring.name!r} must be two in 0..{nodes - 1}")
        for tendon in self._tendons:
            on_rods = all(
                (rod == -1 and 0 <= edge < nodes)
                or (0 <= rod < len(self._rods) and 0 <= edge < self._rods[rod].edges and 0.0 <= share <= 1.0)
                for rod, edge, share in tendon.guides
            )
            if len(tendon.guides) < 2 or not on_rods or tendon.offsets.shape != (len(tendon.guides), 2):
                raise ValueError(f"tendon {tendon.name!r} must have guides on edges, and an offset for each")
        for name in ENERGIES:
            self._array(f"energy_{name}", (frames,))
        for index, name in enumerate(self._extras):
            values = self._arrays.get(f"extra_{index}")
            if values is None or values.shape[:1] != (frames,):
                raise ValueError(f"record[{name!r}] must have one row for each of {frames} frames")

    def _array(self, name: str, shape: tuple[int | None, ...]) -> npt.NDArray[Any]:
        values = self._arrays.get(name)
        if values is None:
            raise ValueError(f"array {name!r} is missing")
        if (shape and len(shape) != values.ndim) or (not shape and values.ndim != 1):
            raise ValueError(f"array {name!r} has shape {values.shape}")
        if any(want not in (None, got) for want, got in zip(shape, values.shape, strict=False)):
            raise ValueError(f"array {name!r} must have shape {shape}, got {values.shape}")
        if values.dtype != np.float64:
            raise ValueError(f"array {name!r} must hold floats, got {values.dtype}")
        return values

    # Read-outs

    @property
    def times(self) -> FloatArray:
        """Return the times of the frames, shape (frames,) [s]."""
        return self._arrays["times"].copy()

    @property
    def rods(self) -> tuple[RodOutline, ...]:
        """Return the rods, in the order of the scene."""
        return self._rods

    @property
    def bodies(self) -> tuple[BodyOutline, ...]:
        """Rigid bodies, in the order of the scene."""
        return self._bodies

    @property
    def obstacles(self) -> tuple[ObstacleOutline, ...]:
        """Planes, spheres and capsules, in the order of the scene."""
        return self._obstacles

    @property
    def springs(self) -> tuple[SpringOutline, ...]:
        """Springs between nodes, in the order of the scene."""
        return self._springs

    @property
    def tendons(self) -> tuple[TendonOutline, ...]:
        """Tendons through guides on rods, in the order of the scene."""
        return self._tendons

    @property
    def units(self) -> dict[str, str]:
        """Units of the read-outs, by name."""
        return dict(_UNITS)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self._arrays["times"])

    def positions(self, rod: Named | None = None) -> FloatArray:
        """Return the positions of the nodes of a rod, or of all nodes of the scene.

        Parameters
        ----------
        rod : Rod, RodOutline or str, optional
            Rod to read. By default every node of the scene.

        Returns
        -------
        ndarray of shape (frames, nodes, 3) [m]

        Raises
        ------
        ValueError
            No rod of that name.

        See Also
        --------
        times : Times of the frames.
        velocities : Velocities of the same nodes.
        """
        return self._nodal("positions", rod)

    def body_position(self, body: Named) -> FloatArray:
        """Return the positions of the origin of a rigid body's axes.

        Parameters
        ----------
        body : Body, BodyOutline or str
            Body to read.

        Returns
        -------
        ndarray of shape (frames, 3) [m]

        Raises
        ------
        ValueError
            No body of that name.

        See Also
        --------
        body_rotation : Orientations of a body.
        Simulation.position : Position of a body at one moment.
        """
        return self._of_body("position", body)

    def body_rotation(self, body: Named) -> FloatArray:
        """Return the orientations of a rigid body: its axes as the columns of matrices.

        Parameters
        ----------
        body : Body, BodyOutline or str
            Body to read.

        Returns
        -------
        ndarray of shape (frames, 3, 3)

        Raises
        ------
        ValueError
            No body of that name.

        See Also
        --------
        body_position : Positions of a body.
        Simulation.rotation : Orientation of a body at one moment.
        """
        return self._of_body("rotation", body)

    def obstacle_position(self, obstacle: Named) -> FloatArray:
        """Return the positions of an obstacle.

        This is the point of a plane, the centre of a sphere, or the start of a capsule.

        Parameters
        ----------
        obstacle : Obstacle, ObstacleOutline or str
            Obstacle to read.

        Returns
        -------
        ndarray of shape (frames, 3) [m]

        Raises
        ------
        ValueError
            No obstacle of that name.
        """
        index = index_of(self._obstacles, obstacle, "obstacle")
        return self._arrays[f"obstacle_{index}_place"].copy()

    def velocities(self, rod: Named | None = None) -> FloatArray:
        """Return the velocities of the nodes of a rod, or of all nodes of the scene.

        Parameters
        ----------
        rod : Rod, RodOutline or str, optional
            Rod to read. By default every node of the scene.

        Returns
        -------
        ndarray of shape (frames, nodes, 3) [m/s]

        Raises
        ------
        ValueError
            No rod of that name.
        """
        return self._nodal("velocities", rod)

    def directors(self, rod: Named) -> FloatArray:
        """Return the material frames of the edges of a rod.

        Parameters
        ----------
        rod : Rod, RodOutline or str
            Rod to read.

        Returns
        -------
        ndarray of shape (frames, edges, 3, 3)
            The rows of each frame are the unit vectors d1, d2 and the tangent.

        Raises
        ------
        ValueError
            No rod of that name.
        """
        return self._of_rod("directors", rod)

    def curvatures(self, rod: Named) -> FloatArray:
        """Return the curvatures of a rod towards its directors d1 and d2.

        Parameters
        ----------
        rod : Rod, RodOutline or str
            Rod to read.

        Returns
        -------
        ndarray of shape (frames, stencils, 2) [1/m]

        Raises
        ------
        ValueError
            No rod of that name.
        """
        return self._of_rod("curvatures", rod)

    def twists(self, rod: Named) -> FloatArray:
        """Return the twists per length of a rod.

        Parameters
        ----------
        rod : Rod, RodOutline or str
            Rod to read.

        Returns
        -------
        ndarray of shape (frames, stencils) [rad/m]

        Raises
        ------
        ValueError
            No rod of that name.
        """
        return self._of_rod("twists", rod)

    def tensions(self, rod: Named) -> FloatArray:
        """Return the tension of each edge of a rod. See `Simulation.tensions`.

        Parameters
        ----------
        rod : Rod, RodOutline or str
            Rod to read.

        Returns
        -------
        ndarray of shape (frames, edges) [N]

        Raises
        ------
        ValueError
            No rod of that name.
        """
        return self._of_rod("tensions", rod)

    def spins(self, rod: Named) -> FloatArray:
        """Return the angular velocities of the edges of a rod about their tangents.

        Parameters
        ----------
        rod : Rod, RodOutline or str
            Rod to read.

        Returns
        -------
        ndarray of shape (frames, edges) [rad/s]

        Raises
        ------
        ValueError
            A record from a file that was written before spins were recorded.
        """
        if f"rod_{self._index(rod)}_spins" not in self._arrays:
            raise ValueError("record holds no spins, because its file was written by an older version")
        return self._of_rod("spins", rod)

    def energy(self) -> EnergyHistory:
        """Return the energies of every frame.

        Returns
        -------
        EnergyHistory
            Each field is an array of shape (frames,) [J].

        See Also
        --------
        Simulation.energy : Energies at one moment.
        """
        return EnergyHistory(*(self._arrays[f"energy_{name}"].copy() for name in ENERGIES))

    def keys(self) -> tuple[str, ...]:
        """Return the names of the quantities that ``run(record=)`` added.

        Returns
        -------
        tuple of str
        """
        return self._extras

    def __iter__(self) -> Iterator[str]:
        return iter(self._extras)

    def __contains__(self, name: object) -> bool:
        return name in self._extras

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """Return a quantity of ``run(record={name: ...})``, one row per frame.

        Raises
        ------
        KeyError
            The record has no quantity of this name.
        """
        if name not in self._extras:
            known = ", ".join(map(repr, self._extras)) or "nothing"
            raise KeyError(f"record has no quantity {name!r}; it has {known}")
        return self._arrays[f"extra_{self._extras.index(name)}"].copy()

    def _nodal(self, name: str, rod: Named | None) -> FloatArray:
        values = self._arrays[name]
        return values.copy() if rod is None else values[:, self._rods[self._index(rod)].rows]

    def _of_rod(self, name: str, rod: Named) -> FloatArray:
        return self._arrays[f"rod_{self._index(rod)}_{name}"].copy()

    def _of_body(self, name: str, body: Named) -> FloatArray:
        return self._arrays[f"body_{index_of(self._bodies, body, 'body')}_{name}"].copy()

    def _index(self, rod: Named) -> int:
        return index_of(self._rods, rod, "rod")

    def __repr__(self) -> str:
        kinds = {"rods": [rod.name for rod in self._rods], "bodies": [body.name for body in self._bodies]}
        parts = "; ".join(f"{kind} {', '.join(names)}" for kind, names in kinds.items() if names)
        if len(self) == 0:
            return f"Record(no frames; {parts})"
        first, last = self._arrays["times"][[0, -1]]
        return f"Record({len(self)} frames, {first:g}..{last:g} s; {parts})"

    # Files

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the record to one .npz file, which NumPy can read.

        Use `export` for tables and for other programs. To choose the columns of a table, use NumPy, for example
        ``numpy.savetxt("tip.csv", numpy.column_stack([record.times, record.positions("arm")[:, -1]]), delimiter=",")``.

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
        export : Write files for other programs.
        to_vtk : Write files for ParaView.
        """
        path = validation.file_path(path, ".npz", instead=_OTHER_FORMATS)
        header = {
            "units": _UNITS,
            "rods": [{"name": rod.name, "closed": rod.closed} for rod in self._rods],
            "extras": list(self._extras),
            "bodies": [{"name": each.name} for each in self._bodies],
            "obstacles": [
                {"name": each.name, "kind": each.kind, "axis": each.axis.tolist(), "radius": each.radius}
                for each in self._obstacles
            ],
            "springs": [{"name": each.name, "rows": list(each.rows)} for each in self._springs],
            "tendons": [
                {"name": each.name, "guides": [list(guide) for guide in each.guides], "offsets": each.offsets.tolist()}
                for each in self._tendons
            ],
        }
        arrays = dict(self._arrays)
        for index, rod in enumerate(self._rods):
            arrays[f"rod_{index}_rows"] = rod.rows
            arrays[f"rod_{index}_radii"] = rod.radii
            if rod.widths is not None:
                arrays[f"rod_{index}_widths"] = rod.widths
        for index, body in enumerate(self._bodies):
            arrays[f"body_{index}_vertices"] = body.vertices
            arrays[f"body_{index}_triangles"] = body.triangles
        for index, obstacle in enumerate(self._obstacles):
            if obstacle.kind == "shape":
                arrays[f"obstacle_{index}_vertices"] = obstacle.vertices
                arrays[f"obstacle_{index}_triangles"] = obstacle.triangles
        return io.save_arrays(path, "record", _FILE_VERSION, header, arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Record:
        """Read a record that `save` wrote.

        Parameters
        ----------
        path : str or path
            File to read.

        Returns
        -------
        Record

        Raises
        ------
        ValueError
            A file that is damaged, not a record, or of another version.
        OSError
            The file cannot be opened.

        See Also
        --------
        save : Write a record.
        """
        header, arrays = io.load_arrays(path, "record", _FILE_VERSION)
        try:
            rods = [
                RodOutline(
                    name=str(rod["name"]),
                    rows=arrays.pop(f"rod_{index}_rows"),
                    closed=bool(rod["closed"]),
                    radii=arrays.pop(f"rod_{index}_radii"),
                    widths=arrays.pop(f"rod_{index}_widths", None),
                )
                for index, rod in enumerate(header["rods"])
            ]
            obstacles = [
                ObstacleOutline(
                    str(each["name"]),
                    str(each["kind"]),
                    np.array(each["axis"], float),
                    float(each["radius"]),
                    *(arrays.pop(f"obstacle_{i}_{part}") for part in _SURFACE if each["kind"] == "shape"),
                )
                for i, each in enumerate(header.get("obstacles", []))  # missing in old files
            ]
            springs = [
                SpringOutline(str(each["name"]), (int(each["rows"][0]), int(each["rows"][1])))
                for each in header.get("springs", [])
            ]
            tendons = [
                TendonOutline(
                    str(each["name"]),
                    tuple((int(rod), int(edge), float(share)) for rod, edge, share in each["guides"]),
                    np.array(each["offsets"], float),
                )
                for each in header.get("tendons", [])
            ]
            bodies = [
                BodyOutline(
                    str(each["name"]), arrays.pop(f"body_{index}_vertices"), arrays.pop(f"body_{index}_triangles")
                )
                for index, each in enumerate(header.get("bodies", []))
            ]
            if "energy_spring" not in arrays:  # absent in files older than springs
                arrays["energy_spring"] = np.zeros(len(arrays["times"]))
            extras = [str(name) for name in header["extras"]]
            return cls(rods, arrays, extras, obstacles, springs, tendons, bodies=bodies)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise ValueError(f"{path} is a damaged record: {error}") from error

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Write the motion for another program, in the format of the suffix.

        * ``.glb``: animated binary glTF 2.0, for programs such as Blender, three.js and the viewers of Windows
        * ``.usda`` or ``.usdc``: USD stage, as text or binary, for programs such as Omniverse and Blender
        * ``.pvd``: VTK collection for ParaView; the frames are in a folder of the same name
        * ``.csv``: table with one row per frame and node, and per frame and body

        Parameters
        ----------
        path : path
            File to write.

        Returns
        -------
        pathlib.Path
            The written file.

        Raises
        ------
        ValueError
            Another suffix, or a record without frames.
        ImportError
            A USD file, and usd-core is not installed: install the extra "export".
        OSError
            The file cannot be written.

        Notes
        -----
        * glTF: each rod is a skinned mesh with one joint per node, which moves and turns over time. Round rods are
          tubes with the radii of their edges, and rectangular ones are boxes. Each rigid body is a node
          with a mesh, which moves and turns. Obstacles are meshes. Colours are those of `picture`. Lengths are in
          metres. The root node turns the z axis up, because glTF has y up. The film begins at time 0.
        * USD: each rod is a cubic curve (BasisCurves) through its nodes, with widths, and velocities for motion blur. A
          rectangular rod is a ribbon. A rigid body is a mesh with a translation and an orientation. Lengths are in
          metres (metersPerUnit 1), and z is up. The time code of a frame is its time multiplied by
          timeCodesPerSecond.
        * VTK: see `to_vtk`.
        * Table: columns have their units in the header. A tension is the mean of both edges of a node. Cells of
          curvature and twist are empty at the ends of open rods. A row of a body has its name, the position of its
          origin and a unit quaternion (w, x, y, z).

        Files for glTF and USD have no springs and tendons, and no obstacles that are far away or much larger than the
        rods. If the time does not advance, as in a sequence of equilibria, frames are 1/30 s apart there.

        References
        ----------
        Khronos Group 2021, glTF 2.0 Specification; Pixar, UsdGeomBasisCurves.

        Examples
        --------
        >>> record.export("motion.glb")  # doctest: +SKIP
        """
        return export(self, path)

    def to_vtk(self, folder: str | os.PathLike[str]) -> Path:
        """Write the frames for ParaView; open the .pvd file whose path is returned.

        ``export("run.pvd")`` writes the same files with another name. See `withe.io.write_vtk` for their content.

        Parameters
        ----------
        folder : str or path
            Folder for the files. It is made if it does not exist.

        Returns
        -------
        pathlib.Path
            Path of the .pvd file.

        Raises
        ------
        ValueError
            A path with the suffix of a file.
        OSError
            The files cannot be written.

        See Also
        --------
        export : Write files for other programs.
        save : Write one file that `load` reads.
        """
        return io.write_vtk(self, folder)

    # Pictures

    def plot(self, **options: Any) -> Any:
        """Plot shapes at several times and energies over time, as a matplotlib figure.

        See `withe.view.plot` for the options.

        Parameters
        ----------
        **options
            Options of `withe.view.plot`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ValueError
            An option out of range.
        ImportError
            matplotlib is not installed.

        See Also
        --------
        withe.view.plot : All options.
        """
        return view.plot(self, **options)

    def view(self, **options: Any) -> Any:
        """Show the rods in a notebook or a window, with controls for the view and the time.

        See `withe.view.view` for the options.

        Parameters
        ----------
        **options
            Options of `withe.view.view`.

        Returns
        -------
        object
            The widget in a notebook, else the window, as `withe.view.view` returns it.

        Raises
        ------
        RuntimeError
            There is no display, or no graphics library.
        ImportError
            PyVista is not installed.

        See Also
        --------
        withe.view.view : All options, and what they raise.
        """
        return view.view(self, **options)

    def animate(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Render the rods as tubes into a film, .mp4 or .gif.

        See `withe.view.animate` for the options.

        Parameters
        ----------
        path : str or path
            File to write, with the suffix .mp4 or .gif.
        **options
            Options of `withe.view.animate`.

        Returns
        -------
        pathlib.Path
            Path of the film.

        Raises
        ------
        ValueError
            An option out of range, or a path with another suffix.
        ImportError
            PyVista or imageio-ffmpeg is not installed.
        OSError
            The film cannot be written.

        See Also
        --------
        withe.view.animate : All options.
        picture : Render one frame.
        """
        return view.animate(self, path, **options)

    def picture(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Render one frame into a .png file, by default the last one.

        See `withe.view.picture` for the options.

        Parameters
        ----------
        path : str or path
            File to write, with the suffix .png.
        **options
            Options of `withe.view.picture`.

        Returns
        -------
        pathlib.Path
            Path of the picture.

        Raises
        ------
        ValueError
            An option out of range, or a path with another suffix.
        ImportError
            PyVista is not installed.
        OSError
            The picture cannot be written.

        See Also
        --------
        withe.view.picture : All options, and what they raise.
        animate : Render a film.
        """
        return view.picture(self, path, **options)


def _check_surface(part: BodyOutline | ObstacleOutline) -> None:
    """Refuse a surface whose arrays do not fit together."""
    vertices, triangles = part.vertices, part.triangles
    owner = f"{'body' if isinstance(part, BodyOutline) else 'obstacle'} {part.name!r}"
    if vertices.ndim != 2 or vertices.shape[1] != 3 or vertices.dtype != np.float64 or not len(vertices):
        raise ValueError(f"vertices of {owner} must be floats of shape (n, 3)")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind != "i" or not len(triangles):
        raise ValueError(f"triangles of {owner} must be integers of shape (n, 3)")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise ValueError(f"triangles of {owner} must lie in 0..{len(vertices) - 1}")
