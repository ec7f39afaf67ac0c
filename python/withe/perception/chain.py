"""A cable in a plane as a chain of nodes: its elastic energy, inertia and what a mask shows of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Chain", "Pulls", "resample"]

Array = NDArray[np.float64]

_BAND = 5  # upper diagonals of the Hessian: two coordinates a node, stencils of three nodes
_STRETCH = 50.0  # stretching stiffness of an edge over the stiffness of data at a node
_STRAIN = 3e-4  # greatest strain by the weight of the whole cable
_STEP = 0.5  # greatest step of a node in an iteration, relative to the distance of nodes


@dataclass
class Pulls:
    """Quadratic potentials that pull points of a chain: 1/2 weight (axis . (x(place) - target))^2.

    Attributes
    ----------
    edge : ndarray of int, shape (pulls,)
    share : ndarray of shape (pulls,)
        Place on the edge, from 0 to 1.
    axis, target : ndarray of shape (pulls, 2)
    weight : ndarray of shape (pulls,)
    """

    edge: NDArray[np.intp]
    share: Array
    axis: Array
    target: Array
    weight: Array


def resample(line: Array, count: int) -> Array:
    """Return points at equal distances along a polyline, both ends included, shape (count, 2)."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    places = np.linspace(0.0, arc[-1], count)
    return np.column_stack([np.interp(places, arc, column) for column in line.T])


