#!/usr/bin/env python3
"""JSON schema of scene files, made from the signatures and docstrings of the methods of `withe.Scene`.

python tools/scene_schema.py writes python/withe/scene/scene.schema.json; --check only compares.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
import types
import typing
from pathlib import Path
from typing import Any

import withe
from withe.scene.file_format import SECTIONS, VERSION

TARGET = Path(__file__).resolve().parent.parent / "python/withe/scene/scene.schema.json"

NUMBERS = {"anyOf": [{"type": "number"}, {"type": "array"}]}
OBJECT = {"type": "object"}
BY_NAME: dict[str, Any] = {
    "material": {"anyOf": [{"type": "string"}, {"$ref": "#/$defs/material"}]},
    "section": {"anyOf": [{"$ref": f"#/$defs/{name}"} for name in ("circle", "tube", "rectangle")]},
    "solid": {"anyOf": [{"$ref": f"#/$defs/solid_{name.lower()}"} for name in withe.solids.__all__]},
    "friction": {"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}}, OBJECT]},
    "points": {"anyOf": [{"type": "array"}, {"type": "string"}, {"$ref": "#/$defs/shape"}]},
    "guides": {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]},
    "pose": {"type": "array"},
    "target": {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]},
    "rods": {"anyOf": [{"type": "boolean"}, {"type": "array", "items": {"type": "string"}}]},
}


def schema() -> dict[str, Any]:
    """Return the schema of a scene file."""
    definitions = {
        "material": table(withe.Material),
        "stiffness": table(withe.Stiffness),
        "solver": table(withe.Solver),
        "shape": {"type": "object", "properties": {"shape": {"enum": sorted(withe.shapes.__all__)}}},
    }
    for kind in (withe.Circle, withe.Tube, withe.Rectangle):
        definitions[kind.__name__.lower()] = table(kind, kind=kind.__name__.lower())
    for name in withe.solids.__all__:
        definitions[f"solid_{name.lower()}"] = table(getattr(withe.solids, name), kind=name.lower())
    properties: dict[str, Any] = {
        "version": {"const": VERSION, "description": "Version of the format."},
        "gravity": {"type": "array", "items": {"type": "number"}, "description": "Acceleration of free fall [m/s^2]."},
        "materials": {"type": "object", "additionalProperties": {"$ref": "#/$defs/material"}},
        "build": table(withe.Scene.build),
    }
    for section in SECTIONS:
        kinds = [table(getattr(withe.Scene, method), kind=kind) for kind, method in section.methods.items()]
        item = kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
        properties[section.name] = item if section.is_single else {"type": "array", "items": item}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Scene of withe",
        "description": "Units are SI, and angles are in radians.",
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        "$defs": definitions,
    }


def table(function: Any, *, kind: str = "") -> dict[str, Any]:
    """Return the schema of a table whose keys are the arguments of a function or class."""
    own = function.__init__ if inspect.isclass(function) else inspect.unwrap(function)
    hints = typing.get_type_hints(own)
    texts = descriptions(function)
    properties: dict[str, Any] = {"kind": {"const": kind}} if kind else {}
    required, is_open = [], False
    for parameter in inspect.signature(own).parameters.values():
        if parameter.name == "self":
            continue
        if parameter.kind is parameter.VAR_KEYWORD:
            is_open = True
        elif parameter.kind is parameter.VAR_POSITIONAL:
            continue
        else:
            text = texts.get(parameter.name, "")
            properties[parameter.name] = of_type(parameter.name, hints.get(parameter.name)) | (
                {"description": text} if text else {}
            )
            if parameter.default is parameter.empty and parameter.kind is not parameter.POSITIONAL_ONLY:
                required.append(parameter.name)
    if own.__name__ == "join":
        nodes = {"type": "array", "items": {"type": "string"}, "minItems": 2, "description": texts.get("a", "")}
        properties = {"nodes": nodes} | {key: value for key, value in properties.items() if key not in ("a", "b")}
        required = ["nodes"]
    found = {"type": "object", "properties": properties, "additionalProperties": is_open}
    return found | ({"required": required} if required else {})


def of_type(name: str, hint: Any) -> dict[str, Any]:
    """Return the schema of a value by its name, or else by its annotation."""
    if name in BY_NAME:
        return BY_NAME[name]
    is_union = isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union
    options = [each for each in (typing.get_args(hint) if is_union else (hint,)) if each is not type(None)]
    found = [of_annotation(option) for option in options]
    found = [each for i, each in enumerate(found) if each is not None and each not in found[:i]]
    if not found or {} in found:
        return {}
    return found[0] if len(found) == 1 else {"anyOf": found}


def of_annotation(hint: Any) -> dict[str, Any] | None:
    """Return the schema of one annotation; None for what files do not have, such as functions."""
    plain = {bool: "boolean", int: "integer", float: "number", str: "string"}
    if hint in plain:
        return {"type": plain[hint]}
    if typing.get_origin(hint) is typing.Literal:
        return {"enum": list(typing.get_args(hint))}
    if inspect.isclass(hint) and issubclass(hint, withe.Stiffness | withe.Solver):
        return {"$ref": f"#/$defs/{hint.__name__.lower()}"}
    if inspect.isclass(hint) and hint.__module__ == "withe.parts.handles":
        return {"type": "string"}
    if "Callable" in str(hint):
        return None
    return NUMBERS


def descriptions(function: Any) -> dict[str, str]:
    """Return the descriptions of the arguments in a docstring, with their units."""
    section = re.search(r"Parameters\n-+\n(.*?)(?:\n\n\w+\n-+\n|\Z)", inspect.getdoc(function) or "", re.DOTALL)
    entry = re.compile(r"^\*?\*?(\w+(?:, \*?\*?\w+)*) : ([^\n]*)\n((?:^ +[^\n]*\n?|^\n(?= ))*)", re.MULTILINE)
    found = {}
    for names, kind, text in entry.findall(section[1] + "\n" if section else ""):
        unit = re.search(r"\[([^\]]+)\]\s*$", kind)
        words = " ".join(text.split())
        words = re.sub(r":\w+:`(?:~?withe\.)?(\w+)`", r"`\1`", words)
        words = re.sub(r"(^|\s)\* ", r"\1", words)  # items of a list
        words = words + (f" [{unit[1]}]" if unit else "")
        for name in names.split(", "):
            found[name.strip("*")] = words.strip()
    return found


def main() -> int:
    """Write or compare the schema."""
    text = json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"
    if "--check" in sys.argv[1:]:
        if not TARGET.exists() or TARGET.read_text(encoding="utf-8") != text:
            print(f"{TARGET} is not current: run python tools/scene_schema.py")
            return 1
        return 0
    TARGET.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
