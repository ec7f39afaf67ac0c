"""Check that the reference is complete: every public name has a page, and every public docstring is complete.

`python tools/reference_check.py` prints the faults of each kind and fails if there are any. The kinds:

- page: a public module without a page, or a class that a public function returns and that has no page. Also a name such
  as `withe.view.plot`, in a docstring or on a page of docs/, that the reference lacks.
- docstring: a public function, class, method or property without a docstring
- parameter: an argument that is not under Parameters, or an entry there that is no argument. A method that overrides a
  method of a public class with the same arguments may leave its arguments and its result to that method.
- returns: a function that returns a value and has neither Returns nor Yields
- raises: an exception that the function raises itself, or by a function of the package that it calls, and Raises lacks
- unit: a number without a unit in brackets, such as [m] or [-], and without a shape
"""

from __future__ import annotations

import ast
import enum
import importlib
import inspect
import re
import sys
import textwrap
import types
import typing
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "docs"))

import pages

PACKAGE = "withe"
VALIDATION = "withe.common.validation"
SECTIONS = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Examples", "See Also", "Notes", "References")
# Words of the type of an entry that stand for numbers with a unit or a shape. Whole numbers have neither.
FLOATING = re.compile(r"\b(float|floats|number|numbers|array_like|arrays?|ndarray)\b")
FLOATING_ANNOTATION = re.compile(r"\b(float|floating\w*|ArrayLike|NDArray|\w*Array|ndarray)\b")
UNIT_OR_SHAPE = re.compile(r"\[[^\]]+\]|\bshape\b|\bshapes\b")


class Fault(NamedTuple):
    """A fault of a docstring."""

    kind: str
    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.where}: {self.what}"


@dataclass(frozen=True)
class Entry:
    """An entry of a section: its names, its type and its description."""

    names: tuple[str, ...]
    type: str
    text: str


class Docstring:
    """A numpydoc docstring, split into its summary and its sections."""

    def __init__(self, text: str) -> None:
        lines = inspect.cleandoc(text).splitlines()
        starts = [
            place
            for place, line in enumerate(lines[:-1])
            if line and not line.startswith(" ") and re.fullmatch(r"-{3,}", lines[place + 1])
        ]
        self.summary = "\n".join(lines[: starts[0] if starts else len(lines)])
        ends = [*starts[1:], len(lines)]
        self._sections = {lines[i].strip(): lines[i + 2 : end] for i, end in zip(starts, ends, strict=False)}

    def __contains__(self, section: str) -> bool:
        return section in self._sections

    def text(self, *sections: str) -> str:
        """Return the text of sections."""
        return "\n".join(line for section in sections for line in self._sections.get(section, []))

    def entries(self, *sections: str) -> list[Entry]:
        """Return the entries of sections: lines without indentation, each with the indented lines below it."""
        found: list[Entry] = []
        for line in self.text(*sections).splitlines():
            if line.startswith(" ") or not line.strip():
                if found:
                    found[-1] = Entry(found[-1].names, found[-1].type, f"{found[-1].text}\n{line.strip()}")
                continue
            names, _, kind = line.partition(" : ")
            found.append(Entry(tuple(name.strip().lstrip("*") for name in names.split(",")), kind.strip(), ""))
        return found


@dataclass(frozen=True)
class Subject:
    """A public class, function, method or property, and the method of a public class that it overrides."""

    where: str
    value: Any
    overridden: tuple[str, Any] | None = None

    @cached_property
    def doc(self) -> Docstring:
        """Its docstring."""
        return Docstring(inspect.getdoc(self.value) or "")

    @property
    def function(self) -> Callable[..., Any] | None:
        """The function whose body is checked; None for a class without a constructor of its own."""
        value = self.value
        if isinstance(value, property):
            return value.fget
        if isinstance(value, cached_property):
            return value.func
        if isinstance(value, type):
            for name in ("__init__", "__post_init__"):
                if own := defined_in_package(value, name):
                    return own
            return None
        return getattr(value, "__func__", value)


def defined_in_package(owner: type, name: str) -> Any:
    """Return an attribute that the package defines on a class; None if there is none."""
    for each in owner.__mro__:
        if name in vars(each):
            found = vars(each)[name]
            own = each.__module__.partition(".")[0] == PACKAGE
            made = is_dataclass(each) and name == "__init__"
            return found if own and not made else None
    return None


def subjects(names: Iterable[tuple[str, str]]) -> Iterator[Subject]:
    """Yield the public names and the public members of public classes, each once."""
    seen: set[int] = set()
    for module, name in names:
        value = getattr(importlib.import_module(module), name)
        if isinstance(value, type):
            yield Subject(f"{module}.{name}", value)
            for member, found in pages.members(value):
                key = id(getattr(found, "__func__", found))
                if key not in seen:
                    seen.add(key)
                    yield Subject(f"{module}.{name}.{member}", found, pages.overridden(value, member))
        elif inspect.isroutine(value):
            yield Subject(f"{module}.{name}", value)


