"""Scene files: a scene as TOML, by the calls that described it."""

from __future__ import annotations

import inspect
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np

from withe.common import validation
from withe.io import written_beside
from withe.parts.kinds import JoinKind
from withe.parts.materials import Material
from withe.scene.declarations import Declaration
from withe.scene.file_format import SECTIONS, VERSION, Section
from withe.scene.file_values import decoded, encoded, encoded_fields, made
from withe.scene.toml_text import Lines, written

__all__ = ["arguments_of", "fill", "save_scene"]

_TOP = ("version", "gravity", "materials", "build", *(section.name for section in SECTIONS))
_WITH_UNIT = re.compile(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*[^\d\s].*")


def save_scene(scene: Any, path: str | os.PathLike[str]) -> Path:
    """Write a scene to a TOML file; see `Scene.save`."""
    path = validation.file_path(path, ".toml")
    materials = {material: name for name, material in scene._material_names.items()}
    content: dict[str, Any] = {"version": VERSION, "gravity": scene.gravity.tolist()}
    tables: dict[str, Any] = {}
    for section in SECTIONS:
        calls = [call for call in scene._declarations if call.method in section.methods.values()]
        rows = [_named(row, materials) for call in calls for row in _rows(scene, section, call)]
        if rows:
            tables[section.name] = rows[-1] if section.is_single else rows
    for call in scene._declarations:
        if call.method == "add_custom_force":
            raise ValueError(
                f"custom force {call.names[0]!r} is a Python function, which a scene file cannot have: save the scene "
                "without it, and add it after Scene.load"
            )
    if materials:
        content["materials"] = {name: encoded_fields(material, name) for material, name in materials.items()}
    if scene._build_options:
        options = {word: encoded(value, word) for word, value in scene._build_options.items() if value is not None}
        content["build"] = options
    text = written({**content, **tables})
    with written_beside(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _rows(scene: Any, section: Section, call: Declaration) -> Iterator[dict[str, Any]]:
    """Return the tables of a call: one, or one for each joint that `join` made."""
    kind = next(kind for kind, method in section.methods.items() if method == call.method)
    given = dict(call.arguments)
    if call.method == "join":
        others = [given.pop("a"), given.pop("b"), *given.pop("others", ())]
        if others[-1] in get_args(JoinKind) and others[-1] not in scene._directory.parts:
            given["kind"] = others.pop()
        pairs = [scene._directory.parts[name].node_names for name in call.names]
    # Keys in the order of the documentation; those of `actuate` that are not in its signature come last.
    order = [*arguments_of(getattr(scene, call.method)), *given]
    for i, name in enumerate(call.names or [None]):
        row: dict[str, Any] = {"kind": kind} if kind and kind not in given else {}
        if name is not None:
            row["name"] = name
        if call.method == "join":
            given["nodes"] = list(pairs[i])
        for word, value in sorted(given.items(), key=lambda item: order.index(item[0])):
            if value is None or word == "name":
                continue
            what = f"{word} of {name or section.name!r}"
            row[word] = _friction(value) if word == "friction" else encoded(value, what)
        yield row


def _friction(value: Any) -> Any:
    """Return friction as TOML; an array has one coefficient per edge."""
    if isinstance(value, np.ndarray | list) and np.ndim(value) == 1:
        return {"edges": encoded(value, "friction")}
    return encoded(value, "friction")


def _named(row: dict[str, Any], materials: dict[Material, str]) -> dict[str, Any]:
    """Return a table with its material by name, which is new if the material is."""
    material = row.get("material")
    if isinstance(material, Material):
        if material not in materials:
            number = len(materials) + 1
            while (name := f"material_{number}") in materials.values():
                number += 1
            materials[material] = name
        row["material"] = materials[material]
    return row


def fill(scene: Any, path: str | os.PathLike[str]) -> None:
    """Describe a scene by a TOML file; see `Scene.load`."""
    path = Path(path)
    text = path.read_text(encoding="utf-8")
    reader = _Reader(scene, path, text)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        advice = ". Lists are written with brackets: [0, 0, 1]" if re.search(r"=\s*\(", text) else ""
        raise ValueError(f"{path} is not TOML: {error}{advice}") from None
    reader.read(content)


class _Reader:
    """Reader of one file."""

    def __init__(self, scene: Any, path: Path, text: str) -> None:
        self._scene, self._path = scene, path
        self._text = text
        self._lines: Lines | None = None
        self._materials: dict[str, Material] = {}

    def read(self, content: Mapping[str, Any]) -> None:
        for key in content:
            if key not in _TOP:
                raise self._error(f"a scene file has no {key!r}; {_meant(key, _TOP)}", key)
        version = content.get("version", VERSION)
        if version != VERSION:
            newer = isinstance(version, int) and version > VERSION
            advice = ": install a newer withe" if newer else ""
            raise self._error(
                f"the file has version {version!r}, this withe reads version {VERSION}{advice}", "version"
            )
        if "gravity" in content:
            with self._located("gravity"):
                self._scene.gravity = content["gravity"]
        for name, values in self._table(content, "materials").items():
            with self._located("materials", name):
                self._materials[name] = made(Material, values, f"material {name!r}")
        self._scene._material_names = dict(self._materials)
        for section in SECTIONS:
            rows = content.get(section.name, [])
            if section.is_single:
                rows = [rows] if rows else []
            brackets = f"[{section.name}]" if section.is_single else f"[[{section.name}]]"
            if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
                raise self._error(f"{section.name!r} must be written as tables {brackets}", section.name)
            for i, row in enumerate(rows):
                self._call(section, brackets, None if section.is_single else i, row)
        options = self._table(content, "build")
        with self._located("build", values=options):
            self._scene.build_options = {
                word: decoded(word, value, self._path.parent, self._materials) for word, value in options.items()
            }

    def _table(self, content: Mapping[str, Any], key: str) -> Mapping[str, Any]:
        table = content.get(key, {})
        if not isinstance(table, Mapping):
            raise self._error(f"{key!r} must be a table, got {table!r:.80}", key)
        return table

    def _call(self, section: Section, brackets: str, index: int | None, row: Mapping[str, Any]) -> None:
        place = (section.name, index)
        values = dict(row)
        method, takes_kind = self._method(section, brackets, place, values)
        if takes_kind:
            values.pop("kind", None)
        known = arguments_of(method)
        for key, value in values.items():
            if key not in known and not known.get("**"):
                raise self._error(f"{brackets} has no key {key!r}; {_meant(key, known)}", *place, key)
            if isinstance(value, str) and _WITH_UNIT.fullmatch(value) and known.get(key, ""):
                raise self._error(
                    f"{key} must be a number in {known[key]} without its unit, got {value!r}", *place, key
                )
        missing = next((key for key in required_of(method) if key not in values), None)
        if missing is not None:
            raise self._error(f"{brackets} needs the key {missing!r}", *place)
        arguments = {}
        for key, value in values.items():
            with self._located(*place, key):
                arguments[key] = decoded(key, value, self._path.parent, self._materials)
        with self._located(*place, values=values):
            if method.__name__ == "join":
                nodes = arguments.pop("nodes")
                if not isinstance(nodes, list) or len(nodes) < 2:
                    raise ValueError(f"nodes must be a list of two or more nodes, got {nodes!r:.80}")
                method(*nodes, **arguments)
            elif method.__name__ == "actuate":
                method(arguments.pop("target", None), **arguments)
            else:
                method(**arguments)

    def _method(
        self, section: Section, brackets: str, place: tuple[str, int | None], values: Mapping[str, Any]
    ) -> tuple[Callable[..., Any], bool]:
        """Return the method of a table, and True if its key "kind" chose the method."""
        kinds = section.methods
        if "" in kinds:
            return getattr(self._scene, kinds[""]), False
        kind = values.get("kind") or next((kind for kind in kinds if kind in values), None)
        if kind is None:
            raise self._error(f"{brackets} needs the key 'kind', one of {', '.join(kinds)}", *place)
        if kind not in kinds:
            raise self._error(f"{brackets} has no kind {kind!r}; {_meant(str(kind), kinds)}", *place, "kind")
        return getattr(self._scene, kinds[kind]), True

    def _located(self, *place: str | int | None, values: Mapping[str, Any] | None = None) -> _Located:
        return _Located(self._error, place, values or {})

    def _error(self, message: str, *place: str | int | None) -> ValueError:
        if self._lines is None:
            self._lines = Lines(self._text)
        line = self._lines.find(*place)
        where = f"{self._path}" if line is None else f"{self._path}, line {line}"
        return ValueError(f"{where}: {message}")


class _Located:
    """Context in which an error gets the file and the line of a place."""

    def __init__(
        self, error: Callable[..., ValueError], place: tuple[str | int | None, ...], values: Mapping[str, Any]
    ) -> None:
        self._error, self._place, self._values = error, place, values

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        if isinstance(error, OSError):  # of a file that the scene names
            reason = f"{error.strerror}, {self._error('', *self._place)}".removesuffix(": ")
            raise type(error)(error.errno, reason, error.filename) from None
        if isinstance(error, ValueError | TypeError):
            raise self._error(str(error), *self._place, _meant_key(self._values, str(error))) from None


def _meant_key(values: Mapping[str, Any], message: str) -> str | None:
    """Return the key that an error is about: one that the message names, or else one whose text it quotes."""
    for key in values:
        if re.match(rf"{re.escape(key)}\b", message) or repr(key) in message:
            return key
    for key, value in values.items():
        texts = value if isinstance(value, list) else [value]
        if key != "name" and any(isinstance(text, str) and repr(text) in message for text in texts):
            return key
    return None


def arguments_of(method: Callable[..., Any]) -> dict[str, str]:
    """Return the keys that a method's table has, with their units as the docstring has them ("" for none).

    The key "**" stands for any others.
    """
    found: dict[str, str] = {}
    for parameter in inspect.signature(method).parameters.values():
        if parameter.name == "self":
            continue
        if parameter.kind is parameter.VAR_KEYWORD:
            found["**"] = "any"
        elif parameter.kind is not parameter.VAR_POSITIONAL:
            found[parameter.name] = ""
    if "others" in inspect.signature(method).parameters:  # of `join`
        found = {"nodes": "", **{name: unit for name, unit in found.items() if name not in ("a", "b")}}
    for names, unit in re.findall(r"^ *((?:\w+, )*\w+) : [^\n]*?\[([^\]]+)\]", method.__doc__ or "", re.MULTILINE):
        for name in names.split(", "):
            if name in found:
                found[name] = unit
    return found


def required_of(method: Callable[..., Any]) -> tuple[str, ...]:
    """Return the keys that a method's table must have."""
    parameters = inspect.signature(method).parameters
    if "others" in parameters:
        return ("nodes",)
    return tuple(
        each.name
        for each in parameters.values()
        if each.name != "self"
        and each.default is each.empty
        and each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL, each.POSITIONAL_ONLY)
    )


def _meant(word: str, known: Any) -> str:
    words = [each for each in known if each != "**"]
    return validation.meant(word, words, f"it has {', '.join(words)}")
