"""Natural frequencies, modes and stability of the equations of motion linearised about a configuration.

Slow motions bend N edges by 1 / N^2 of the bending of a single node's motion. Their energy is 1 / N^4 of the entries of
the stiffness matrix, and is therefore lost to rounding. The stiffness is stored as strains with their stiffnesses
instead, K = Kg + G^T D G, and is inverted with the forces D G x as unknowns:

    [Kg + s M, G^T; G, -D^-1] [x; f] = [b; 0].

No large number hides a small one here [Hellinger and Reissner's principle; Golub and Van Loan: Matrix computations,
2013, 4.4 on the accuracy of such systems]. The eigenvalues nearest to -s are the greatest ones of the inverse. They are
found in a block Krylov space with an M-orthogonal basis [Saad: Numerical methods for large eigenvalue problems, 2011,
ch. 6]. Blocks are needed for multiple eigenvalues: a round rod has every bending mode twice, a free rod has six modes
at zero, and equal rods have equal modes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

__all__ = ["Linearisation"]

FloatArray = npt.NDArray[np.float64]
Stability = Literal["stable", "diverges", "flutters"]
Inverse = Callable[[FloatArray], FloatArray]

_BLOCK = 8
_FULL = 8  # matrices are dense if more than one in this many modes is needed
_LOOK = 16  # number of slow modes of connected parts that are searched for instability
_NEUTRAL = 1e-4  # relative to a shift: accuracy of a square near it
_TOLERATED = 0.1  # relative to a shift: greatest square that is neutral because of the imbalance
_KNOWN = 1e-7  # relative to a shift: accuracy of a square
_PAIR = 1e-6  # relative to a square: accuracy of its imaginary part
_ROUNDING = 64.0 * np.finfo(float).eps  # relative to the parts of a stiffness, as in the engine's `curvature_along`
_RESIDUAL = 1e-9  # relative to an eigenvalue of the inverse
_LOST = 0.01  # share of the squared length that must remain of a direction after one orthonormalisation


@dataclass(frozen=True, eq=False, repr=False)
class Linearisation:
    """Equations linearised about a configuration, mass x'' + stiffness x = 0, for the unknowns that no support holds.

    Drag and viscosity are not included. Loads that turn with the rod (follower forces, moments in space) make the
    stiffness unsymmetric. The frequencies may then be complex; see `frequencies`.

    Attributes
    ----------
    stiffness : ndarray of shape (unknowns, unknowns)
        Tangent stiffness: node positions [m] and angles [rad] against forces [N] and moments [N m]. Computed on first
        use. `frequencies` does not use this matrix, and is more accurate.
    mass : ndarray of shape (unknowns, unknowns)
        Masses [kg] and moments of inertia [kg m^2]. Velocity varies linearly along an edge, so the matrix couples the
        nodes of an edge. With integrator "verlet" half of each edge's mass is at either node.
    displacement : ndarray of shape (3 nodes, unknowns)
        Displacement of every node [m] for each unknown.

    See Also
    --------
    Simulation.linearise : Linearise the equations of a simulation.
    """

    _geometric: Any
    _gradients: Any
    _stiffnesses: FloatArray
    _mass: Any
    _displacement: Any
    _turn: Any
    _imbalance: FloatArray

    def __repr__(self) -> str:
        nodes, unknowns = self._displacement.shape[0] // 3, self._mass.shape[0]
        return f"Linearisation({unknowns} unknowns of {nodes} nodes)"

    @property
    def stiffness(self) -> FloatArray:
        """Return the tangent stiffness of the unknowns, shape (unknowns, unknowns) [N/m for node positions]."""
        return np.asarray(self._assembled.toarray())

    @property
    def mass(self) -> FloatArray:
        """Return the mass matrix of the unknowns, shape (unknowns, unknowns) [kg for node positions]."""
        return np.asarray(self._mass.toarray())

    @property
    def displacement(self) -> FloatArray:
        """Return the displacement of every node for each unknown, shape (3 nodes, unknowns) [m]."""
        return np.asarray(self._displacement.toarray())

    def frequencies(self, count: int = 6) -> npt.NDArray[Any]:
        """Return the lowest natural frequencies.

        For a scene that is solved in a plane, these are the frequencies of motions in the plane;
        ``build(planar=False)`` gives all. A negative frequency f means divergence: the mode grows with
        ``exp(2 pi |f| t)``. Complex pairs of f and its conjugate mean flutter: the modes oscillate at the real part,
        and grow with the imaginary part in the place of f. The order is by the real part of the square, so diverging
        modes come first.

        Parameters
        ----------
        count : int
            Number of frequencies.

        Returns
        -------
        ndarray of shape (count,) [Hz]
            Complex for a scene that flutters.

        Raises
        ------
        ValueError
            `count` is not between 1 and the number of unknowns.

        See Also
        --------
        modes : Shapes of the motions.
        stability : Kind of the fastest growing motion.
        """
        squares, _ = self._solve(count)
        if np.iscomplexobj(squares):
            roots = np.sqrt(squares)
            roots = np.where((squares.imag == 0.0) & (squares.real < 0.0), -np.sqrt(np.abs(squares)), roots)
            return np.asarray(roots / (2.0 * np.pi))
        return np.asarray(np.sign(squares) * np.sqrt(np.abs(squares)) / (2.0 * np.pi))

    def modes(self, count: int = 6) -> npt.NDArray[Any]:
        """Return node displacements of the lowest modes, with the greatest scaled to 1.

        Modes that flutter are complex: their nodes oscillate with different phases.

        Parameters
        ----------
        count : int
            Number of modes.

        Returns
        -------
        ndarray of shape (count, nodes, 3)
            Complex for modes that flutter.

        Raises
        ------
        ValueError
            `count` is not between 1 and the number of unknowns.

        See Also
        --------
        frequencies : Frequencies of the modes.
        """
        _, shapes = self._solve(count)
        displaced = (self._displacement @ shapes).T.reshape(count, -1, 3)
        greatest = np.linalg.norm(displaced, axis=2).max(axis=1)
        return np.asarray(displaced / np.where(greatest > 0.0, greatest, 1.0)[:, None, None])

    @cached_property
    def stability(self) -> Stability:
        """Return "stable" if small motions stay small, or else the kind of the fastest growing motion.

        "diverges" grows steadily. "flutters" oscillates and grows, which needs loads that turn with the rod. Damping is
        not included; it may stabilise or destabilise [Ziegler 1952]. Neutral motions (of a rod that may spin about its
        axis) do not count. The search covers the lowest 16 modes. With an unsymmetric stiffness it covers the lowest 16
        modes of each connected part.
        """
        if self._mass.shape[0] == 0:
            return "stable"
        parts = [self] if self._symmetric else self._parts()
        return max((part._fastest() for part in parts), key=lambda found: found[0])[1]

    def _fastest(self) -> tuple[float, Stability]:
        """Return the greatest rate of growth [1/s], and a description of it."""
        squares, shapes = self._solve(min(_LOOK, self._mass.shape[0]))
        rates = np.sqrt(-squares.astype(complex))
        neutral = self._neutral(shapes, self._shift) + _KNOWN * self._shift
        growth = np.where(np.abs(squares) <= neutral, 0.0, np.abs(rates.real))
        fastest = int(np.argmax(growth))
        if growth[fastest] == 0.0:
            return 0.0, "stable"
        return float(growth[fastest]), "flutters" if squares[fastest].imag != 0.0 else "diverges"

    def _parts(self) -> list[Linearisation]:
        """Return a linearisation for each connected part."""
        from scipy.sparse.csgraph import connected_components

        coupled = abs(self._assembled) + abs(self._mass)
        count, labels = connected_components(coupled, directed=False)
        if count == 1:
            return [self]
        out = []
        for label in range(count):
            own = np.flatnonzero(labels == label)
            gradients = self._gradients.tocsc()[:, own].tocsr()
            strained = np.flatnonzero(np.diff(gradients.indptr))
            out.append(
                Linearisation(
                    self._geometric.tocsc()[:, own].tocsr()[own].tocsc(),
                    gradients[strained].tocsc(),
                    self._stiffnesses[strained],
                    self._mass.tocsc()[:, own].tocsr()[own].tocsc(),
                    self._displacement.tocsc()[:, own],
                    self._turn.tocsc()[:, own],
                    self._imbalance[own],
                )
            )
        return out

    # Eigenvalues

    @cached_property
    def _assembled(self) -> Any:
        return (self._geometric + self._gradients.T @ self._gradients.multiply(self._stiffnesses[:, None])).tocsc()

    @cached_property
    def _symmetric(self) -> bool:
        difference = self._geometric - self._geometric.T
        return bool(abs(difference).max() <= 1e-12 * max(abs(self._assembled).max(), 1e-300))

    def _solve(self, count: int) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """Squares of the lowest angular frequencies, and shapes as columns."""
        size = self._mass.shape[0]
        if not 1 <= count <= size:
            raise ValueError(f"count must be between 1 and {size}, got {count}")
        shift = self._shift
        inverse = self._inverse(shift)
        # The eigenvalues nearest to -shift have the lowest real part, except pairs off the real axis.
        found = count if self._symmetric else min(2 * count + _BLOCK, size)
        if found > size // _FULL:
            squares, shapes = self._full(inverse, shift)
        else:
            squares, shapes, _ = self._krylov(inverse, shift, found)
            if not self._symmetric:
                squares, shapes = self._with_fast_growth(squares, shapes, shift, found)
        chosen = np.argsort(squares.real, kind="stable")[:count]
        squares, shapes = squares[chosen], shapes[:, chosen]
        if self._symmetric:
            # Motions of nodes with almost no mass have few digits in orthogonal shapes. The inverse restores them.
            shapes = inverse(self._mass @ shapes) * (squares + shift)
            squares = self._rayleigh(shapes)
            order = np.argsort(squares, kind="stable")
            return squares[order], shapes[:, order]
        # Rounding may turn two equal eigenvalues into a complex pair. Two real shapes span the same space.
        real = np.abs(squares.imag) <= _PAIR * np.abs(squares)
        shapes = np.where(real, np.where(squares.imag < 0.0, shapes.imag, shapes.real), shapes)
        squares = np.where(real, squares.real, squares)
        return (squares.real, shapes.real) if real.all() else (squares, shapes)

    def _rayleigh(self, shapes: FloatArray) -> FloatArray:
        """Return squares of frequencies from energies, which are more accurate than from the inverse."""
        strains = self._gradients @ shapes
        twice = (shapes * (self._geometric @ shapes)).sum(axis=0) + self._stiffnesses @ strains**2
        return np.asarray(twice / (shapes * (self._mass @ shapes)).sum(axis=0))

    def _with_fast_growth(
        self, squares: npt.NDArray[Any], shapes: npt.NDArray[Any], shift: float, count: int
    ) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """Find also motions that diverge by more than -shift: they are nearest to a shift beyond it."""
        beyond = shift
        while not self._positive(beyond):
            beyond *= 4.0
        if beyond <= 4.0 * shift:
            return squares, shapes
        far, far_shapes, residuals = self._krylov(self._inverse(beyond), beyond, count)
        grows = (far.real < -shift) & (residuals <= _RESIDUAL / (np.abs(far + beyond)))
        near = squares.real >= -shift
        return (
            np.concatenate((far[grows], squares[near])),
            np.hstack((far_shapes[:, grows], shapes[:, near])),
        )

    def _neutral(self, shapes: npt.NDArray[Any], shift: float) -> FloatArray:
        """Bound of the squared frequencies of neutral motions.

        The bound is twice the sum of two errors, because rounding reaches it for a bar under tension:

        - the rounding error of the parts of the stiffness
        - the error of forces F out of balance: along a motion q(a) of constant energy, K q' . q' = -F . q'', and nodes
          that turn by an angle a have |q''| = |q'|
        """
        sizes = np.abs(shapes)
        strains = np.abs(self._gradients @ shapes) * (abs(self._gradients) @ sizes)
        twice = _ROUNDING * ((sizes * (abs(self._geometric) @ sizes)).sum(axis=0) + self._stiffnesses @ strains)
        turns = np.abs(self._turn @ shapes).max(axis=0, initial=0.0)
        forces = np.linalg.norm((self._displacement @ self._imbalance).reshape(-1, 3), axis=1)
        ways = np.linalg.norm((self._displacement @ shapes).reshape(len(forces), 3, -1), axis=1)
        kinetic = np.abs((shapes.conj() * (self._mass @ shapes)).sum(axis=0))
        # Far from equilibrium, as during motion, no motion counts as neutral.
        return np.asarray(twice / kinetic + np.minimum(2.0 * (forces @ ways) * turns / kinetic, _TOLERATED * shift))

    @cached_property
    def _shift(self) -> float:
        """Return a squared frequency near that of the slowest motion that is not neutral, and above any diverging one.

        It may be wrong by some powers of ten. Neutral motions are then large in the inverse, and the others keep their
        digits.
        """
        nodes = max(2, self._displacement.shape[0] // 3)
        ratios = np.abs(self._assembled.diagonal()) / self._mass.diagonal()
        if not ratios.any():
            return 1.0  # nothing is stiff, so every motion is neutral for any shift
        shift = float(np.median(ratios) or ratios.max()) / nodes**4
        count = _BLOCK
        for _ in range(40):
            squares, shapes, _ = self._krylov(self._inverse(shift), shift, count, rounds=2)
            moving = np.abs(squares[np.abs(squares) > np.maximum(_NEUTRAL * shift, self._neutral(shapes, shift))])
            if not len(moving) and count < self._mass.shape[0]:
                count *= 2  # every free rod has six that are neutral
                continue
            slowest = moving.min() if len(moving) else _NEUTRAL * shift
            if 1e-7 * slowest < shift < 10.0 * slowest:
                break
            shift = 0.1 * slowest
        while self._symmetric and not self._positive(shift):
            shift *= 4.0
        return float(shift)

    def _positive(self, shift: float) -> bool:
        """Return True if no motion has a square, or the real part of one, below -shift.

        All pivots of the stiffness or its symmetric part are positive [Sylvester's law of inertia; a square lies in the
        field of values].
        """
        from scipy.sparse import diags
        from scipy.sparse.linalg import splu

        scale = diags(1.0 / np.sqrt(np.abs(self._assembled.diagonal()) + shift * self._mass.diagonal()))
        stiffness = 0.5 * (self._assembled + self._assembled.T)
        matrix = (scale @ (stiffness + shift * self._mass) @ scale).tocsc()
        try:
            factors = splu(matrix, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True, "Equil": False})
        except RuntimeError:  # a pivot that rounding left at zero
            return False
        return bool((factors.U.diagonal() > 0.0).all())

    def _inverse(self, shift: float) -> Inverse:
        """Answers b with (K + shift M)^-1 b; see the head of this file."""
        from scipy.sparse import bmat, diags
        from scipy.sparse.linalg import splu

        size = self._mass.shape[0]
        matrix = bmat(
            [
                [self._geometric + shift * self._mass, self._gradients.T],
                [self._gradients, diags(-1.0 / self._stiffnesses)],
            ],
            format="csc",
        )
        factors = splu(matrix)

        def solve(b: FloatArray) -> FloatArray:
            right = np.zeros((matrix.shape[0], b.shape[1]))
            right[:size] = b
            x = factors.solve(right)
            x += factors.solve(right - matrix @ x)
            return np.asarray(x[:size])

        return solve

    def _krylov(
        self, inverse: Inverse, shift: float, count: int, rounds: int | None = None
    ) -> tuple[npt.NDArray[Any], npt.NDArray[Any], FloatArray]:
        """Squares nearest to -shift, shapes and residuals, from a Krylov space of the inverse, (K + shift M)^-1 M.

        Ends when `count` have converged, after some rounds, or where the space is whole.
        """
        size = self._mass.shape[0]
        # The block is as wide as the requested number: a narrower block finds only part of equal eigenvalues.
        start = np.random.default_rng(0).standard_normal((size, min(max(_BLOCK, count + 1), size)))
        block, _ = self._orthonormal(inverse(self._mass @ start))
        basis, images = block, self._mass @ block
        projected = np.zeros((0, 0))
        step = 0
        while True:
            step += 1
            width = block.shape[1]
            answer = inverse(self._mass @ block)
            column = images.T @ answer
            answer -= basis @ column
            again = images.T @ answer
            answer -= basis @ again
            column += again
            grown = np.zeros((basis.shape[1], basis.shape[1]))
            grown[: projected.shape[0], : projected.shape[1]] = projected
            grown[:, -width:] = column
            block, link = self._orthonormal(answer, scale=float(np.abs(column).max()))
            if self._symmetric:
                inverses, vectors = np.linalg.eigh(0.5 * (grown + grown.T))
            else:
                inverses, vectors = np.linalg.eig(grown)
            residuals = np.linalg.norm(link @ vectors[-width:], axis=0)
            order = np.argsort(-np.abs(inverses))
            done = bool((residuals[order[: count + 1]] <= _RESIDUAL * np.abs(inverses[order[: count + 1]])).all())
            whole = block.shape[1] == 0 or basis.shape[1] + block.shape[1] > size
            if (done and len(order) > count) or whole or step == rounds:
                kept = order[: max(count + 1, _BLOCK)]
                return 1.0 / inverses[kept] - shift, basis @ vectors[:, kept], residuals[kept]
            projected = np.zeros((basis.shape[1] + block.shape[1], basis.shape[1]))
            projected[: basis.shape[1]] = grown
            projected[basis.shape[1] :, -width:] = link
            basis = np.hstack((basis, block))
            images = np.hstack((images, self._mass @ block))

    def _orthonormal(self, block: FloatArray, scale: float | None = None) -> tuple[FloatArray, FloatArray]:
        """Return Q and R with block = Q R and Q^T M Q = 1, without columns that are only rounding errors."""
        squares, axes = np.linalg.eigh(block.T @ (self._mass @ block))
        least = 1e-24 * squares.max() if scale is None else max(1e-24 * scale**2, 1e-24 * squares.max())
        kept = squares > least
        roots = np.sqrt(squares[kept])
        axes = axes[:, kept]
        first = block @ (axes / roots)
        # Once more, since columns that nearly agree lose digits, and some all that they had.
        squares, turned = np.linalg.eigh(first.T @ (self._mass @ first))
        kept = squares > _LOST * squares.max(initial=0.0)
        again, turned = np.sqrt(squares[kept]), turned[:, kept]
        return first @ (turned / again), (again[:, None] * turned.T) @ (roots[:, None] * axes.T)

    def _full(self, inverse: Inverse, shift: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """Return all modes: slow ones (the greatest of the inverse) from the inverse, fast ones from the matrix."""
        from scipy.linalg import eig, eigh

        mass = self.mass
        flexibility = inverse(np.eye(len(mass)))
        scale = 1.0 / np.sqrt(np.diag(mass))[:, None]
        stiffness, scaled = scale * self.stiffness * scale.T, scale * mass * scale.T
        if self._symmetric:
            root = np.linalg.cholesky(scaled)
            inverses, vectors = np.linalg.eigh(root.T @ (flexibility / (scale * scale.T)) @ root)
            slow, slow_shapes = 1.0 / inverses[::-1] - shift, scale * np.linalg.solve(root.T, vectors[:, ::-1])
            fast, shapes = eigh(stiffness, scaled)
        else:
            inverses, vectors = np.linalg.eig(flexibility @ mass)
            order = np.argsort(-np.abs(inverses))
            slow, slow_shapes = 1.0 / inverses[order] - shift, vectors[:, order]
            fast, shapes = eig(stiffness, scaled)
            order = np.argsort(np.abs(fast + shift))
            fast, shapes = fast[order], shapes[:, order].astype(complex)
        shapes = scale * shapes
        turn = int((np.abs(slow + shift) < np.sqrt(shift * np.abs(fast).max())).sum())
        if not self._symmetric and 0 < turn < len(slow) and slow[turn - 1].imag > 0.0:
            turn -= 1  # pairs stay together
        fast[:turn] = slow[:turn]
        shapes[:, :turn] = slow_shapes[:, :turn]
        return fast, shapes
