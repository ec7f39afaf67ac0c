"""Training of small networks on a processor, in passes over the data, by one of two schedules."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.learning.networks import ACTIVATIONS, Network, Training, make_layers

__all__ = ["Alternating", "Cosine", "own_torch", "train_network"]


@dataclass(frozen=True)
class Cosine:
    """Adam with a cosine schedule: the rate decreases to zero as half a cosine.

    Attributes
    ----------
    epochs : int
        Passes over the data.
    batch : int
        Samples per step.
    rate : float [-]
        Largest rate. It is reached after a twentieth of all steps.
    """

    epochs: int = 200
    batch: int = 1024
    rate: float = 3e-3


@dataclass(frozen=True)
class Alternating:
    """Stochastic gradient descent and Adam in turn, with a change whenever training stalls, and doubled batches.

    The schedule follows Choi, dissertation, 7.5.2 and 9.3.3, which does not state the length of a stall and the rates.

    Attributes
    ----------
    epochs : int
        Largest number of passes over the data.
    batch, largest_batch : int
        Initial and final number of samples per step.
    patience : int
        Number of epochs without a decrease of the loss by 1 % that count as a stall.
    rates : pair of float [-]
        Rates of gradient descent, which comes first, and of Adam. A stall at the largest batch halves both.
    whole_below : float [-]
        Held-out loss below which training also uses the held-out data.
    until : float [-]
        Loss at which training ends.
    """

    epochs: int = 2000
    batch: int = 128
    largest_batch: int = 4096
    patience: int = 5
    rates: tuple[float, float] = (0.05, 1e-3)
    whole_below: float = 1e-3
    until: float = 5e-4


@keyword_hints
def train_network(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    hidden: Sequence[int] = (64, 64, 64),
    activation: Literal["relu", "silu", "tanh"] = "silu",
    loss: Literal["squared", "absolute"] = "squared",
    weights: npt.ArrayLike = 1.0,
    scale_outputs: bool = True,
    schedule: Cosine | Alternating | None = None,
    held_out: float = 0.1,
    seed: int = 0,
    threads: int = 1,
    time_limit: float | None = None,
    progress: bool = True,
) -> Network:
    """Train a multilayer perceptron on samples of a function.

    Parameters
    ----------
    x : array_like of shape (samples, inputs)
        Inputs of the function.
    y : array_like of shape (samples, outputs)
        Values of the function.
    inputs, outputs : sequence of str, optional
        Names of the columns; by default x0, x1, ... and y0, y1, ...
    hidden : sequence of int
        Widths of the hidden layers.
    activation : {"relu", "silu", "tanh"}
        Activation function. "silu" and "tanh" make the network smooth.
    loss : {"squared", "absolute"}
        Mean of ``weights * error**2``, or of ``weights * abs(error)``, with the errors of scaled outputs.
    weights : array_like that broadcasts to the shape of y
        Weight of each number; not negative.
    scale_outputs : bool
        True to scale each output by its mean and standard deviation, so that all outputs count equally. Inputs are
        always scaled.
    schedule : Cosine or Alternating, optional
        Schedule of training. By default ``Cosine()``.
    held_out : float [-]
        Share of the samples that are not trained on, and determine the best epoch.
    seed : int
        Seed. Equal seeds give equal networks if torch runs the same. The seed of torch itself does not change.
    threads : int
        Number of threads of torch during training. Small networks are faster on one thread. The number of threads
        changes the order of sums.
    time_limit : float, optional [s]
        Time after which the present epoch is the last one.
    progress : bool
        True to show a progress bar on a terminal.

    Returns
    -------
    Network
        Network after the epoch with the least loss on held-out data. Ctrl-C ends training with this network, and sets
        its ``training.stopped``.

    Raises
    ------
    ValueError
        Shapes that do not match, values that are not finite, fewer than ten samples, unknown words, or numbers out of
        range.
    RuntimeError
        The loss is not finite: the rate is too high.
    ImportError
        torch is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.linspace(-1.0, 1.0, 500)[:, None]
    >>> network = withe.learning.train_network(x, np.sin(3.0 * x), hidden=(32, 32))  # doctest: +SKIP
    """
    learned = _Problem.make(x, y, weights, loss, scale_outputs, validation.share(held_out, "held_out"), seed)
    names = _names(inputs, "inputs", "x", learned.x.shape[1]), _names(outputs, "outputs", "y", learned.y.shape[1])
    validation.choice(activation, "activation", tuple(ACTIVATIONS))
    widths = [validation.integer(wide, "hidden", 1, 100_000) for wide in hidden]
    if not widths:
        raise ValueError("hidden must have one width or more")
    schedule = _checked(Cosine() if schedule is None else schedule)
    limit = math.inf if time_limit is None else validation.positive(time_limit, "time_limit")
    count = validation.integer(threads, "threads", 1, 1024)
    with own_torch(count, seed):
        layers = make_layers(len(names[0]), len(names[1]), widths, activation)
        training, best = _descend(layers, learned, schedule, seed, limit, progress)
    return Network(*names, widths, activation, {**learned.scales, **best}, training)


@contextmanager
def own_torch(threads: int, seed: int) -> Iterator[None]:
    """Set threads and seed of torch, and restore them afterwards."""
    torch = require("torch", "learn")
    before = torch.get_num_threads()
    try:
        torch.set_num_threads(threads)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            yield
    finally:
        torch.set_num_threads(before)


def _names(given: Sequence[str] | None, what: str, letter: str, count: int) -> tuple[str, ...]:
    names = tuple(f"{letter}{i}" for i in range(count)) if given is None else tuple(given)
    if len(names) != count or not all(isinstance(name, str) for name in names):
        raise ValueError(f"{what} must be {count} names, one a column of {letter}, got {given!r}")
    return names


def _checked(schedule: Cosine | Alternating) -> Cosine | Alternating:
    if not isinstance(schedule, Cosine | Alternating):
        raise ValueError(f"schedule must be a Cosine or an Alternating, got {schedule!r}")
    validation.integer(schedule.epochs, "epochs of schedule", 1, 10_000_000)
    validation.integer(schedule.batch, "batch of schedule", 1, 2**31 - 1)
    rates = (schedule.rate,) if isinstance(schedule, Cosine) else schedule.rates
    for rate in rates:
        validation.positive(rate, "rate of schedule")
    return schedule


@dataclass
class _Problem:
    """Scaled samples as tensors in single precision, their scales in double, which are trained on, and the loss."""

    x: Any
    y: Any
    weights: Any
    absolute: bool
    scales: dict[str, Any]
    held: Any
    used: Any

    @classmethod
    def make(cls, x: Any, y: Any, weights: Any, loss: str, scale: bool, share: float, seed: Any) -> _Problem:
        validation.choice(loss, "loss", ("squared", "absolute"))
        validation.integer(seed, "seed", 0, 2**63 - 1)
        given = validation.number_array(x, "x", ("samples", "inputs"))
        wanted = validation.number_array(y, "y", (len(given), "outputs"))
        count = round(share * len(given))
        if len(given) < 10 or not 0 < count < len(given):
            raise ValueError(f"x must have ten samples or more, some of them held out, got {len(given)} and {count}")
        weight = np.asarray(weights, dtype=float)
        if not (np.isfinite(weight).all() and (weight >= 0).all()):
            raise ValueError("weights must be finite, and not negative")
        try:
            weight = np.broadcast_to(weight, wanted.shape)
        except ValueError:
            raise ValueError(f"weights must broadcast to the shape of y, {wanted.shape}, got {weight.shape}") from None
        torch = require("torch", "learn")
        scales = {"x_mean": given.mean(axis=0), "x_scale": _spread(given)}
        scales |= {"y_mean": wanted.mean(axis=0), "y_scale": _spread(wanted)}
        if not scale:
            scales |= {"y_mean": np.zeros(wanted.shape[1]), "y_scale": np.ones(wanted.shape[1])}
        order = torch.from_numpy(np.random.default_rng(seed).permutation(len(given)))

        def tensor(values: npt.NDArray[np.float64], dtype: type = np.float32) -> Any:
            return torch.from_numpy(np.array(values, dtype=dtype))

        return cls(
            x=tensor((given - scales["x_mean"]) / scales["x_scale"]),
            y=tensor((wanted - scales["y_mean"]) / scales["y_scale"]),
            weights=tensor(weight),
            absolute=loss == "absolute",
            scales={
                **{name: tensor(values, np.float64) for name, values in scales.items()},
                "domain": tensor(np.stack([given.min(axis=0), given.max(axis=0)]), np.float64),
            },
            held=order[:count],
            used=order[count:],
        )

    def loss(self, layers: Any, rows: Any) -> Any:
        error = layers(self.x[rows]) - self.y[rows]
        return (self.weights[rows] * (error.abs() if self.absolute else error.square())).mean()

    def held_loss(self, layers: Any) -> float:
        with require("torch", "learn").inference_mode():
            parts = self.held.split(8192)
            return sum(float(self.loss(layers, part)) * len(part) for part in parts) / len(self.held)

    def use_all(self) -> None:
        """Continue the training with the held-out data too."""
        self.used = require("torch", "learn").cat([self.used, self.held])


def _spread(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the standard deviation of each column; 1 for columns that do not vary."""
    spread = values.std(axis=0)
    return np.where(spread > 1e-12 * np.abs(values).max(axis=0), spread, 1.0)


