"""Short representations of results that hold arrays."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

__all__ = ["ShortRepr"]

_WHOLE = 6  # numbers that are shown one by one
_LISTED = 60  # characters of anything else


class ShortRepr:
    """Base of dataclasses with ``repr=False`` that shows long arrays by their shapes and ranges."""

    def __repr__(self) -> str:
        shown = [f"{f.name}={_short(getattr(self, f.name))}" for f in fields(self) if f.repr]  # type: ignore[arg-type]
        return f"{type(self).__name__}({', '.join(shown)})"


def _short(value: Any) -> str:
    """One line."""
    if not isinstance(value, np.ndarray):
        text = repr(value)
        if len(text) <= _LISTED and "\n" not in text:
            return text
        if isinstance(value, list | tuple):
            return f"<{len(value)} in a {type(value).__name__}>"
        return f"<{type(value).__name__}>"
    if value.size <= _WHOLE:
        return np.array2string(value, precision=6, separator=", ").replace("\n", "")
    if value.dtype == np.bool_:
        return f"<{value.shape}, {int(value.sum())} true>"
    known = value[np.isfinite(value)]
    if known.size == 0:
        return f"<{value.shape}, none finite>"
    gaps = "" if known.size == value.size else f", {value.size - known.size} NaN or infinite"
    return f"<{value.shape}, {known.min():.6g} to {known.max():.6g}{gaps}>"
