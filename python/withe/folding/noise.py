"""Noise: deviations of a simulated sheet and its robot that the planner does not know."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from withe.common import validation

__all__ = ["Drawn", "Noise"]

FloatArray = npt.NDArray[np.float64]
_MOST = 2.0  # standard deviations; values farther out are drawn again
_LEAST_FRICTION = 0.01  # relative to the friction of the paper
_WAVES = 6  # number of waves of the jitter
_SLOWEST, _FASTEST = 0.5, 4.0  # their frequencies [Hz]
_SHORTEST, _LONGEST = 0.03, 0.3  # waves of friction along the table [m]


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the quantities that vary from trial to trial. Deviations are at most twice these.

    Parameters
    ----------
    gravito_bending_length : float [-]
        Relative standard deviation of Lgb.
    friction : float [-]
        Relative standard deviation of the friction coefficient between sheet and table.
    friction_variation : float [-]
        Relative variation of friction along the table, in waves of 30 to 300 mm.
    curl : float [1/m]
        Natural curvature of the sheet.
    tilt : float [rad]
        Tilt of the table about y.
    position : float [m]
        Error of the jaw in x and in z. It grows from zero over the first tenth of a motion, because the jaw grips the
        sheet without an error.
    angle : float [rad]
        Error of the jaw's angle.
    jitter : float [m]
        Fluctuation of the jaw's position about its mean, in x and in z, at 0.5 to 4 Hz. Of the jaw's place about its
        mean, in x and in z, at 0.5 to 4 Hz.

    Raises
    ------
    ValueError
        A negative standard deviation.

    Examples
    --------
    >>> import withe
    >>> withe.folding.Noise(friction=0.1).friction
    0.1
    """

    gravito_bending_length: float = 0.05
    friction: float = 0.2
    friction_variation: float = 0.1
    curl: float = 0.5
    tilt: float = np.radians(0.5)
    position: float = 3e-4
    angle: float = np.radians(0.3)
    jitter: float = 3e-5

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, validation.non_negative(getattr(self, each.name), each.name))

    @classmethod
    def none(cls) -> Noise:
        """Return noise without any deviation.

        Returns
        -------
        Noise
        """
        return cls(*(0.0 for _ in fields(cls)))


@dataclass(frozen=True)
class Drawn:
    """Random numbers of one trial: factors of Lgb and friction, curl [1/m], tilt [rad], and errors of the jaw.

    `shift` is the constant error of the jaw: x [m], z [m] and angle [rad]. `waves`, of shape (waves, 2, 3), holds the
    amplitude [m], frequency [rad/s] and phase of its jitter in x and z. `patches`, of shape (waves, 3), holds the
    amplitude, wave number [rad/m] and phase of the friction along x.
    """

    gravito_bending_length: float
    friction: float
    curl: float
    tilt: float
    shift: FloatArray
    waves: FloatArray
    patches: FloatArray

    @classmethod
    def of(cls, noise: Noise, seed: int) -> Drawn:
        """Draw the numbers of a seed. Each number is the same whether or not other deviations are zero."""
        random = np.random.default_rng(seed)
        normal = np.array([_truncated(random) for _ in range(7)])
        amplitude = noise.jitter * np.sqrt(2.0 / _WAVES) * np.ones((_WAVES, 2))
        frequency = 2.0 * np.pi * random.uniform(_SLOWEST, _FASTEST, (_WAVES, 2))
        phase = random.uniform(0.0, 2.0 * np.pi, (_WAVES, 2))
        lengths = np.exp(random.uniform(np.log(_SHORTEST), np.log(_LONGEST), _WAVES))
        share = noise.friction_variation * np.sqrt(2.0 / _WAVES) * np.ones(_WAVES)
        patches = np.stack([share, 2.0 * np.pi / lengths, random.uniform(0.0, 2.0 * np.pi, _WAVES)], axis=1)
        return cls(
            gravito_bending_length=1.0 + noise.gravito_bending_length * normal[0],
            friction=max(_LEAST_FRICTION, 1.0 + noise.friction * normal[1]),
            curl=noise.curl * normal[2],
            tilt=noise.tilt * normal[3],
            shift=normal[4:] * [noise.position, noise.position, noise.angle],
            waves=np.stack([amplitude, frequency, phase], axis=2),
            patches=patches,
        )

    def friction_at(self, x: FloatArray) -> FloatArray:
        """Return friction at places along the table [m], relative to that of the paper; at least 0."""
        amplitude, wave, phase = self.patches.T
        share = (amplitude * np.sin(np.multiply.outer(x, wave) + phase)).sum(axis=-1)
        return np.asarray(np.maximum(0.0, self.friction * (1.0 + share)))

    def off(self, time: float, share: float) -> FloatArray:
        """Return the error of the jaw, (x, z [m], angle [rad]), when a `share` of it acts."""
        amplitude, frequency, phase = self.waves[..., 0], self.waves[..., 1], self.waves[..., 2]
        if not amplitude.any():
            return share * self.shift
        jitter = (amplitude * np.sin(frequency * time + phase)).sum(axis=0)
        return np.asarray(share * (self.shift + np.array([jitter[0], jitter[1], 0.0])))


def _truncated(random: np.random.Generator) -> float:
    while True:
        value = float(random.normal())
        if abs(value) <= _MOST:
            return value
