"""Training of networks that know where to hold a rod, from exact grasps."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.deployment.grasp_network import CURVATURES, FORMS, LENGTHS, STIFFNESSES, GraspNetwork, side
from withe.deployment.grasping import grasp
from withe.learning.network_training import Alternating, Cosine
from withe.learning.surrogates import train_form

__all__ = ["train"]

FloatArray = npt.NDArray[np.float64]
_SAMPLES = {"small": 100_000, "source": 6358}
_BEYOND = 1.03  # relative to the range: a network is worst at the border of its samples


@keyword_hints
def train(
    name: Literal["small", "source"] = "small",
    seed: int = 0,
    *,
    samples: int | None = None,
    threads: int = 1,
    time_limit: float | None = None,
    progress: bool = True,
) -> GraspNetwork:
    """Train a network on exact grasps: 0.1 to 50 Lgb, curvatures to 4 / Lgb, stretch stiffnesses 300 to 8000.

    Parameters
    ----------
    name : {"small", "source"}
        "small" has three smooth layers of 96 units (80 kB) and 100,000 grasps as samples. It learns the difference
        between a rod and a string. The network "source" is that of [Choi, dissertation, 9.3.3]: four ReLU layers of 392
        units (1.9 MB), with as many samples. It minimizes the mean absolute error, by gradient descent and Adam in
        turn, with growing batches. The dissertation does not state how its samples were distributed; here they are
        uniform over suspended length, curvature and stretch stiffness.
    seed : int
        Seed of the samples, of the initial weights and of the order. Equal seeds give equal networks.
    samples : int, optional
        Number of grasps.
    threads : int
        Number of threads of torch.
    time_limit : float, optional [s]
        Time at which training stops, with the best network so far. Ctrl-C stops it too.
        ``network.network.training`` reports the reason.
    progress : bool
        True to show a progress bar.

    Returns
    -------
    GraspNetwork

    Raises
    ------
    ValueError
        An unknown name or a negative seed.
    ImportError
        torch is not installed.
    ConvergenceError
        No grasp was found for one of the samples.

    Examples
    --------
    >>> network = withe.deployment.train("small", seed=0)  # doctest: +SKIP
    >>> network.save("grasps.pt")  # doctest: +SKIP
    """
    validation.choice(name, "name", tuple(FORMS))
    random = np.random.default_rng(validation.integer(seed, "seed", 0, 2**63 - 1))
    small = name == "small"
    count = validation.integer(_SAMPLES[name] if samples is None else samples, "samples", 100, 10_000_000)
    question = _spread(random, count) if small else _even(random, count)
    solutions = (*question, grasp(*question))
    return GraspNetwork(
        train_form(
            FORMS[name],
            question,
            solutions,
            Cosine(epochs=200, batch=1024, rate=8e-3)
            if small
            else Alternating(largest_batch=2048, whole_below=3e-3, until=1.5e-3),
            hidden=(96, 96, 96) if small else None,
            weights=_plain_errors(FORMS[name].learn(solutions), question[1]) if small else 1.0,
            seed=seed,
            threads=threads,
            time_limit=time_limit,
            progress=progress,
        )
    )


def _even(random: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return questions that are uniform over the range."""
    length, curvature, stretch = (random.uniform(*range_, count) for range_ in (LENGTHS, CURVATURES, STIFFNESSES))
    return length, curvature, stretch


def _spread(random: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return uniform questions over the range of the small network, and slightly beyond it if there are grasps."""
    length = np.exp(random.uniform(np.log(LENGTHS[0]), np.log(_BEYOND * LENGTHS[1]), count))
    curvature = random.uniform(0.0, _BEYOND * CURVATURES[1], count)
    low, high = np.log(STIFFNESSES[0] / _BEYOND), np.log(STIFFNESSES[1] * _BEYOND)
    return length, curvature, np.exp(random.uniform(low, high, count))


def _plain_errors(learned: tuple[FloatArray, ...], curvature: FloatArray) -> FloatArray:
    """Weights with which squares of errors as parts of the spread become those of positions [Lgb] and rotations [rad].

    Shape (samples, outputs).
    """
    turned = side(np, curvature)
    odd = np.array([0, 1, 0, 1, 0, 1], bool)
    factors = np.where(odd, turned[:, None], 1.0)
    return np.asarray((factors * np.std(np.stack(learned, axis=1), axis=0)) ** 2)