def signature_names(subject: Subject) -> list[str] | None:
    """Return the arguments that must be documented; None if the subject has no arguments of its own."""
    value = subject.value
    if isinstance(value, property | cached_property) or subject.where in pages.MADE_BY:
        return None
    if isinstance(value, type):
        if issubclass(value, enum.Enum):
            return None
        constructor = defined_in_package(value, "__init__")
        if constructor is not None:
            return arguments(constructor)
        if is_dataclass(value):
            return [each.name for each in fields(value) if not each.name.startswith("_")]
        return list(getattr(value, "_fields", [])) or None
    return arguments(getattr(value, "__func__", value))


def arguments(function: Callable[..., Any]) -> list[str]:
    """Return the names of the arguments of a function."""
    names = inspect.signature(function).parameters
    return [name for name in names if name not in ("self", "cls") and not name.startswith("_")]


@cache
def tree_of(function: Callable[..., Any]) -> ast.FunctionDef | None:
    """Return the syntax tree of a function; None without source."""
    try:
        found = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(function)))).body[0]
    except (OSError, TypeError, SyntaxError):
        return None
    return found if isinstance(found, ast.FunctionDef) else None


def body_of(function: Callable[..., Any]) -> list[ast.stmt]:
    """Return the statements of a function without its docstring."""
    tree = tree_of(function)
    if tree is None:
        return []
    text = isinstance(tree.body[0], ast.Expr) and isinstance(tree.body[0].value, ast.Constant)
    return tree.body[1:] if text else tree.body


def outer_nodes(statements: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yield the nodes of statements, without those of inner functions, and without what a `try` catches."""
    for node in statements:
        if isinstance(node, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            continue
        yield node
        if isinstance(node, ast.Try) and node.handlers:
            yield from outer_nodes([*node.handlers, *node.orelse, *node.finalbody])
        else:
            yield from outer_nodes(ast.iter_child_nodes(node))


@cache
def raised(function: Callable[..., Any], depth: int) -> frozenset[str]:
    """Return the exceptions that a function raises by itself, and by functions of the package that it calls."""
    found: set[str] = set()
    known = getattr(inspect.unwrap(function), "__globals__", {})
    for node in outer_nodes(body_of(function)):
        if isinstance(node, ast.Raise) and node.exc is not None:
            name = ast.unparse(node.exc.func if isinstance(node.exc, ast.Call) else node.exc).rpartition(".")[2]
            value = known.get(name) or vars(__import__("builtins")).get(name)
            if isinstance(value, type):
                found.add(name)
        elif isinstance(node, ast.Call) and depth > 0:
            called = resolve(node.func, known)
            if isinstance(called, types.FunctionType) and called.__module__.partition(".")[0] == PACKAGE:
                found |= raised(called, depth - 1)
    return frozenset(found - {"AssertionError", "StopIteration"})


def resolve(node: ast.expr, known: dict[str, Any]) -> Any:
    """Return the value of a name, or of an attribute of a module, in the globals of a function."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        owner = known.get(node.value.id)
        return getattr(owner, node.attr, None) if isinstance(owner, types.ModuleType) else None
    return None


def annotation_of(subject: Subject, name: str) -> str:
    """Return the annotation of an argument or a field as text."""
    value = subject.value
    function = subject.function
    if isinstance(value, type) and (defined_in_package(value, "__init__") is None):
        for each in value.__mro__:
            if name in vars(each).get("__annotations__", {}):
                return str(vars(each)["__annotations__"][name])
        return ""
    if function is None:
        return ""
    found = inspect.signature(function).parameters.get(name)
    return "" if found is None or found.annotation is found.empty else annotation_text(found.annotation)


def annotation_text(annotation: Any) -> str:
    """Return an annotation as it is written."""
    return annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)


def return_annotation(function: Callable[..., Any]) -> str:
    """Return the annotation of the result of a function as text."""
    found = inspect.signature(function).return_annotation
    return "" if found is inspect.Signature.empty else annotation_text(found)


