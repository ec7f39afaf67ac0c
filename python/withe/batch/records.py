"""Records and equilibria of batches, with one more axis in front of the arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from withe.errors import ConvergenceError
from withe.parts.handles import Body, Rod
from withe.recording.record import Record
from withe.simulation.readouts import Equilibrium

__all__ = ["BatchRecord", "Equilibria"]

FloatArray = npt.NDArray[np.float64]


class BatchRecord(Sequence[Record]):
    """The frames of a run of a batch, made by `Batch.run`: a `Record` of each simulation.

    In read-outs, the first axis is the simulation and the second axis is the frame. A string names a quantity of
    ``record=`` of the run. Read-outs need equal numbers of frames. If a simulation failed or ended early, read the
    records one by one, ``run[3]``.

    Parameters
    ----------
    records : sequence of Record
        One record per simulation, of the same scene.

    See Also
    --------
    Batch.run : Run a batch.
    Record : Frames of one simulation.

    Examples
    --------
    >>> run = scene.build_batch(3, time_step=5e-3).run(0.1, record_every=0.02, progress=False)
    >>> run.positions(arm).shape
    (3, 6, 31, 3)
    >>> run[2].positions(arm).shape
    (6, 31, 3)
    """

    def __init__(self, records: Sequence[Record]) -> None:
        self._records = tuple(records)

    def __len__(self) -> int:
        return len(self._records)

    @overload
    def __getitem__(self, which: int) -> Record: ...

    @overload
    def __getitem__(self, which: slice) -> BatchRecord: ...

    @overload
    def __getitem__(self, which: str) -> npt.NDArray[Any]: ...

    def __getitem__(self, which: int | slice | str) -> Record | BatchRecord | npt.NDArray[Any]:
        """Return the record of a simulation, or all values of a name, shape (n, frames, ...)."""
        if isinstance(which, str):
            return self._stacked([record[which] for record in self._records])
        if isinstance(which, slice):
            return BatchRecord(self._records[which])
        return self._records[which]

    def __iter__(self) -> Iterator[Record]:
        return iter(self._records)

    def __repr__(self) -> str:
        return f"BatchRecord({len(self)} records of {len(self._records[0])} frames)"

    @property
    def times(self) -> FloatArray:
        """Times of the frames, shape (n, frames) [s]."""
        return self._stacked([record.times for record in self._records])

    def positions(self, rod: Rod | str | None = None) -> FloatArray:
        """Return the positions of the nodes of a rod, or of all nodes.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default every node of the scene.

        Returns
        -------
        ndarray of shape (n, frames, nodes, 3) [m]

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no rod of that name.
        """
        return self._stacked([record.positions(rod) for record in self._records])

    def velocities(self, rod: Rod | str | None = None) -> FloatArray:
        """Return the velocities of the nodes of a rod, or of all nodes.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default every node of the scene.

        Returns
        -------
        ndarray of shape (n, frames, nodes, 3) [m/s]

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no rod of that name.
        """
        return self._stacked([record.velocities(rod) for record in self._records])

    def directors(self, rod: Rod | str) -> FloatArray:
        """Return the material frames of the edges of a rod.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (n, frames, edges, 3, 3)
            The rows of each frame are the unit vectors d1, d2 and the tangent.

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no rod of that name.
        """
        return self._stacked([record.directors(rod) for record in self._records])

    def curvatures(self, rod: Rod | str) -> FloatArray:
        """Return the curvatures of a rod towards its directors d1 and d2.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (n, frames, stencils, 2) [1/m]

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no rod of that name.
        """
        return self._stacked([record.curvatures(rod) for record in self._records])

    def twists(self, rod: Rod | str) -> FloatArray:
        """Return the twists per length of a rod.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (n, frames, stencils) [rad/m]

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no rod of that name.
        """
        return self._stacked([record.twists(rod) for record in self._records])

    def tensions(self, rod: Rod | str) -> FloatArray:
        """Return the tension of each edge of a rod.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (n, frames, edges) [N]

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no rod of that name.
        """
        return self._stacked([record.tensions(rod) for record in self._records])

    def spins(self, rod: Rod | str) -> FloatArray:
        """Return the angular velocities of the edges of a rod about their tangents.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (n, frames, edges) [rad/s]

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no rod of that name.
        """
        return self._stacked([record.spins(rod) for record in self._records])

    def body_position(self, body: Body | str) -> FloatArray:
        """Return the positions of the origin of the axes of a rigid body.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (n, frames, 3) [m]

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no body of that name.
        """
        return self._stacked([record.body_position(body) for record in self._records])

    def body_rotation(self, body: Body | str) -> FloatArray:
        """Return the axes, as columns of matrices, of a rigid body.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (n, frames, 3, 3)

        Raises
        ------
        ValueError
            Records with different numbers of frames, or no body of that name.
        """
        return self._stacked([record.body_rotation(body) for record in self._records])

    def _stacked(self, arrays: list[Any]) -> npt.NDArray[Any]:
        frames = [len(record) for record in self._records]
        if len(set(frames)) > 1:
            raise ValueError(
                f"records must have equally many frames to be one array, got {min(frames)} to {max(frames)}: read them "
                "one by one, such as run[0]"
            )
        return np.stack(arrays)


@dataclass(frozen=True, eq=False)
class Equilibria(Sequence[Equilibrium]):
    """Equilibria of the simulations of a batch, made by `Batch.equilibrium`; ``equilibria[i]`` is one of them.

    Attributes
    ----------
    failures : tuple of ConvergenceError or None
        Error of each simulation without an equilibrium, which keeps its previous state.

    See Also
    --------
    Batch.equilibrium : Find the equilibria of a batch.
    """

    failures: tuple[ConvergenceError | None, ...]
    _found: tuple[Equilibrium | None, ...] = field(repr=False)

    @property
    def stable(self) -> npt.NDArray[np.bool_]:
        """Return True for each stable equilibrium, shape (n,); False if none was found."""
        return np.array([each is not None and each.stable for each in self._found])

    @property
    def branch_changed(self) -> npt.NDArray[np.bool_]:
        """Return True for each equilibrium on another branch than the state before, shape (n,)."""
        return np.array([each is not None and each.branch_changed for each in self._found])

    @property
    def iterations(self) -> npt.NDArray[np.intp]:
        """Iterations of Newton's method, shape (n,); 0 if no equilibrium was found."""
        return np.array([0 if each is None else each.iterations for each in self._found])

    @property
    def residual(self) -> FloatArray:
        """Greatest residual force, shape (n,) [N]; NaN if no equilibrium was found."""
        return np.array([np.nan if each is None else each.residual for each in self._found])

    def __len__(self) -> int:
        return len(self._found)

    @overload
    def __getitem__(self, index: int) -> Equilibrium: ...

    @overload
    def __getitem__(self, index: slice) -> Equilibria: ...

    def __getitem__(self, index: int | slice) -> Equilibrium | Equilibria:
        """Return the equilibrium of a simulation.

        Raises
        ------
        ConvergenceError
            No equilibrium was found for it.
        """
        if isinstance(index, slice):
            return Equilibria(self.failures[index], self._found[index])
        found = self._found[index]
        if found is None:
            failure = self.failures[index]
            assert failure is not None
            raise failure
        return found
