"""One time step as a map between state vectors, as needed for LQR, MPC and Kalman filters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.simulation.functions import apply_functions
from withe.simulation.readers import OfRun
from withe.simulation.session import Session
from withe.simulation.stepping import Stepping
from withe.simulation.unknowns import Unknown, check_list, unknown_reader

__all__ = ["StateSpace"]

FloatArray = npt.NDArray[np.float64]


class StateSpace:
    """Methods of `Simulation` for differences of states as vectors.

    The difference of two states is a vector with two numbers per free unknown. The first half has displacements of
    nodes [m], rotations of directors about their tangents (in space) and rotations of joints [rad]. The second half has
    their rates [m/s], [rad/s]. The order is that of ``linearise()``, whose ``displacement`` converts the first half to
    displacements of nodes, and the second half to velocities of nodes.
    """

    _session: Session

    def step_jacobian(self, wrt: Sequence[Unknown] = ()) -> tuple[Any, Any]:
        """Return the sparse matrices A and B of the next time step, linearised about the present state.

        To first order x' = A x + B u, with the differences x from the present state and x' from the state after the
        step (`state_difference`), and with changes u of the values of `wrt`. The simulation is not changed.

        Parameters
        ----------
        wrt : list
            Parameters: pairs of a part and a word of `set`, or "gravity", as in `Record.gradient`. By default none.

        Returns
        -------
        A : csr_array of shape (2 unknowns, 2 unknowns)
            Derivative by the present state.
        B : csr_array of shape (2 unknowns, inputs)
            Derivative by each item of `wrt` in turn, in the order of ``get(...).ravel()``.

        Raises
        ------
        ConvergenceError
            The step does not converge.
        ValueError
            A parameter or scene without a gradient, as in `Record.gradient`, or a ramp of a natural shape (`over=`).

        See Also
        --------
        state_difference : Differences of states on which A acts.
        Record.gradient : Derivatives of a whole run.

        Notes
        -----
        The matrices follow from the adjoint method with one solve per row, exact to rounding, inner steps included. An
        implicit step couples all unknowns of connected parts; other entries are zero.

        Examples
        --------
        >>> import numpy as np
        >>> import withe
        >>> scene = withe.Scene()
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        >>> arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.3), nodes=11, radius=5e-3, material=rubber)
        >>> support = scene.clamp(arm.start)
        >>> simulation = scene.build(integrator="backward_euler", planar=True, time_step=5e-3)
        >>> balance = simulation.equilibrium()
        >>> A, B = simulation.step_jacobian([(arm, "natural_curvature")])
        >>> A.shape, B.shape
        ((40, 40), (40, 18))
        >>> bool(np.abs(np.linalg.eigvals(A.toarray())).max() < 1.0)
        True
        """
        from scipy.sparse import csr_array

        session = self._session
        check_list(wrt, may_be_empty=True)
        readers = [unknown_reader(session, unknown) for unknown in wrt]
        if any(isinstance(unknown, str) and unknown.startswith("initial_") for unknown in wrt):
            raise ValueError(
                "wrt must not hold initial states, because step_jacobian returns the derivatives by the present state "
                "as A"
            )
        ahead = Stepping(session.copy())
        if session.settings.functions:  # loads as they act in the step
            now, dt = session.world.time, session.options.time_step
            middle = 1.0 if session.options.integrator == "backward_euler" else 0.5
            apply_functions(ahead.session, now + middle * dt, now + dt)
        tape = ahead.session.world.start_tape()
        ahead.step(1)
        found = tape.jacobian()
        rows = [[np.ravel(read(OfRun(row))) for read in readers] for row in found.rows]
        inputs = np.array([np.concatenate([np.empty(0), *row]) for row in rows]).reshape(len(rows), -1)
        return csr_array(found.state), csr_array(inputs)

    def state_difference(self, reference: Any) -> FloatArray:
        """Return the difference of the present state from that of a copy of this simulation.

        Positions and velocities are subtracted. Rotations of directors are relative to the reference after parallel
        transport between the two tangents, and at most half a turn. Joints count by 2 tan(angle / 2) about their axis.
        See `step_jacobian`.

        Parameters
        ----------
        reference : Simulation
            A copy of this one at another state, with the same supports.

        Returns
        -------
        ndarray of shape (2 unknowns,)

        Raises
        ------
        ValueError
            A simulation of another scene, or with other supports.

        See Also
        --------
        displace_state : Add a difference of states.
        step_jacobian : Derivatives of a step by the state.
        """
        if not isinstance(reference, StateSpace):
            raise ValueError(f"reference must be a copy() of this simulation, got {type(reference).__name__}")
        return np.array(self._session.world.state_difference(reference._session.world))

    def displace_state(self, by: npt.ArrayLike) -> None:
        """Add a difference of states to the present state, as the inverse of `state_difference`.

        Parameters
        ----------
        by : array_like of shape (2 unknowns,)
            As `state_difference` returns it. Supports stay where they are.

        Raises
        ------
        ValueError
            A vector of another length, one that folds an edge right back onto the next, or rods that would overlap.
        RuntimeError
            Called while a step is being taken.

        See Also
        --------
        state_difference : The inverse.
        """
        self._session.world.displace_state(validation.number_array(by, "by", ("2 unknowns",)))
