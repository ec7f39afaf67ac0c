"""Checks of user input at the border. Each message names the argument, the expected value and the given value."""

from __future__ import annotations

import math
import numbers
import os
import reprlib
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = [
    "broadcast_arrays",
    "choice",
    "file_path",
    "function",
    "has_masked",
    "integer",
    "is_scalar",
    "it_has",
    "meant",
    "near_word",
    "non_negative",
    "number",
    "number_array",
    "per_item",
    "positive",
    "quaternion_matrix",
    "rotation_matrix",
    "truth",
    "unit_vector",
    "vector",
]

FloatArray = npt.NDArray[np.float64]

# Beyond any quantity of this world in SI units; products of a few such numbers are still finite.
_LARGEST = 1e50
# Numbers that BLAS adds up by itself, without threads.
_ALONE = 8192
_IDENTITY = np.eye(3)
_ORTHONORMAL = 1e-15  # rounding error of rotations and their products


def number(value: Any, what: str) -> float:
    """Return a finite real number.

    Raises
    ------
    ValueError
        The value is not a real number, or not finite.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise ValueError(f"{what} must be a number, got {_short(value)}")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise ValueError(f"{what} must be finite, got {result}")
    if abs(result) > _LARGEST:
        raise ValueError(f"{what} must be less than {_LARGEST:g} in size, got {result:g}")
    return result


def positive(value: Any, what: str) -> float:
    """Return a finite number above zero."""
    result = number(value, what)
    if result <= 0.0:
        raise ValueError(f"{what} must be positive, got {result:g}")
    return result


def non_negative(value: Any, what: str) -> float:
    """Return a finite number, zero or more."""
    result = number(value, what)
    if result < 0.0:
        raise ValueError(f"{what} must not be negative, got {result:g}")
    return result


def share(value: Any, what: str) -> float:
    """Return a number from 0 to 1, both included."""
    result = number(value, what)
    if not 0.0 <= result <= 1.0:
        raise ValueError(f"{what} must be from 0 to 1, got {result:g}")
    return result


def integer(value: Any, what: str, low: int, high: int) -> int:
    """Return a whole number in low..high, both included."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Integral):
        raise ValueError(f"{what} must be a whole number, got {_short(value)}")
    result = int(value)
    if not low <= result <= high:
        raise ValueError(f"{what} must lie in {low}..{high}, got {result}")
    return result


