"""TOML as text: writing it, and finding the line of a table or key. The standard library reads it, without lines."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["Lines", "written"]

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_HEADER = re.compile(r"^\s*(\[\[?)\s*(.+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"""^\s*("(?:[^"\\]|\\.)*"|'[^']*'|[A-Za-z0-9_.-]+)\s*=""")
_TOKEN = re.compile(
    r'''"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|\#[^\n]*|[\[\]{}\n]''', re.DOTALL
)
_WIDTH = 110  # longest line of an array before each item gets its own line


def written(content: Mapping[str, Any]) -> str:
    """Return TOML with the content: values first, then tables and arrays of tables. None is left out."""
    lines = [f"{_key(key)} = {_value(value)}" for key, value in content.items() if not _is_table(value)]
    for key, value in content.items():
        if not _is_table(value):
            continue
        for table in value if isinstance(value, list) else [value]:
            brackets = "[[{}]]" if isinstance(value, list) else "[{}]"
            if isinstance(value, Mapping) and all(isinstance(inner, Mapping) for inner in table.values()):
                for name, inner in table.items():
                    lines += ["", f"[{_key(key)}.{_key(name)}]", *_pairs(inner)]
            else:
                lines += ["", brackets.format(_key(key)), *_pairs(table)]
    return "\n".join(lines).strip("\n") + "\n"


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping) or (
        isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)
    )


def _pairs(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_value(value)}" for key, value in table.items() if value is not None]


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _text(name)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")


def _value(value: Any) -> str:
    """Return a value in one line, or an array of arrays in one line an item."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    assert isinstance(value, Sequence)
    items = [_value(item) for item in value]
    line = f"[{', '.join(items)}]"
    if len(line) <= _WIDTH:
        return line
    return "[\n" + "".join(f"  {item},\n" for item in items) + "]"


def _number(value: float) -> str:
    """Return the shortest text that is read as the same number, and as no integer."""
    plain = repr(float(value))  # a number of NumPy has its type in its text
    if not math.isfinite(value):
        return plain
    exponent = f"{value:.16e}".partition("e")[2]
    digits = next(text for places in range(17) if float(text := f"{value:.{places}e}") == value).partition("e")[0]
    short = f"{digits}e{int(exponent)}"
    return short if len(short) + 1 < len(plain) else plain


class Lines:
    """Lines of a TOML text on which its tables and keys stand, counted from 1."""

    def __init__(self, text: str) -> None:
        self._lines: dict[tuple[str | int, ...], int] = {}
        table: tuple[str | int, ...] = ()
        counts: dict[str, int] = {}
        for number, line in _logical_lines(text):
            if header := _HEADER.match(line):
                names = _split(header[2])
                if header[1] == "[[":
                    index = counts[names[0]] = counts.get(names[0], -1) + 1
                    self._lines.setdefault(names, number)
                    table = (*names, index)
                elif names[0] in counts:  # a table in the last table of an array
                    table = (names[0], counts[names[0]], *names[1:])
                else:
                    table = names
                self._lines.setdefault(table, number)
            elif key := _KEY.match(line):
                self._lines.setdefault((*table, *_split(key[1])), number)

    def find(self, *place: str | int | None) -> int | None:
        """Return the line of a key, such as find("rods", 0, "radius"), or else of the table around it."""
        wanted = [step for step in place if step is not None]
        while wanted:
            if (line := self._lines.get(tuple(wanted))) is not None:
                return line
            wanted.pop()
        return None


def _split(dotted: str) -> tuple[str, ...]:
    parts = re.findall(r"""\s*(?:"((?:[^"\\]|\\.)*)"|'([^']*)'|([^.\s]+))\s*(?:\.|$)""", dotted)
    return tuple(next((part for part in each if part), "") for each in parts)


def _logical_lines(text: str) -> list[tuple[int, str]]:
    """Return the lines at which a statement begins, with their numbers: not those inside arrays and long texts."""
    starts, depth, line = [True], 0, 0
    rows = text.split("\n")
    for match in _TOKEN.finditer(text):
        token = match[0]
        if token == "\n":
            line += 1
            starts.append(depth == 0)
            continue
        if token in "[{" and (depth or not _HEADER.match(rows[line])):
            depth += 1
        elif token in "]}" and depth:
            depth -= 1
        elif token[:3] in ('"""', "'''") or "\n" in token:
            for _ in range(token.count("\n")):
                line += 1
                starts.append(False)
    return [(number + 1, row) for number, row in enumerate(rows) if starts[number]]
