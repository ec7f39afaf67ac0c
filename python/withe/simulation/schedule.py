"""Actuation over time: a simulation applies each actuation of its scene at the first step that begins at its time."""

from __future__ import annotations

import math

from withe.simulation.parameters import set_values
from withe.simulation.session import Session

__all__ = ["apply_due", "check_actuations", "next_time", "steps_until_next"]


def apply_due(session: Session) -> None:
    """Set the values whose time has come and that were not set before."""
    now = _reached(session)
    for each in session.scene.actuations:
        if session.settings.actuated < each.at <= now:
            set_values(session, each.target, dict(each.values), each.over)
    session.settings.actuated = now


def next_time(session: Session) -> float:
    """Return the time of the next actuation [s]; infinite if there is none."""
    now = _reached(session)
    return next((each.at for each in session.scene.actuations if each.at > now), math.inf)


def steps_until_next(session: Session, count: int) -> int:
    """Return the number of time steps to the next actuation, from 1 to `count`."""
    wait = (next_time(session) - session.world.time) / session.options.time_step
    return count if wait >= count else max(1, math.ceil(wait - 1e-6))


def check_actuations(session: Session) -> None:
    """Set the values of all actuations on a copy of the session, so that errors are raised before the run.

    Raises
    ------
    ValueError
        A parameter that the target does not have, one that `over` does not ramp, or a value out of range.
    """
    if not session.scene.actuations:
        return
    trial = session.copy()
    for each in session.scene.actuations:
        try:
            set_values(trial, each.target, dict(each.values), each.over)
        except ValueError as error:
            raise ValueError(f"actuation at {each.at:g} s: {error}") from None


def _reached(session: Session) -> float:
    """Return the present time, and a little more: time steps add up to a time except for rounding."""
    return session.world.time + 1e-6 * session.options.time_step
