"""Small networks that replace slow computations, with NumPy or torch.

>>> import withe
>>> network = withe.learning.train_network(x, y, hidden=(64, 64, 64), seed=0)  # doctest: +SKIP
>>> network.save("hanging.pt")  # doctest: +SKIP
>>> withe.learning.Network.load("hanging.pt")(x[0])  # doctest: +SKIP
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.io import written_beside

__all__ = ["ACTIVATIONS", "Network", "Training"]

FloatArray = npt.NDArray[np.floating[Any]]
ACTIVATIONS = {"relu": "ReLU", "silu": "SiLU", "tanh": "Tanh"}
_FORMAT, _VERSION = "withe network", 1
_CHUNK = 2048  # rows whose activations stay in the processor's cache


@dataclass(frozen=True)
class Training:
    """Record of the training of a network.

    Attributes
    ----------
    seed : int
        Seed of the training.
    epochs : int
        Number of passes over the data.
    best : int
        Epoch that was kept, counted from 1: the one with the least held-out loss. 0 without training.
    held_out_until : int
        Epoch after which training also used the held-out data.
    loss : float [-]
        Held-out loss after the best epoch.
    seconds : float [s]
        Duration of the training.
    stopped : str
        Reason for the end: "epochs", "time", "loss" or "interrupted".
    """

    seed: int
    epochs: int
    best: int
    held_out_until: int
    loss: float
    seconds: float
    stopped: str


class Network:
    """A multilayer perceptron with its scales. `train_network` trains one, `load` reads one from a file.

    Linear layers alternate with the activation f, y = b + W f(... f(b0 + W0 (x - m) / s)), and outputs are scaled back.
    Weights are in single precision; m, s and the scales of outputs in double precision. Results outside of `domain` are
    extrapolations.

    Attributes
    ----------
    inputs, outputs : tuple of str
        Names of the columns.
    hidden : tuple of int
        Widths of the hidden layers.
    activation : {"relu", "silu", "tanh"}
        Activation function.
    training : Training
        Record of the training.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    hidden: tuple[int, ...]

    def __init__(
        self,
        inputs: Sequence[str],
        outputs: Sequence[str],
        hidden: Sequence[int],
        activation: str,
        tensors: dict[str, Any],
        training: Training,
    ) -> None:
        self.inputs, self.outputs, self.hidden = tuple(inputs), tuple(outputs), tuple(hidden)
        self.activation = activation
        self.training = training
        self._tensors = tensors
        self._ready: dict[tuple[Any, Any], Callable[[Any], Any]] = {}

    @property
    def domain(self) -> npt.NDArray[np.float64]:
        """Least and greatest inputs of the training data, of shape (2, inputs)."""
        return np.array(self._tensors["domain"].double().numpy())

    def __call__(self, x: Any) -> Any:
        """Evaluate the network.

        Parameters
        ----------
        x : array_like or Tensor of shape (..., inputs)
            Inputs. The network is evaluated in the precision of `x`, single or double. Scaling is in double precision.

        Returns
        -------
        ndarray or Tensor of shape (..., outputs)
            Outputs, of the same type as `x`. A tensor has gradients.

        Raises
        ------
        ValueError
            A wrong shape, not numbers, or an array with values that are not finite.

        Examples
        --------
        >>> network([[0.5, 2.25]])  # doctest: +SKIP
        """
        torch = require("torch", "learn")
        if isinstance(x, torch.Tensor):
            if x.ndim == 0 or x.shape[-1] != len(self.inputs):
                raise ValueError(f"x must have shape (..., {len(self.inputs)}), got {tuple(x.shape)}")
            if not x.is_floating_point():
                raise ValueError(f"x must be a tensor of floating point numbers, got {x.dtype}")
            return self._function(x.dtype, x.device)(x)
        given = np.asarray(x)
        single = given.dtype == np.float32
        if given.ndim == 0 or given.shape[-1] != len(self.inputs):
            raise ValueError(f"x must have shape (..., {len(self.inputs)}), got {given.shape}")
        if not single:
            given = validation.number_array(x, "x", given.shape)
        elif not np.isfinite(given).all():
            raise ValueError("x must be finite")
        rows = torch.from_numpy(np.ascontiguousarray(given).reshape(-1, len(self.inputs)))
        function = self._function(rows.dtype, rows.device)
        with torch.inference_mode():
            found = torch.cat([function(part) for part in rows.split(_CHUNK)]) if len(rows) else function(rows)
        return found.numpy().reshape(*given.shape[:-1], len(self.outputs))

    def _function(self, dtype: Any, device: Any) -> Callable[[Any], Any]:
        """The network in a precision, on a device; made when it is first needed there."""
        key = (dtype, device)
        if key not in self._ready:
            functional = require("torch", "learn").nn.functional
            activate = getattr(functional, self.activation)
            layers = [
                tuple(self._tensors[f"{2 * i}.{part}"].to(device, dtype) for part in ("weight", "bias"))
                for i in range(len(self.hidden) + 1)
            ]
            # A mean that is far above the spread has no digits to spare: scales are taken off in double.
            exact = dtype if device.type == "mps" else require("torch", "learn").float64  # mps has no double
            scales = ("x_mean", "x_scale", "y_mean", "y_scale")
            x_mean, x_scale, y_mean, y_scale = (self._tensors[name].to(device, exact) for name in scales)

            def function(x: Any) -> Any:
                x = ((x.to(exact) - x_mean) / x_scale).to(dtype)
                for weight, bias in layers[:-1]:
                    x = activate(functional.linear(x, weight, bias))
                return (y_mean + y_scale * functional.linear(x, *layers[-1]).to(exact)).to(dtype)

            self._ready[key] = function
        return self._ready[key]

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_ready": {}}

    def __repr__(self) -> str:
        widths = " x ".join(map(str, self.hidden))
        named = f"{', '.join(self.inputs)} -> {', '.join(self.outputs)}"
        return f"Network({named}, {widths} {self.activation}, held-out loss {self.training.loss:.2g})"

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the network to a file, in the format of torch, with numbers, words and tensors only.

        Parameters
        ----------
        path : path-like

        Returns
        -------
        Path

        Raises
        ------
        OSError
            The file cannot be written.
        ImportError
            torch is not installed.
        """
        path = Path(path)
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "inputs": list(self.inputs),
            "outputs": list(self.outputs),
            "hidden": list(self.hidden),
            "activation": self.activation,
            "tensors": self._tensors,
            "training": asdict(self.training),
        }
        with written_beside(path) as beside:
            require("torch", "learn").save(content, beside)
        return path

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Network:
        """Read a network from a file. Such a file cannot execute code.

        Parameters
        ----------
        path : path-like

        Returns
        -------
        Network

        Raises
        ------
        ValueError
            A file with other content or of another version.
        FileNotFoundError
            The file does not exist.
        ImportError
            torch is not installed.
        """
        torch = require("torch", "learn")
        try:
            content = torch.load(path, map_location="cpu", weights_only=True)
        except OSError:
            raise
        except Exception as error:  # the type of the error depends on the content of the file
            raise ValueError(f"{path} is not a network of withe: torch cannot read it") from error
        if not isinstance(content, dict) or content.get("format") != _FORMAT:
            raise ValueError(f"{path} is not a network of withe")
        if content.get("version") != _VERSION:
            raise ValueError(
                f"{path} is a network of version {content.get('version')}, this withe reads version {_VERSION}: "
                "train it again"
            )
        kept = {name: content[name] for name in ("inputs", "outputs", "hidden", "activation", "tensors")}
        return cls(**kept, training=Training(**content["training"]))


def make_layers(inputs: int, outputs: int, hidden: Sequence[int], activation: str) -> Any:
    """Return linear layers with activations in between, as a torch module that can be trained."""
    nn = require("torch", "learn").nn
    layers: list[Any] = []
    for wide, next_wide in pairwise((inputs, *hidden)):
        layers += [nn.Linear(wide, next_wide), getattr(nn, ACTIVATIONS[activation])()]
    return nn.Sequential(*layers, nn.Linear(hidden[-1], outputs))