def _descend(
    layers: Any, learned: _Problem, schedule: Cosine | Alternating, seed: int, limit: float, progress: bool
) -> tuple[Training, dict[str, Any]]:
    """Train the layers. Returns how that went, and the weights of least loss on the data held out."""
    begin = time.monotonic()
    best, best_loss, best_epoch, epoch, stopped = copy.deepcopy(layers.state_dict()), math.inf, 0, 0, "epochs"
    run: Any = _cosine if isinstance(schedule, Cosine) else _alternating
    until = 0.0 if isinstance(schedule, Cosine) else schedule.until
    whole_below = 0.0 if isinstance(schedule, Cosine) else schedule.whole_below
    held_until = 0
    with progress_bar(schedule.epochs, "training", progress, unit="epochs") as bar:
        try:
            for epoch, loss in enumerate(run(layers, learned, schedule), 1):
                if not math.isfinite(loss):
                    raise RuntimeError(f"the loss is {loss} after epoch {epoch}: a lower rate of the schedule may help")
                if loss < best_loss:
                    best, best_loss, best_epoch = copy.deepcopy(layers.state_dict()), loss, epoch
                bar.update(epoch)
                if loss < until or time.monotonic() - begin > limit:
                    stopped = "loss" if loss < until else "time"
                    break
                if not held_until and loss < whole_below:
                    learned.use_all()
                    held_until = epoch
        except KeyboardInterrupt:
            stopped = "interrupted"
    seconds = time.monotonic() - begin
    return Training(seed, epoch, best_epoch, held_until or epoch, best_loss, seconds, stopped), best


