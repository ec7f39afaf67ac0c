"""Exceptions and warnings that are withe's own. Bad input is a `ValueError`, Ctrl-C a `KeyboardInterrupt`."""

from __future__ import annotations

__all__ = ["CoarseMeshWarning", "ConvergenceError"]


class CoarseMeshWarning(UserWarning):
    """Somewhere an edge turns or twists by more than 120 degrees against the next: the rod needs more nodes there.

    A stencil that twists by tau bends with cos^2(tau / 2) of its stiffness, and one that folds over is far too stiff.
    Given once a simulation, at an equilibrium or within 64 steps.
    """


class ConvergenceError(RuntimeError):
    """No solution was found, not even with the smallest step.

    The simulation is left in its last accepted state, so it can be looked at, changed and continued.

    Attributes
    ----------
    time : float [s]
        Time of that state.
    step : float [s]
        The step that was too long; 0 in an equilibrium.
    rod : str or None
        Name of the rod where the residual is greatest, if that is known.
    node : int or None
        Node of that rod.
    residual : float [N]
        Greatest force out of balance.
    """

    def __init__(
        self,
        message: str,
        time: float = 0.0,
        step: float = 0.0,
        rod: str | None = None,
        node: int | None = None,
        residual: float = float("nan"),
    ) -> None:
        # All of it goes to args, so that the exception pickles.
        super().__init__(message, time, step, rod, node, residual)
        self.time = time
        self.step = step
        self.rod = rod
        self.node = node
        self.residual = residual

    def __str__(self) -> str:
        return str(self.args[0])
