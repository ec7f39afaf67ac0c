"""Values of a scene that are possible but suggest a mistake: each gives a `PlausibilityWarning`."""

from __future__ import annotations

import math

import numpy as np

from withe.common.user_warnings import warn
from withe.errors import PlausibilityWarning
from withe.parts.kinds import BodyPart, DragPart, FluidPart, JoinPart, ObstaclePart, RodPart
from withe.simulation.session import Session
from withe.simulation.stepping import Stepping

__all__ = ["check_scene"]

_LIGHTEST, _HEAVIEST = 10.0, 3e4  # kg/m^3: foams are above the first, osmium (22,600) is below the second
_SOFTEST = 100.0  # Pa: the softest gels and tissues
_FIRST_CANTILEVER = 1.875104**2  # (beta L)^2 of the first mode of a cantilever
_UNRESOLVED = 10.0  # periods in a time step; a few are taken on purpose, by backward Euler on the way to rest


def check_scene(stepping: Stepping) -> None:
    """Warn of implausible materials, bodies and time steps, at the time of `Scene.build`."""
    session = stepping.session
    gravity = float(np.linalg.norm(session.gravity))
    joined = {rod for join in session.directory.all(JoinPart) for rod, _ in join.nodes}
    for rod in session.directory.all(RodPart):
        _check_density(session, rod, gravity)
        _check_modulus(session, rod, gravity)
        if rod.index not in joined:  # stubs to which other rods are joined may be thicker than long
            _check_thickness(rod)
    _check_bodies(session)
    _check_time_step(stepping)


def _check_bodies(session: Session) -> None:
    """Warn of a body that passes through everything, if there is something to touch."""
    bodies = session.directory.all(BodyPart)
    if not any(session.directory.all(ObstaclePart)) and all(body.surface is None for body in bodies):
        return
    for body in bodies:
        if body.drawn_only:
            _warn(
                f"body {body.name!r} is a {type(body.solid).__name__.lower()}, which touches nothing",
                "use a capsule or hull, or touches=False if it may pass through everything",
            )


def _check_thickness(rod: RodPart) -> None:
    """Warn of a rod that is thicker than long."""
    thickness, length = 2.0 * float(rod.section.touching.max()), float(rod.lengths.sum())
    if thickness > length:
        _warn(
            f"{rod.owner} is {thickness:.3g} m thick and {length:.3g} m long, thicker than long",
            "is its radius in metres?",
        )


def _check_density(session: Session, rod: RodPart, gravity: float) -> None:
    """Warn of implausible densities. Without gravity any density is plausible, since a model may choose its masses."""
    density = session.settings.rods[rod.index].density
    if density is None or gravity == 0.0:
        return
    for number in np.ravel(density):
        if number < _LIGHTEST:
            _warn(f"density of {rod.owner} is {number:g} kg/m^3, lighter than any foam", "is it in g/cm^3?")
            return
        if number > _HEAVIEST:
            _warn(f"density of {rod.owner} is {number:g} kg/m^3, heavier than any metal", "is it in kg/m^3?")
            return


def _check_modulus(session: Session, rod: RodPart, gravity: float) -> None:
    """Warn of a very soft rod, unless it is short enough to bear its weight, rho g L < E, as in scaled models."""
    numbers = session.settings.rods[rod.index]
    if numbers.youngs_modulus is None or numbers.density is None:
        return
    modulus = float(np.min(numbers.youngs_modulus))
    weight = float(np.max(numbers.density)) * gravity * float(rod.lengths.sum())
    if modulus < _SOFTEST and (gravity == 0.0 or weight > modulus):
        _warn(f"youngs_modulus of {rod.owner} is {modulus:g} Pa, softer than any gel", "is it in MPa or GPa?")


def _check_time_step(stepping: Stepping) -> None:
    """A scene with a rigid or an unstable mode has no slowest period, and one with a fluid or drag no vibrations.

    Modes are found only where the step is long for a single rod, since joints, masses and springs make a scene slower.
    """
    session = stepping.session
    step = session.options.time_step
    damped = any(session.directory.all(FluidPart)) or any(session.directory.all(DragPart))
    if session.options.integrator in ("static", "verlet") or session.custom_forces or damped:
        return
    if step < max((_cantilever_period(session, rod) for rod in session.directory.all(RodPart)), default=math.inf):
        return
    modes = stepping.linearise().frequencies(1)
    lowest = complex(modes[0]).real if len(modes) else 0.0
    if step * lowest > _UNRESOLVED:
        _warn(
            f"time_step is {step:g} s, longer than the slowest period of {1.0 / lowest:.2g} s",
            "no vibration is resolved; is it in seconds?",
        )


def _cantilever_period(session: Session, rod: RodPart) -> float:
    """Return the period of the slowest bending mode of a rod that is clamped at one end [s]."""
    numbers = session.settings.rods[rod.index]
    softest, heaviest = float(np.min(numbers.bend_stiffness)), float(np.max(numbers.line_density))
    return 2.0 * math.pi * float(rod.lengths.sum()) ** 2 / _FIRST_CANTILEVER * math.sqrt(heaviest / softest)


def _warn(wrong: str, slip: str) -> None:
    warn(f"{wrong}: {slip}", PlausibilityWarning, wrong.split(" is ")[0])
