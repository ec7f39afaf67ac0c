"""One time step as a map between states that are vectors: what LQR, MPC and Kalman filters ask for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.simulation.functions import apply_functions
from withe.simulation.session import Session
from withe.simulation.stepping import Stepping
from withe.simulation.unknowns import OfRun, Unknown, check_list, unknown_reader

__all__ = ["StateSpace"]

FloatArray = npt.NDArray[np.float64]


class StateSpace:
    """Methods of `Simulation` that take its state as a vector.

    A state has no coordinates of its own, since directors and joints turn; its difference from another state has. It
    has twice as many numbers as there are free unknowns: displacements of nodes [m], turns of edges' directors about
    their tangents (in space) and of joints [rad], less what supports hold; then their rates [m/s], [rad/s]. The order
    is that of ``linearise()``, whose ``displacement`` makes displacements of nodes of the first half, and velocities
    of nodes of the second.
    """

    _session: Session

    def step_jacobian(self, wrt: Sequence[Unknown] = ()) -> tuple[Any, Any]:
        """Derivatives of the state one time step from now, by the present state and by what acts in that step.

        x' = A x + B u to first order, where x and x' are differences (`state_difference`) from the present state and
        from the one that it leads to, and u are changes of the values of `wrt`. The simulation itself stays where it
        is. By adjoints, a solve for every number of the state: exact to rounding, inner steps included.

        Parameters
        ----------
        wrt : list
            Pairs of a part and a word of `set`, or "gravity", as in `Record.gradient`; none by default.

        Returns
        -------
        A : csr_array of shape (2 unknowns, 2 unknowns)
        B : csr_array of shape (2 unknowns, inputs)
            Columns are those of each of `wrt` in turn, its values in the order of ``get(...).ravel()``. An implicit
            step couples all that hangs together: what is zero in either is what does not.

        Raises
        ------
        ConvergenceError
            The step cannot be solved.
        ValueError
            What has no gradient, as in `Record.gradient`, and natural shapes on their way (`over=`).

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
        """Return the difference of the present state from that of a copy of this simulation, shape (2 unknowns,).

        Positions and velocities are subtracted. An edge's directors turn by at most half a turn from those of the
        reference, taken along by the smallest turn between the two tangents; joints turn by 2 tan(angle / 2) about
        their axis. See `step_jacobian`.

        Parameters
        ----------
        reference : Simulation
            A copy of this one at another state, with the same supports.

        Raises
        ------
        ValueError
            A simulation of another scene, or with other supports.
        """
        if not isinstance(reference, StateSpace):
            raise ValueError(f"reference must be a copy() of this simulation, got {type(reference).__name__}")
        return np.array(self._session.world.state_difference(reference._session.world))

    def displace_state(self, by: npt.ArrayLike) -> None:
        """Add a difference of states to the present one: the inverse of `state_difference`. Contacts go on.

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
        """
        self._session.world.displace_state(validation.number_array(by, "by", ("2 unknowns",)))
