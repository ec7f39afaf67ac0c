"""Read-outs of a batch: those of `Simulation` with one more axis in front."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.batch.lanes import Lanes, output
from withe.parts.handles import Hand, Joint, NodeHandle, Obstacle, Rod, Spring, Support, Tendon
from withe.simulation.readouts import Energy, Momentum, Reaction, RodEnergy, Statistics

__all__ = ["Reading"]

FloatArray = npt.NDArray[np.float64]


class Reading:
    """Methods of `Batch` that read. An argument `out` is an array of the user that is filled and returned."""

    _lanes: Lanes

    @property
    def rods(self) -> tuple[Rod, ...]:
        """Return the handles of all rods, in the order of the scene."""
        return self._lanes.first.rods

    @property
    def time(self) -> FloatArray:
        """Return the time of every simulation since its start, shape (n,) [s]."""
        return _read(self._lanes, "time", -1, (), None)

    def positions(self, rod: Rod | str | None = None, out: FloatArray | None = None) -> FloatArray:
        """Return the positions of the nodes of a rod, or of all nodes of the scene.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default all nodes of the scene.
        out : ndarray of shape (n, nodes, 3), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, nodes, 3) [m]

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.

        Examples
        --------
        >>> batch = scene.build_batch(3)
        >>> batch.positions(arm).shape
        (3, 31, 3)
        """
        return _of_nodes(self._lanes, "positions", rod, out)

    def velocities(self, rod: Rod | str | None = None, out: FloatArray | None = None) -> FloatArray:
        """Return the velocities of the nodes of a rod, or of all nodes, shape (n, nodes, 3) [m/s]."""
        return _of_nodes(self._lanes, "velocities", rod, out)

    def directors(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the material frames of the edges, shape (n, edges, 3, 3), with rows d1, d2, tangent."""
        part = self._lanes.rod(rod)
        return _read(self._lanes, "directors", part.index, (len(part.lengths), 3, 3), out)

    def curvatures(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the curvatures towards d1 and d2, shape (n, stencils, 2) [1/m]."""
        part = self._lanes.rod(rod)
        return _read(self._lanes, "curvatures", part.index, (len(part.voronoi), 2), out)

    def twists(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the twists per length, shape (n, stencils) [rad/m]."""
        part = self._lanes.rod(rod)
        return _read(self._lanes, "twists", part.index, (len(part.voronoi),), out)

    def tensions(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the tension of each edge, as `Simulation.tensions`, shape (n, edges) [N]."""
        part = self._lanes.rod(rod)
        return _read(self._lanes, "tensions", part.index, (len(part.lengths),), out)

    def spins(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the angular velocities of the edges about their tangents, shape (n, edges) [rad/s]."""
        part = self._lanes.rod(rod)
        return _read(self._lanes, "spins", part.index, (len(part.lengths),), out)

    def energy(self, rod: Rod | str | None = None) -> Energy | RodEnergy:
        """Return the energies of every simulation, or of one rod in each; each field has shape (n,) [J]."""
        return self._lanes.gathered(lambda s: s.energy() if rod is None else s.energy(rod))  # type: ignore[no-any-return]

    def momentum(self) -> Momentum:
        """Return the linear and angular momentum of every simulation, each of shape (n, 3)."""
        return self._lanes.gathered(lambda s: s.momentum())  # type: ignore[no-any-return]

    def reaction(self, support: Support | NodeHandle | str) -> Reaction:
        """Return the force and moment of a support on its rod, each of shape (n, 3) [N], [N m]."""
        return self._lanes.gathered(lambda s: s.reaction(support))  # type: ignore[no-any-return]

    def wrench(self, hand: Hand | str) -> Reaction:
        """Return the force and moment of a hand on its rod, about the hand, each of shape (n, 3) [N], [N m]."""
        return self._lanes.gathered(lambda s: s.wrench(hand))  # type: ignore[no-any-return]

    def spring_tension(self, spring: Spring | str) -> FloatArray:
        """Return the tension of a spring and its damper, shape (n,) [N]."""
        return self._lanes.gathered(lambda s: s.spring_tension(spring))  # type: ignore[no-any-return]

    def tendon_length(self, tendon: Tendon | str) -> FloatArray:
        """Return the length of a tendon from its first guide to its last, shape (n,) [m]."""
        return self._lanes.gathered(lambda s: s.tendon_length(tendon))  # type: ignore[no-any-return]

    def tendon_points(self, tendon: Tendon | str) -> FloatArray:
        """Return the positions of the guides of a tendon, shape (n, guides, 3) [m]."""
        return self._lanes.gathered(lambda s: s.tendon_points(tendon))  # type: ignore[no-any-return]

    def joint_angle(self, joint: Joint | str) -> FloatArray:
        """Return the angle of a revolute joint since the drawing, shape (n,) [rad]."""
        return self._lanes.gathered(lambda s: s.joint_angle(joint))  # type: ignore[no-any-return]

    def joint_rate(self, joint: Joint | str) -> FloatArray:
        """Return the rate of `joint_angle`, shape (n,) [rad/s]."""
        return self._lanes.gathered(lambda s: s.joint_rate(joint))  # type: ignore[no-any-return]

    def joint_torque(self, joint: Joint | str) -> FloatArray:
        """Return the torque of a revolute joint on its second rod, shape (n,) [N m]."""
        return self._lanes.gathered(lambda s: s.joint_torque(joint))  # type: ignore[no-any-return]

    def obstacle_position(self, obstacle: Obstacle | str) -> FloatArray:
        """Return the position of an obstacle, shape (n, 3) [m]."""
        return self._lanes.gathered(lambda s: s.obstacle_position(obstacle))  # type: ignore[no-any-return]

    def contacts(self) -> list[npt.NDArray[np.void]]:
        """Return the contacts of every simulation, each a table as in `Simulation.contacts`."""
        return [simulation.contacts() for simulation in self._lanes.simulations]

    @property
    def statistics(self) -> Statistics:
        """Return counts and times of the work so far; each field has shape (n,)."""
        return self._lanes.gathered(lambda s: s.statistics)  # type: ignore[no-any-return]

    def get(self, target: Any, word: str | None = None) -> Any:
        """Return the present value of a parameter of `set` in every simulation.

        Returns
        -------
        ndarray of shape (n, ...)
            Values; a tuple if they are not numbers.
        """
        return self._lanes.gathered(lambda s: s.get(target, word))


def _of_nodes(lanes: Lanes, what: str, rod: Rod | str | None, out: FloatArray | None) -> FloatArray:
    if rod is None:
        return _read(lanes, what, -1, (lanes.first._session.directory.layout.node_count, 3), out)
    index = lanes.rod(rod).index
    return _read(lanes, what, index, (lanes.nodes(index), 3), out)


def _read(lanes: Lanes, what: str, rod: int, shape: tuple[int, ...], out: FloatArray | None) -> FloatArray:
    result = output(out, (len(lanes), *shape))
    lanes.engine.read(what, rod, result)
    return result
