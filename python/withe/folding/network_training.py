"""Training of networks that predict hanging sheets, from exact equilibria."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.folding.grid import HIGH, WIDE
from withe.folding.manifold import elastica
from withe.folding.sheet_network import FORMS, SheetNetwork
from withe.folding.sheets import Elastica, join, take
from withe.learning.network_training import Alternating, Cosine
from withe.learning.surrogates import train_form

__all__ = ["train"]

FloatArray = npt.NDArray[np.float64]
_STRAIGHT = (0.48, 5.72)  # least and greatest straight length of all sheets [Lgb]
_SAMPLES = {"small": 300_000, "source": 95_796}
# Weights of the errors of angle, length, direction and size of the force, and curvature, relative to their spread.
_WEIGHTS = (4.0, 1.0, 2.0, 0.5, 0.2)


@keyword_hints
def train(
    name: Literal["small", "source"] = "small",
    seed: int = 0,
    *,
    samples: int | None = None,
    threads: int = 1,
    time_limit: float | None = None,
    progress: bool = True,
) -> SheetNetwork:
    """Train a network on exact equilibria of sheets that are held without moment.

    Parameters
    ----------
    name : {"small", "source"}
        "small" has three smooth layers of 64 units (40 kB) and 300,000 equilibria as samples. It learns the difference
        between a sheet and a straight sheet, and the direction and size of the force. The network "source" is that of
        [Choi, dissertation, 7.5.2]: four ReLU layers of 392 units on x and z (1.9 MB) and 95,796 samples. It minimizes
        the mean absolute error, by gradient descent and Adam in turn, with growing batches. The dissertation does not
        state how its samples were distributed; here they are uniform over x and z.
    seed : int
        Seed of the samples, of the initial weights and of the order. Equal seeds give equal networks.
    samples : int, optional
        Number of equilibria (approximate for "small").
    threads : int
        Number of threads of torch.
    time_limit : float, optional [s]
        Time at which training stops, with the best network so far. Ctrl-C stops it too.
        ``network.network.training`` reports the reason.
    progress : bool
        True to show a progress bar.

    Returns
    -------
    SheetNetwork

    Raises
    ------
    ValueError
        An unknown name or a negative seed.
    ImportError
        torch is not installed.

    Examples
    --------
    >>> network = withe.folding.train("small", seed=0)  # doctest: +SKIP
    >>> network.save("sheets.pt")  # doctest: +SKIP
    """
    validation.choice(name, "name", tuple(FORMS))
    random = np.random.default_rng(validation.integer(seed, "seed", 0, 2**63 - 1))
    form = FORMS[name]
    small = name == "small"
    count = validation.integer(_SAMPLES[name] if samples is None else samples, "samples", 100, 10_000_000)
    parts = ((_even, 0.6), (_spread, 0.4)) if small else ((_even, 1.0),)
    found = [draw(random, round(share * count)) for draw, share in parts]
    pose = found[0] if len(found) == 1 else join(*found)
    return SheetNetwork(
        train_form(
            form,
            (pose.x, pose.z),
            pose,
            Cosine(epochs=500, batch=2048, rate=8e-3) if small else Alternating(),
            hidden=(64, 64, 64) if small else None,
            weights=_WEIGHTS if small else 1.0,
            seed=seed,
            threads=threads,
            time_limit=time_limit,
            progress=progress,
        )
    )


def _drawn(count: int, draw: Callable[[int], tuple[FloatArray, FloatArray]]) -> Elastica:
    """Return `count` sheets at random positions. Positions without a sheet are skipped."""
    x, z = draw(int(1.3 * count) + 100)
    pose = elastica(x, z)
    return take(pose, np.flatnonzero(pose.valid)[:count])


def _even(random: np.random.Generator, count: int) -> Elastica:
    """Return sheets at positions that are uniform over the grid."""
    return _drawn(count, lambda many: (random.uniform(0.0, WIDE, many), random.uniform(0.0, HIGH, many)))


def _spread(random: np.random.Generator, count: int) -> Elastica:
    """Return sheets that are uniform over the questions to the small network: many have a small x."""

    def draw(many: int) -> tuple[FloatArray, FloatArray]:
        length = np.exp(random.uniform(np.log(_STRAIGHT[0]), np.log(_STRAIGHT[1]), many))
        angle = random.uniform(0.02, 0.5 * np.pi, many)
        tip = 2.0 * length * np.sin(angle)  # distance from where it lay
        return tip * np.sin(angle), tip * np.cos(angle)

    return _drawn(count, draw)
