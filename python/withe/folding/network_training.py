"""Training of networks that know how sheets hang, from exact equilibria."""

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
# Of errors of angle, length, direction and size of the force, curvature, as parts of their spread.
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
        "small": three layers of 64, smooth, of 40 kB, on 300,000 equilibria; it learns how a sheet differs from a
        straight one, and the direction and size of the force. "source": four layers of 392 with ReLU on x and z, mean
        absolute error, gradient descent and Adam by turns, batches that grow, on as many samples as there were [Choi,
        dissertation, 7.5.2]; 1.9 MB. How its samples were spread is not printed: here evenly over x and z.
    seed : int
        Of the samples, of the weights at the start and of the order; equal seeds give equal networks.
    samples : int, optional
        How many equilibria; about, of the small one.
    threads : int
        Of torch.
    time_limit : float, optional [s]
        Training stops there, and so it does at Ctrl-C, with the best network so far. ``network.network.training`` says
        how it ended.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    SheetNetwork

    Raises
    ------
    ValueError
        Another name, a negative seed.
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
    """As many sheets as are asked for, at positions that are drawn; not all positions have one."""
    x, z = draw(int(1.3 * count) + 100)
    pose = elastica(x, z)
    return take(pose, np.flatnonzero(pose.valid)[:count])


def _even(random: np.random.Generator, count: int) -> Elastica:
    """Sheets at positions spread evenly."""
    return _drawn(count, lambda many: (random.uniform(0.0, WIDE, many), random.uniform(0.0, HIGH, many)))


def _spread(random: np.random.Generator, count: int) -> Elastica:
    """Sheets spread evenly over what the small network is asked: many of them where x is small."""

    def draw(many: int) -> tuple[FloatArray, FloatArray]:
        length = np.exp(random.uniform(np.log(_STRAIGHT[0]), np.log(_STRAIGHT[1]), many))
        angle = random.uniform(0.02, 0.5 * np.pi, many)
        tip = 2.0 * length * np.sin(angle)  # distance from where it lay
        return tip * np.sin(angle), tip * np.cos(angle)

    return _drawn(count, draw)