def truth(value: Any, what: str) -> bool:
    """Return True or False; other values that count as true or false are refused."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{what} must be True or False, got {_short(value)}")
    return bool(value)


def choice(value: Any, what: str, options: Sequence[str]) -> str:
    """Return one of several words."""
    if not isinstance(value, str) or value not in options:
        near = near_word(value, options) if isinstance(value, str) else None
        meant = "" if near is None else f"; did you mean {near!r}?"
        raise ValueError(f"{what} must be {' or '.join(map(repr, options))}, got {_short(value)}{meant}")
    return value


def near_word(value: str, options: Iterable[str]) -> str | None:
    """Return the word that was probably meant: one with a similar spelling, or one that contains the value."""
    known = list(options)
    plain = value.strip().lower().replace("-", "_").replace(" ", "_")
    near = get_close_matches(plain, known, 1) or [word for word in known if len(plain) > 2 and plain in word]
    return near[0] if near else None


def meant(value: str, options: Iterable[str], otherwise: str) -> str:
    """Return the end of an error about an unknown word: the near word that may be meant, or else `otherwise`."""
    near = near_word(value, options)
    return otherwise if near is None else f"did you mean {near!r}?"


def it_has(value: str, options: Iterable[str]) -> str:
    """Return the end of an error about an unknown word: all known words, and the near word that may be meant."""
    known = list(options)
    near = near_word(value, known)
    return f"it has {', '.join(known) or 'none'}" + ("" if near is None else f". Did you mean {near!r}?")


def file_path(value: str | os.PathLike[str], *suffixes: str, instead: str = "") -> Path:
    """Return the path of a file to write, with a suffix for its format; `instead` names the way to other formats."""
    path = Path(value)
    if path.suffix.lower() not in suffixes:
        raise ValueError(f"path must end in {' or '.join(suffixes)}, got {str(path)!r}{instead and f'; {instead}'}")
    return path


def function(value: Any, what: str) -> Callable[..., Any]:
    """Return an object that can be called."""
    if not callable(value):
        raise ValueError(f"{what} must be a function, got {_short(value)}")
    return value  # type: ignore[no-any-return]


def number_array(value: Any, what: str, *shapes: tuple[int | str, ...]) -> FloatArray:
    """Return a copy of an array of finite numbers in one of several shapes.

    Parameters
    ----------
    value : array_like
    what : str
        Name for errors.
    *shapes : tuple of int or str
        Allowed shapes. A word stands for any size, and appears in errors.

    Raises
    ------
    ValueError
        Not numbers, another shape, or values that are not finite.
    """
    plain = type(value) is np.ndarray and value.dtype.kind in "iuf" and value.shape in shapes
    result = np.array(value if plain else _raw_numbers(value, what, shapes), np.float64, order="C")
    if _in_range(result):
        return result
    bad = ~np.isfinite(result)
    if bad.any():
        place = tuple(int(i) for i in np.argwhere(bad)[0])
        where = f" at {list(place)}" if place else ""
        raise ValueError(f"{what} must be finite, got {result[place]}{where}")
    if result.size and np.abs(result).max() > _LARGEST:
        raise ValueError(f"{what} must be less than {_LARGEST:g} in size, got {np.abs(result).max():g}")
    return result


def _raw_numbers(value: Any, what: str, shapes: tuple[tuple[int | str, ...], ...]) -> npt.NDArray[Any]:
    """Return a value as an array of numbers in one of several shapes; they may be of any type, and not finite."""
    wanted = " or ".join(_shape(shape) for shape in shapes)
    if has_masked(value):
        raise ValueError(f"{what} must have a value everywhere, got a masked array with masked entries")
    try:
        raw = np.asarray(value)
    except (ValueError, TypeError, OverflowError) as error:
        raise ValueError(f"{what} must be numbers of shape {wanted}, got {_short(value)}") from error
    if raw.dtype.kind == "O" and raw.size and all(_is_real(item) for item in raw.flat):
        try:
            raw = raw.astype(np.float64)
        except (OverflowError, TypeError, ValueError) as error:
            raise ValueError(f"{what} must be finite numbers, got {_short(value)}") from error
    if raw.dtype.kind not in "iuf":
        raise ValueError(f"{what} must be numbers of shape {wanted}, got {_short(value)}")
    if not any(_fits(raw.shape, shape) for shape in shapes):
        came = _shape(raw.shape) if raw.shape else "a single number"
        raise ValueError(f"{what} must have shape {wanted}, got {came}")
    return raw


def _in_range(values: FloatArray) -> bool:
    """Return True if all are finite and not too large, for certain. Unlike `dot`, `vdot` never warns.

    From 10,001 numbers on it takes threads of its own, which then spin for a while on processors that others need.
    """
    flat = values.reshape(-1)
    for start in range(0, flat.size, _ALONE):
        part = flat[start : start + _ALONE]
        if not np.vdot(part, part) <= _LARGEST**2:
            return False
    return True


def broadcast_arrays(**values: Any) -> tuple[FloatArray, ...]:
    """Return arrays of real, finite numbers of any shape, broadcast together; names are those of the arguments."""
    arrays = [
        number_array(value, name, tuple(f"n{i}" for i in range(np.ndim(value)))) for name, value in values.items()
    ]
    try:
        return tuple(np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = " and ".join(str(array.shape) for array in arrays)
        raise ValueError(f"{' and '.join(values)} must have shapes that broadcast, got {shapes}") from None


def has_masked(value: Any) -> bool:
    """Return True if entries of a masked array, or of a sequence of such, are masked: NumPy would use hidden values.

    Parameters
    ----------
    value : array_like
    """
    items = value if isinstance(value, list | tuple) else (value,)
    return any(isinstance(item, np.ma.MaskedArray) and np.ma.is_masked(item) for item in items)


def per_item(value: Any, what: str, count: int, item: str, *, zero: bool = False, sign: bool = False) -> FloatArray:
    """Return one number for all, or one per item, as an array of shape (count,).

    Parameters
    ----------
    value : float or array_like of shape (count,)
    what : str
        Name for errors.
    count : int
    item : str
        Name of the items, in the plural: "edges".
    zero, sign : bool
        True if zero is allowed, and if negative numbers are allowed.
    """
    if is_scalar(value):
        check = number if sign else non_negative if zero else positive
        return np.full(count, check(value, what))
    result = number_array(value, what, (count,))
    bad = np.zeros(count, bool) if sign else result < 0.0 if zero else result <= 0.0
    if bad.any():
        place = int(np.flatnonzero(bad)[0])
        rule = "must not be negative" if zero else "must be positive"
        raise ValueError(f"{what} {rule}, got {result[place]:g} at {item} [{place}]")
    return result


def vector(value: Any, what: str) -> FloatArray:
    """Return three finite numbers."""
    return number_array(value, what, (3,))


def unit_vector(value: Any, what: str) -> FloatArray:
    """Return a direction, scaled to unit length."""
    direction = vector(value, what)
    largest = np.abs(direction).max()
    if largest == 0.0:
        raise ValueError(f"{what} must not be zero")
    direction /= largest
    return direction / float(np.sqrt(direction @ direction))


def rotation_matrix(value: Any, what: str) -> FloatArray:
    """Return a rotation matrix of shape (3, 3), from a unit quaternion (w, x, y, z), a SciPy Rotation or a matrix.

    Raises
    ------
    ValueError
        Another type, a matrix that is not orthogonal to 1e-6, or a reflection.
    """
    as_matrix = getattr(value, "as_matrix", None)
    given = as_matrix() if callable(as_matrix) else value
    shape = np.shape(given) if is_scalar(given) or not isinstance(given, str) else ()
    if shape not in ((3, 3), (4,)):
        raise ValueError(
            f"{what} must be a quaternion (w, x, y, z), a SciPy Rotation or a matrix of shape (3, 3), "
            f"got {_short(value) if shape == () else f'shape {_shape(shape)}'}"
        )
    if shape == (4,):
        return quaternion_matrix(number_array(given, what, (4,)), what)
    matrix = number_array(given, what, (3, 3))
    off = float(np.abs(matrix @ matrix.T - _IDENTITY).max())
    if off > 1e-6:
        raise ValueError(f"{what} must be a rotation: its rows are not orthonormal")
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    if a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) < 0.0:
        raise ValueError(f"{what} must be a rotation, got a reflection")
    if off <= _ORTHONORMAL:
        return matrix
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ vt, np.float64)


def quaternion_matrix(quaternion: FloatArray, what: str) -> FloatArray:
    """Return the rotation of a unit quaternion w, x, y, z."""
    size = float(np.linalg.norm(quaternion))
    if abs(size - 1.0) > 1e-6:
        raise ValueError(f"{what} must have a quaternion qw, qx, qy, qz of length 1, got one of {size:.9g}")
    w, x, y, z = quaternion / size
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def is_scalar(value: Any) -> bool:
    """Return True if a value is a single one, not several."""
    try:
        return np.ndim(value) == 0
    except (ValueError, TypeError):  # lists of unequal length
        return False


def _is_real(item: Any) -> bool:
    return isinstance(item, numbers.Real) and not isinstance(item, bool)


def _fits(shape: tuple[int, ...], wanted: tuple[int | str, ...]) -> bool:
    return len(shape) == len(wanted) and all(
        isinstance(want, str) or size == want for size, want in zip(shape, wanted, strict=True)
    )


def _shape(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"


def _short(value: Any) -> str:
    try:
        return reprlib.repr(value)
    except Exception:  # an object whose repr fails is bad input like any other
        return f"a {type(value).__name__}"
