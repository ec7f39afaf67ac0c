"""Equilibria and runs as functions of torch tensors, with gradients by the adjoint method.

>>> import withe
>>> x = withe.learning.rollout(simulation, {(arm, "youngs_modulus"): E}, duration=2.0)  # doctest: +SKIP
>>> x[-1, -1, 2].backward()  # doctest: +SKIP

Torch is imported when a function is called (``pip install ".[learn]"`` in a clone of withe).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.common.keywords import keyword_hints
from withe.parts.handles import Support
from withe.parts.table import SCENE_WORDS
from withe.simulation.overlaps import order_of_setting, remaining
from withe.simulation.simulation import Simulation
from withe.simulation.unknowns import Unknown

__all__ = ["equilibrium", "rollout"]

FloatArray = npt.NDArray[np.float64]
Values = Mapping[Unknown, Any]
"""Tensors of values, by parameter."""

_READOUTS = ("positions", "velocities")


@keyword_hints
def rollout(
    simulation: Simulation,
    values: Values,
    duration: float,
    record_every: float | None = None,
    *,
    of: str | Sequence[str] = "positions",
) -> Any:
    """Run a copy of a simulation with other values, as a differentiable function of them.

    Parameters
    ----------
    simulation : Simulation
        State at the start of the run. It is not changed.
    values : mapping
        Float64 tensors by parameter, as in `wrt` of `Record.gradient`: a part and a word of `set`, "gravity", or
        "initial_positions" and "initial_velocities" of all nodes. Shapes are those of `set`. Unlike `set`,
        "initial_positions" turns directors with their edges by the smallest rotation, and keeps the orientation of
        joints. If one value sets another (see `Simulation.set`), the given value counts, and the replaced value has no
        part in the gradient.
    duration, record_every : float [s]
        As in `Simulation.run`.
    of : str or list of str
        "positions" or "velocities".

    Returns
    -------
    Tensor of shape (frames, nodes, 3), or a tuple of tensors if `of` is a list
        Positions [m] or velocities [m/s] of every node at every frame.

    Raises
    ------
    ImportError
        Torch is not installed.
    ValueError
        Values that are not float64 tensors or that `set` refuses. On backward, parameters without a gradient.
    ConvergenceError
        A step does not converge.

    Examples
    --------
    >>> E = torch.tensor(1e6, dtype=torch.float64, requires_grad=True)  # doctest: +SKIP
    >>> x = withe.learning.rollout(simulation, {(arm, "youngs_modulus"): E}, duration=2.0)  # doctest: +SKIP
    >>> ((x - measured) ** 2).sum().backward()  # doctest: +SKIP
    """
    listed = (of,) if isinstance(of, str) else tuple(of)
    if not listed or not set(listed) <= set(_READOUTS):
        raise ValueError(f"of must be {' or '.join(_READOUTS)}, or a list of them, got {of!r}")

    def solve(copy: Simulation, differentiable: bool) -> tuple[list[FloatArray], _PullBack]:
        record = copy.run(duration, record_every, progress=False, differentiable=differentiable)

        def pull_back(by: list[FloatArray], wrt: list[Unknown]) -> list[Any]:
            return record.gradient(dict(zip(listed, by, strict=True)), wrt)

        return [getattr(record, name)() for name in listed], pull_back

    for unknown in values:
        if not isinstance(unknown, str) and isinstance(unknown[0], Support):
            raise ValueError(
                f"a rollout does not take {unknown[1]!r} of a support: use Record.gradient for a pose at the "
                "start, and Record.gradient(...).calls for calls of move"
            )
    found = _apply(simulation, values, solve)
    return found[0] if isinstance(of, str) else found


def equilibrium(simulation: Simulation, values: Values) -> Any:
    """Return the equilibrium of a simulation as a differentiable function of parameters.

    Parameters
    ----------
    simulation : Simulation
        Initial state. It is not changed.
    values : mapping
        Float64 tensors by parameter, as in `wrt` of `Equilibrium.gradient`: a part and a word of `set`, "gravity", or a
        support and "position". Shapes are those of `set` or `move`. Parameters that set others act as in `rollout`.

    Returns
    -------
    Tensor of shape (nodes, 3)
        Positions of every node [m].

    Raises
    ------
    ImportError
        Torch is not installed.
    ValueError
        As in `rollout`.
    ConvergenceError
        There is no equilibrium, or none was found.

    Examples
    --------
    >>> x = withe.learning.equilibrium(simulation, {(arm, "natural_curvature"): kappa})  # doctest: +SKIP
    """

    def solve(copy: Simulation, differentiable: bool) -> tuple[list[FloatArray], _PullBack]:
        found = copy.equilibrium()
        return [copy.positions()], lambda by, wrt: found.gradient(by[0], wrt)

    return _apply(simulation, values, solve)[0]


_PullBack = Callable[[list[FloatArray], list[Unknown]], list[Any]]
_Solve = Callable[[Simulation, bool], tuple[list[FloatArray], _PullBack]]


def _apply(simulation: Simulation, values: Values, solve: _Solve) -> tuple[Any, ...]:
    torch = require("torch", "learn")
    if not isinstance(simulation, Simulation):
        raise ValueError(f"simulation must be a withe.Simulation, got {type(simulation).__name__}")
    if not isinstance(values, Mapping) or not values:
        raise ValueError('values must map parameters to tensors, such as {(arm, "youngs_modulus"): E}')
    for unknown, tensor in values.items():
        name = _name(unknown)
        if not isinstance(tensor, torch.Tensor):
            raise ValueError(f"the value of {name} must be a torch.Tensor, got {type(tensor).__name__}")
        if tensor.dtype != torch.float64:
            raise ValueError(
                f"the value of {name} must be float64, got {tensor.dtype}: create the tensor with "
                "dtype=torch.float64, or pass value.double(), which keeps its gradient"
            )
    return tuple(_function().apply(simulation, list(values), solve, *values.values()))


def _name(unknown: Unknown) -> str:
    if isinstance(unknown, str):
        return repr(unknown)
    return f"{unknown[1]!r} of {getattr(unknown[0], 'name', unknown[0])!r}"


@cache
def _function() -> Any:
    """Return the function that is registered with torch. It is created when torch is imported."""
    torch = require("torch", "learn")

    class Solved(torch.autograd.Function):  # type: ignore[misc,name-defined]
        @staticmethod
        def forward(ctx: Any, simulation: Simulation, wrt: list[Unknown], solve: _Solve, *tensors: Any) -> Any:
            copy = simulation.copy()
            for place in order_of_setting(copy._session, wrt):
                _set(copy, wrt[place], tensors[place].detach().cpu().numpy())
            found, pull_back = solve(copy, any(ctx.needs_input_grad))
            ctx.wrt, ctx.pull_back = remaining(copy._session, wrt), pull_back
            ctx.shapes = [tensor.shape for tensor in tensors]
            ctx.normal = np.array(copy.plan.plane_normal) if copy.plan.planar else None
            return tuple(torch.as_tensor(np.array(array), device=tensors[0].device) for array in found)

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator]
        def backward(ctx: Any, *by: Any) -> Any:
            arrays = [grad.detach().cpu().numpy() for grad in by]
            if ctx.normal is not None:  # nodes do not move along it
                arrays = [array - np.multiply.outer(array @ ctx.normal, ctx.normal) for array in arrays]
            asked = [i for i, needed in enumerate(ctx.needs_input_grad[3:]) if needed]
            found = ctx.pull_back(arrays, [ctx.wrt[i] for i in asked])
            out: list[Any] = [None] * len(ctx.wrt)
            for i, gradient in zip(asked, found, strict=True):
                out[i] = torch.as_tensor(_summed(np.asarray(gradient), ctx.shapes[i]), device=by[0].device)
            return None, None, None, *out

    return Solved


def _summed(gradient: FloatArray, shape: Sequence[int]) -> FloatArray:
    """Over the axes along which a value of that shape was spread."""
    extra = gradient.ndim - len(shape)
    axes = [*range(extra), *(extra + i for i, size in enumerate(shape) if size == 1 != gradient.shape[extra + i])]
    return np.array(gradient.sum(axis=tuple(axes), keepdims=True)).reshape(tuple(shape))


def _set(simulation: Simulation, unknown: Unknown, value: FloatArray) -> None:
    if not isinstance(unknown, str):
        target, word = unknown
        if isinstance(target, tuple):
            if word != "friction":
                raise ValueError(f"a pair of bodies has friction only, got {word!r}")
            simulation.set(target, friction=float(value) if value.ndim == 0 else (float(value[0]), float(value[1])))
        elif isinstance(target, Support):
            if word != "position":
                raise ValueError(f"{_name(unknown)} cannot be given as a tensor: a support has position")
            simulation.move(target, position=value)
        else:
            values: dict[str, Any] = {word: value if value.ndim else float(value)}
            part: Any = target  # of any kind, whose words are checked when they are set
            simulation.set(part, **values)
    elif any(unknown == word.name for word in SCENE_WORDS):
        values = {unknown: value if value.ndim else float(value)}
        simulation.set(**values)
    elif unknown == "initial_velocities":
        simulation.set_velocities(None, value)
    elif unknown == "initial_positions":
        _displace(simulation, value)
    else:
        raise ValueError(f"values must not hold {unknown!r}: see wrt of Record.gradient")


def _displace(simulation: Simulation, positions: FloatArray) -> None:
    """Nodes moved, directors taken along."""
    now = simulation.positions()
    if positions.shape != now.shape:
        raise ValueError(f"initial_positions must have shape {now.shape}, got {positions.shape}")
    way = (positions - now).ravel()
    if not way.any():
        return
    displacement = simulation.linearise()._displacement  # orthonormal where nodes move
    by = displacement.T @ way
    if np.abs(displacement @ by - way).max() > 1e-9 * np.abs(way).max():
        raise ValueError(
            "initial_positions must not move nodes that a support holds, or leave the plane of a planar scene"
        )
    simulation.displace_state(np.concatenate([by, np.zeros_like(by)]))