def _batches(learned: _Problem, size: int) -> Any:
    """Yield batches of rows of the data, in a new random order."""
    torch = require("torch", "learn")
    return learned.used[torch.randperm(len(learned.used))].split(size)


def _step(layers: Any, learned: _Problem, optimiser: Any, rows: Any) -> None:
    optimiser.zero_grad(set_to_none=True)
    learned.loss(layers, rows).backward()
    optimiser.step()


def _cosine(layers: Any, learned: _Problem, schedule: Cosine) -> Iterator[float]:
    """Losses on the data held out, epoch by epoch."""
    optimiser = require("torch", "learn").optim.Adam(layers.parameters())
    steps = schedule.epochs * math.ceil(len(learned.used) / schedule.batch)
    rise = max(1, steps // 20)
    step = 0
    for _ in range(schedule.epochs):
        for rows in _batches(learned, schedule.batch):
            step += 1
            fall = 0.5 * (1.0 + math.cos(math.pi * max(0, step - rise) / (steps - rise + 1)))
            optimiser.param_groups[0]["lr"] = schedule.rate * min(1.0, step / rise) * fall
            _step(layers, learned, optimiser, rows)
        yield learned.held_loss(layers)


def _alternating(layers: Any, learned: _Problem, schedule: Alternating) -> Iterator[float]:
    """The same; SGD has the first turn."""
    optim = require("torch", "learn").optim
    rates = list(schedule.rates)
    turn, batch, least, waited = 0, schedule.batch, math.inf, 0
    optimiser = optim.SGD(layers.parameters(), rates[turn])
    for _ in range(schedule.epochs):
        for rows in _batches(learned, batch):
            _step(layers, learned, optimiser, rows)
        loss = learned.held_loss(layers)
        yield loss
        waited = 0 if loss < 0.99 * least else waited + 1
        least = min(least, loss)
        if waited >= schedule.patience:
            if batch == schedule.largest_batch:
                rates[turn] *= 0.5
            turn, waited, batch = 1 - turn, 0, min(2 * batch, schedule.largest_batch)
            optimiser = (optim.SGD, optim.Adam)[turn](layers.parameters(), rates[turn])