def faults_of(subject: Subject) -> Iterator[Fault]:
    """Yield the faults of one docstring."""
    where, doc, value = subject.where, subject.doc, subject.value
    if not doc.summary:
        yield Fault("docstring", where, "no docstring")
        return
    is_class = isinstance(value, type)
    is_property = isinstance(value, property | cached_property)
    documented = doc.entries("Parameters", "Attributes") if is_class else doc.entries("Parameters")
    names = [name for entry in documented for name in entry.names]
    expected = signature_names(subject)
    inherits = subject.overridden is not None and arguments(subject.overridden[1]) == expected
    if where in pages.MADE_BY and pages.MADE_BY[where] not in (inspect.getdoc(value) or ""):
        yield Fault("docstring", where, f"does not name {pages.MADE_BY[where]}, which makes it")
    if expected is not None:
        for name in expected:
            if name not in names and not inherits:
                yield Fault("parameter", where, f"argument {name!r} is not documented")
        allowed = {*expected}
        for entry in doc.entries("Parameters"):
            for name in entry.names:
                if name not in allowed:
                    yield Fault("parameter", where, f"{name!r} is under Parameters and is not an argument")
    for entry in documented:
        if is_numeric(entry, subject) and not UNIT_OR_SHAPE.search(entry.type):
            yield Fault("unit", where, f"{', '.join(entry.names)} : {entry.type} has neither unit nor shape")
    function = subject.function
    if function is None or where in pages.MADE_BY:
        return
    if is_property:
        if FLOATING_ANNOTATION.search(return_annotation(function)) and not UNIT_OR_SHAPE.search(doc.summary):
            yield Fault("unit", where, "property has neither unit nor shape")
    elif not is_class:
        result = return_annotation(function)
        nothing = result in ("None", "NoReturn", "Never") or inherits
        if not nothing and "Returns" not in doc and "Yields" not in doc:
            yield Fault("returns", where, f"returns {result}")
        for entry in doc.entries("Returns", "Yields"):
            line = f"{', '.join(entry.names)} : {entry.type}"
            if FLOATING.search(line) and not UNIT_OR_SHAPE.search(f"{line} {entry.text}"):
                yield Fault("unit", where, f"result {line.removesuffix(' : ')} has neither unit nor shape")
    section = "\n".join(", ".join(entry.names) for entry in doc.entries("Raises"))
    for name in sorted(raised(function, DEPTH)):
        if name not in section:
            yield Fault("raises", where, f"{name} is not under Raises")


DEPTH = 3
"""Calls of functions of the package that are followed in search of exceptions."""


def is_numeric(entry: Entry, subject: Subject) -> bool:
    """Return True if an entry is a number with a fraction or an array, by its type or by its annotation."""
    if not entry.type:
        return False
    if FLOATING.search(entry.type):
        return True
    annotations = [annotation_of(subject, name) for name in entry.names]
    return any(FLOATING_ANNOTATION.search(each) and "Callable" not in each for each in annotations)


def result_classes(subject: Subject) -> Iterator[type]:
    """Yield the classes of the package that a function or a property returns."""
    function = subject.function
    if function is None or isinstance(subject.value, type):
        return
    function = inspect.unwrap(function)
    stack = [eval(return_annotation(function) or "None", vars(typing) | function.__globals__)]
    while stack:
        each = stack.pop()
        if isinstance(each, type) and not typing.get_args(each):
            if each.__module__.partition(".")[0] == PACKAGE:
                yield each
        else:
            stack += typing.get_args(each)


def page_faults(names: list[tuple[str, str]]) -> Iterator[Fault]:
    """Yield public modules, and classes of results of public functions, that the reference lacks."""
    package = importlib.import_module(PACKAGE)
    for name in package.__all__:
        if inspect.ismodule(getattr(package, name)) and f"{PACKAGE}.{name}" not in pages.MODULES:
            yield Fault("page", f"{PACKAGE}.{name}", "public module without a page")
    described = {id(getattr(importlib.import_module(module), name)) for module, name in names}
    missing: dict[type, str] = {}
    for subject in subjects(names):
        for each in result_classes(subject):
            if id(each) not in described:
                missing.setdefault(each, subject.where)
    for each, where in missing.items():
        yield Fault("page", f"{each.__module__}.{each.__qualname__}", f"{where} returns it, and it has no page")


def named_faults(names: list[tuple[str, str]]) -> Iterator[Fault]:
    """Yield names in public docstrings and on pages of docs/ that the reference lacks."""
    known = {*pages.MODULES, PACKAGE}
    for module, name in names:
        value = getattr(importlib.import_module(module), name)
        known |= {f"{module}.{name}"} | {f"{module}.{name}.{member}" for member in dir(value)}
    texts = {subject.where: inspect.getdoc(subject.value) or "" for subject in subjects(names)}
    for path in [pages.ROOT / "README.md", *(pages.ROOT / "docs").rglob("*.md")]:
        if pages.GENERATED not in path.parts:
            texts[str(path.relative_to(pages.ROOT))] = re.sub(r"```.*?```", "", path.read_text(), flags=re.DOTALL)
    for where, text in texts.items():
        for name in re.findall(rf"`({PACKAGE}\.[\w.]*\w)(?:\(.*?\))?`", text):
            if name not in known:
                yield Fault("page", where, f"names {name}, which has no page")


def public() -> list[tuple[str, str]]:
    """Return module and name of every public name."""
    return [(module, name) for module in pages.MODULES for name in pages.public_names(module)]


def faults() -> list[Fault]:
    """Return all faults of the reference."""
    names = public()
    return [
        *page_faults(names),
        *named_faults(names),
        *(fault for subject in subjects(names) for fault in faults_of(subject)),
    ]


def main() -> None:
    """Print the faults, and their number by kind."""
    found = faults()
    for fault in found:
        print(fault)
    count = Counter(fault.kind for fault in found)
    print(
        f"{sum(1 for _ in subjects(public()))} docstrings;",
        ", ".join(f"{n} {k}" for k, n in count.items()) or "no faults",
    )
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