class Chain:
    """Chain of nodes at constant distances.

    Energy of bending: 1/2 b sum |x[i-1] - 2 x[i] + x[i+1] - spacing / 2 k[i] J (x[i+1] - x[i-1])|^2, with b = EI /
    spacing^3, the natural curvature k and J a turn by 90 degrees. For edges of constant length, this is the energy of
    an elastic rod to second order in the angles between edges, and its Hessian is constant.

    Parameters
    ----------
    spacing : float
        Distance of nodes.
    bend : float
        Stiffness b.
    mass : float
        Mass of a node, over the same unit of force.
    load : ndarray of shape (2,)
        Weight of a node.
    damping : float [1/s]
    curvature : ndarray of shape (nodes,)
        Natural curvature.
    data : float
        Stiffness of data at a node.
    """

    def __init__(
        self, spacing: float, bend: float, mass: float, load: Array, damping: float, curvature: Array, data: float
    ) -> None:
        self.spacing, self.bend, self.load, self.damping = spacing, bend, load, damping
        count = len(curvature)
        self.masses = np.full(count, mass)
        self.masses[[0, -1]] *= 0.5
        self.loads = np.tile(load, (count, 1))
        self.loads[[0, -1]] *= 0.5
        self.data = data
        weight = float(np.hypot(*load)) * count
        self.stretch = max(_STRETCH * data, weight / (_STRAIN * spacing))
        self.curvature = curvature
        self._bend_band = self._bending_band()

    def set_curvature(self, curvature: Array) -> None:
        """Set the natural curvature, shape (nodes,)."""
        self.curvature = curvature
        self._bend_band = self._bending_band()

    def _coefficients(self) -> tuple[Array, Array]:
        """Return the matrices of x[i-1] and x[i+1] in the strain of bending; that of x[i] is -2."""
        turn = np.array([[0.0, -1.0], [1.0, 0.0]])
        half = 0.5 * self.spacing * self.curvature[1:-1, None, None] * turn
        return np.eye(2) + half, np.eye(2) - half

    def _bending_band(self) -> Array:
        before, after = self._coefficients()
        count = len(self.curvature)
        blocks = np.zeros((3, count, 2, 2))  # of nodes i and i, i + 1, i + 2
        middle = -2.0 * np.eye(2)
        blocks[0, :-2] += before.transpose(0, 2, 1) @ before
        blocks[0, 1:-1] += 4.0 * np.eye(2)
        blocks[0, 2:] += after.transpose(0, 2, 1) @ after
        blocks[1, :-2] += before.transpose(0, 2, 1) @ middle
        blocks[1, 1:-1] += middle @ after
        blocks[2, :-2] += before.transpose(0, 2, 1) @ after
        band = np.zeros((_BAND + 1, 2 * count))
        _add_blocks(band, self.bend * blocks[0], self.bend * blocks[1, :-1])
        far = self.bend * blocks[2, :-2]
        band[1, 4::2] += far[:, 0, 0]
        band[1, 5::2] += far[:, 1, 1]
        band[0, 5::2] += far[:, 0, 1]
        band[2, 4::2] += far[:, 1, 0]
        return band

    def bending_force(self, x: Array) -> Array:
        """Return the gradient of the energy of bending, shape (nodes, 2)."""
        before, after = self._coefficients()
        strain = (
            np.einsum("nij,nj->ni", before, x[:-2]) - 2.0 * x[1:-1] + np.einsum("nij,nj->ni", after, x[2:])
        ) * self.bend
        gradient = np.zeros_like(x)
        gradient[:-2] += np.einsum("nji,nj->ni", before, strain)
        gradient[1:-1] -= 2.0 * strain
        gradient[2:] += np.einsum("nji,nj->ni", after, strain)
        return gradient

    def settle(self, x: Array, ahead: Array, inertia: Array, pulls: Pulls, iterations: int, tolerance: float) -> Array:
        """Minimise the energy of bending, stretching, weight, inertia and data by Newton's method.

        Parameters
        ----------
        x : ndarray of shape (nodes, 2)
            Initial guess.
        ahead : ndarray of shape (nodes, 2)
            Positions to which inertia alone leads.
        inertia : ndarray of shape (nodes,)
            Stiffness of inertia, mass / time step^2 for the implicit Euler method.
        pulls : Pulls
        iterations : int
        tolerance : float
            Greatest step of a node at which the iteration ends.

        Returns
        -------
        ndarray of shape (nodes, 2)
        """
        from scipy.linalg import solveh_banded

        count = len(x)
        low, high = pulls.edge, pulls.edge + 1
        near, far = 1.0 - pulls.share, pulls.share
        outer = pulls.weight[:, None, None] * pulls.axis[:, :, None] * pulls.axis[:, None, :]
        diagonal = np.zeros((count, 2, 2))
        beside = np.zeros((count - 1, 2, 2))
        for i in (0, 1):
            for j in (0, 1):
                values = outer[:, i, j]
                diagonal[:, i, j] += np.bincount(low, values * near * near, count)
                diagonal[:, i, j] += np.bincount(high, values * far * far, count)
                beside[:, i, j] += np.bincount(low, values * near * far, count - 1)
        diagonal[:, [0, 1], [0, 1]] += inertia[:, None]
        fixed = self._bend_band.copy()
        _add_blocks(fixed, diagonal, beside)
        limit = _STEP * self.spacing
        for _ in range(iterations):
            edges = x[1:] - x[:-1]
            lengths = np.sqrt((edges**2).sum(axis=1))
            tangents = edges / lengths[:, None]
            tension = self.stretch * (lengths - self.spacing)
            gradient = self.bending_force(x) + inertia[:, None] * (x - ahead) - self.loads
            gradient[1:] += tension[:, None] * tangents
            gradient[:-1] -= tension[:, None] * tangents
            at = near[:, None] * x[low] + far[:, None] * x[high]
            force = (pulls.weight * ((at - pulls.target) * pulls.axis).sum(axis=1))[:, None] * pulls.axis
            for i in (0, 1):
                gradient[:, i] += np.bincount(low, force[:, i] * near, count)
                gradient[:, i] += np.bincount(high, force[:, i] * far, count)
            # Compressed edges have no geometric stiffness here, so that the Hessian is positive definite.
            across = self.stretch * np.maximum(0.0, 1.0 - self.spacing / lengths)
            blocks = (self.stretch - across)[:, None, None] * tangents[:, :, None] * tangents[:, None, :]
            blocks[:, [0, 1], [0, 1]] += across[:, None]
            own = np.zeros((count, 2, 2))
            own[1:] += blocks
            own[:-1] += blocks
            band = fixed.copy()
            _add_blocks(band, own, -blocks)
            step = solveh_banded(band, -gradient.ravel(), overwrite_ab=True, check_finite=False).reshape(-1, 2)
            largest = float(np.sqrt((step**2).sum(axis=1).max()))
            if largest > limit:
                step *= limit / largest
            x = x + step
            if largest < tolerance:
                break
        return x


def _add_blocks(band: Array, diagonal: Array, beside: Array) -> None:
    """Add blocks of nodes i, i and i, i + 1 to the upper diagonals of a symmetric matrix."""
    band[5, 0::2] += diagonal[:, 0, 0]
    band[5, 1::2] += diagonal[:, 1, 1]
    band[4, 1::2] += diagonal[:, 0, 1]
    band[3, 2::2] += beside[:, 0, 0]
    band[3, 3::2] += beside[:, 1, 1]
    band[2, 3::2] += beside[:, 0, 1]
    band[4, 2::2] += beside[:, 1, 0]
