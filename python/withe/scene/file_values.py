"""Values of scene files: arguments of a scene's methods as TOML, and back."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np

from withe import shapes, solids
from withe.common.validation import meant
from withe.parts.friction_fields import FrictionMap
from withe.parts.materials import Material, Stiffness
from withe.parts.options import Solver
from withe.parts.sections import Circle, Rectangle, Tube

__all__ = ["decoded", "encoded", "encoded_fields", "made"]

_SECTIONS: dict[str, type] = {"circle": Circle, "tube": Tube, "rectangle": Rectangle}
_SOLIDS: dict[str, type] = {name.lower(): getattr(solids, name) for name in solids.__all__}
_SHAPES: dict[str, Callable[..., Any]] = {name: getattr(shapes, name) for name in shapes.__all__}


def encoded(value: Any, what: str) -> Any:
    """Return a value as TOML has it; a material stays as it is.

    Raises
    ------
    ValueError
        A Python function, or another object that a file cannot have; the message names `what`.
    """
    if isinstance(value, Material | bool | str | int | float):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Stiffness | Solver):
        return encoded_fields(value, what)
    if isinstance(value, (Circle, Tube, Rectangle, *_SOLIDS.values())):
        return {"kind": type(value).__name__.lower(), **encoded_fields(value, what)}
    if isinstance(value, FrictionMap):
        return {"image": np.asarray(value.image).tolist(), "extent": list(value.extent)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [encoded(item, what) for item in value]
    if callable(value):
        raise ValueError(f"{what} is a Python function, which a scene file cannot have")
    if hasattr(value, "as_matrix"):  # a rotation of SciPy
        return np.asarray(value.as_matrix()).tolist()
    try:
        return np.asarray(value, float).tolist()
    except (TypeError, ValueError):
        raise ValueError(f"{what} is a {type(value).__name__}, which a scene file cannot have") from None


def encoded_fields(value: Any, what: str) -> dict[str, Any]:
    """Return the fields of a dataclass that differ from their defaults."""
    given = {}
    for field in fields(value):
        own = getattr(value, field.name)
        default = None if field.default is MISSING else field.default
        if own is not None and not (np.ndim(own) == 0 and own == default):
            given[field.name] = encoded(own, f"{field.name} of {what}")
    return given


def decoded(key: str, value: Any, folder: Path, materials: Mapping[str, Material]) -> Any:
    """Return the argument that a key of a scene file gives.

    Parameters
    ----------
    key : str
        Key, which is the name of the argument.
    value : object
        Value of the key.
    folder : pathlib.Path
        Folder of the file, to which paths of CSV files are relative.
    materials : mapping of str to Material
        Materials of the file.

    Raises
    ------
    ValueError
        A value of the wrong form.
    OSError
        A CSV file that cannot be opened.
    """
    if key == "material":
        return _material(value, materials)
    if key == "section":
        return _chosen(value, "section", "kind", _SECTIONS)
    if key == "solid":
        return _chosen(value, "solid", "kind", _SOLIDS)
    if key == "stiffness" and isinstance(value, Mapping):
        return made(Stiffness, value, "stiffness")
    if key == "solver":
        return made(Solver, value, "solver")
    if key == "points" and isinstance(value, str):
        return _table(folder / value)
    if key == "points" and isinstance(value, Mapping):
        return _chosen(value, "points", "shape", _SHAPES)
    if key == "friction":
        return _friction(value)
    return tuple(value) if key == "target" and isinstance(value, list) else value


def made(kind: Callable[..., Any], values: Any, what: str) -> Any:
    """Return `kind` called with the values of a table as keywords; errors name `what`."""
    if not isinstance(values, Mapping):
        raise ValueError(f"{what} must be a table, got {values!r:.80}")
    known = inspect.signature(kind).parameters
    for word in values:
        if word not in known:
            hint = meant(str(word), known, f"it has {', '.join(known)}")
            raise ValueError(f"{what} has no key {word!r}; {hint}")
    try:
        return kind(**values)
    except TypeError as error:
        raise ValueError(f"{what}: {error}") from None


def _material(value: Any, materials: Mapping[str, Material]) -> Material:
    if isinstance(value, Mapping):
        return made(Material, value, "material")  # type: ignore[no-any-return]
    if value not in materials:
        known = ", ".join(map(repr, materials)) or "none"
        hint = meant(str(value), materials, f"the file has {known}")
        raise ValueError(f"material {value!r:.80} is not in the tables [materials.NAME]; {hint}")
    return materials[value]


def _chosen(value: Any, what: str, key: str, kinds: Mapping[str, Callable[..., Any]]) -> Any:
    """Return what a table makes that has the name of its kind under `key`."""
    if not isinstance(value, Mapping) or key not in value:
        raise ValueError(f"{what} must be a table with {key}, one of {', '.join(kinds)}, got {value!r:.80}")
    if value[key] not in kinds:
        hint = meant(str(value[key]), kinds, f"it is one of {', '.join(kinds)}")
        raise ValueError(f"{key} of {what} is unknown, got {value[key]!r:.80}; {hint}")
    return made(kinds[value[key]], {name: item for name, item in value.items() if name != key}, what)


def _friction(value: Any) -> Any:
    """Return friction by direction as a tuple, per edge as an array, and over a floor as a map."""
    if isinstance(value, list):
        return tuple(value)
    if isinstance(value, Mapping):
        if set(value) == {"edges"}:
            return np.array(value["edges"], float)
        return made(FrictionMap, value, "friction")
    return value


def _table(path: Path) -> Any:
    """Return the points of a CSV file with columns x, y and z [m], with or without a header."""
    text = path.read_text(encoding="utf-8").strip()
    head = text.partition("\n")[0]
    skip = 0 if all(_is_number(word) for word in head.split(",")) else 1
    rows = [line.split(",") for line in text.splitlines()[skip:] if line.strip()]
    columns = [0, 1, 2]
    if skip:
        names = [word.strip().split(" ")[0].strip('"') for word in head.split(",")]
        if not {"x", "y", "z"} <= set(names):
            raise ValueError(f"{path} must have the columns x, y, z, got {head!r:.80}")
        columns = [names.index(name) for name in "xyz"]
    try:
        return np.array([[float(row[column]) for column in columns] for row in rows])
    except (IndexError, ValueError) as error:
        raise ValueError(f"{path} must have three numbers in each row ({error})") from None


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
