"""Networks that replace a solver: their inputs, their outputs, and their identification in files."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.learning.network_training import Alternating, Cosine, train_network
from withe.learning.networks import Network

__all__ = ["Form", "Surrogate", "train_form"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Form:
    """Inputs and outputs of a network, as functions of NumPy or torch (functions with the same names).

    Attributes
    ----------
    inputs, outputs : tuple of str
        Names that identify the form in a file.
    ask : callable
        Function (module, *question) -> inputs.
    tell : callable
        Function (module, *question, outputs) -> results by name.
    learn : callable
        Function that returns the outputs to learn, from exact solutions.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    ask: Callable[..., tuple[Any, ...]]
    tell: Callable[..., dict[str, Any]]
    learn: Callable[[Any], tuple[FloatArray, ...]]


class Surrogate:
    """Base of networks with a meaning of their inputs and outputs.

    Attributes
    ----------
    network : withe.learning.Network
        The network itself.
    """

    FORMS: ClassVar[Mapping[str, Form]] = {}
    SHIPPED: ClassVar[Path]
    LEARNED: ClassVar[str] = ""  # word for the learned quantity

    def __init__(self, network: Network) -> None:
        names = (network.inputs, network.outputs)
        found = [form for form in self.FORMS.values() if (form.inputs, form.outputs) == names]
        if not found:
            raise ValueError(f"network must have learned {self.LEARNED}, got one of {network!r}")
        self.network = network
        self._form = found[0]

    @classmethod
    def load(cls, path: str | os.PathLike[str] | None = None) -> Self:
        """Read a network from a file; by default the small one that is shipped with withe.

        Parameters
        ----------
        path : str or path, optional
            File to read. By default the network that is shipped with withe.

        Returns
        -------
        Surrogate
            A network of this class.

        Raises
        ------
        ValueError
            A file with other content or of another version.
        ImportError
            torch is not installed.
        """
        return cls(Network.load(cls.SHIPPED if path is None else path))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the network to a file.

        Parameters
        ----------
        path : str or path
            File to write.

        Returns
        -------
        pathlib.Path
            Path of the file.

        Raises
        ------
        OSError
            The file cannot be written.
        """
        return self.network.save(path)

    def __reduce__(self) -> tuple[type[Self], tuple[Network]]:
        """Pickle only the network. The functions that interpret its numbers cannot be stored in a file."""
        return type(self), (self.network,)

    def __repr__(self) -> str:
        return f"{type(self).__name__.removesuffix('Network')}{self.network!r}"


def train_form(
    form: Form,
    question: tuple[FloatArray, ...],
    solutions: Any,
    schedule: Cosine | Alternating,
    *,
    hidden: tuple[int, ...] | None = None,
    weights: npt.ArrayLike = 1.0,
    seed: int,
    threads: int,
    time_limit: float | None,
    progress: bool,
) -> Network:
    """Train a network of a form on exact solutions.

    With `hidden` the network is small and smooth: SiLU, and squared errors of scaled outputs. Without `hidden` it is
    that of Choi, dissertation, 7.5.2 and 9.3.3: four ReLU layers of 392 units, and absolute errors of unscaled outputs.
    """
    small = hidden is not None
    return train_network(
        np.stack(form.ask(np, *question), axis=1),
        np.stack(form.learn(solutions), axis=1),
        inputs=form.inputs,
        outputs=form.outputs,
        hidden=(392, 392, 392, 392) if hidden is None else hidden,
        activation="silu" if small else "relu",
        loss="squared" if small else "absolute",
        weights=weights,
        scale_outputs=small,
        schedule=schedule,
        held_out=0.05 if small else 0.2,
        seed=validation.integer(seed, "seed", 0, 2**63 - 1),
        threads=threads,
        time_limit=time_limit,
        progress=progress,
    )
