"""No room looks at one below it: C++ includes, CMake targets and Python imports, read from the sources.

The order of the C++ rooms stands once, in cpp/CMakeLists.txt, and what each may see in its own CMakeLists.txt.
That of the Python rooms, folders of the package and modules beside them, is the table of CONTRIBUTING.md. Imports in
functions count too: only packages that are extras, or slow to import, are imported there, and must be.
"""

import ast
import inspect
import re
import textwrap
from abc import ABC
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import withe

ROOT = Path(__file__).resolve().parent.parent.parent
FOR_TYPES_ONLY: dict[tuple[str, str], str] = {}  # (module, what it imports so): why that cannot be avoided
LATE = {
    "scipy",
    "matplotlib",
    "pyvista",
    "vtk",
    "imageio_ffmpeg",
    "IPython",
    "torch",
    "cv2",
    "dask",
    "pxr",
    "pygltflib",
    "elastica",
    "gymnasium",
    "stable_baselines3",
    "mujoco",
}


def visible_rooms(cpp: Path) -> dict[str, set[str]]:
    """Rooms that each room may see, from the DEPENDS of its target."""
    rooms = {}
    for file in sorted(cpp.glob("*/CMakeLists.txt")):
        declared = re.search(r"withe_room\((\w+)\s+DEPENDS([^)]*)\)", file.read_text())
        assert declared, f"{file} has no withe_room(... DEPENDS ...)"
        rooms[declared[1]] = {word for word in declared[2].split() if re.fullmatch("[a-z]+", word)}
    return rooms


def room_order(cpp: Path) -> list[str]:
    """Rooms from top to bottom."""
    match = re.search(r"set\(WITHE_ROOMS ([a-z ]+)\)", (cpp / "CMakeLists.txt").read_text())
    assert match, "cpp/CMakeLists.txt does not state WITHE_ROOMS"
    return match[1].split()


def include_violations(cpp: Path) -> list[str]:
    """Includes of rooms that the including room may not see."""
    visible = visible_rooms(cpp)
    found = []
    for file in sorted(cpp.glob("*/**/*.[ch]pp")):
        room = file.relative_to(cpp).parts[0]
        for target in re.findall(r'^\s*#include "([^"]+)"', file.read_text(), re.MULTILINE):
            other = target.split("/")[0]
            if not (cpp / target).is_file():
                found.append(f"{file.relative_to(cpp)} includes {target}, which is no file of cpp/")
            elif other != room and other not in visible[room]:
                found.append(f"{file.relative_to(cpp)} includes {target}: {room} may not see {other}")
    return found


@dataclass(frozen=True)
class Import:
    """One import statement: the full names that it asks for, and when it runs."""

    names: frozenset[str]
    late: bool  # in a function
    typing_only: bool


def imports_of(file: Path, package: Path) -> list[Import]:
    """All import statements of a module, those in functions and for type checkers included."""
    here = [package.name, *file.relative_to(package).parts[:-1]]
    found = []
    pending: list[tuple[ast.AST, bool, bool]] = [(ast.parse(file.read_text()), False, False)]
    while pending:
        node, late, typing_only = pending.pop()
        if isinstance(node, ast.Import):
            found.append(Import(frozenset(alias.name for alias in node.names), late, typing_only))
        elif isinstance(node, ast.ImportFrom):
            base = here[: len(here) - node.level + 1] if node.level else []
            origin = ".".join(base + ([node.module] if node.module else []))
            found.append(Import(frozenset(f"{origin}.{alias.name}" for alias in node.names), late, typing_only))
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            pending += [(child, late, True) for child in node.body]
            pending += [(child, late, typing_only) for child in node.orelse]
        else:
            late = late or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            pending += [(child, late, typing_only) for child in ast.iter_child_nodes(node)]
    return found


def module_files(package: Path) -> dict[str, Path]:
    """Files by the full names of their modules; the package itself, which gathers names from all, is left out."""
    files = {}
    for file in sorted(package.rglob("*.py")):
        parts = (package.name, *file.relative_to(package).with_suffix("").parts)
        files[".".join(parts).removesuffix(".__init__")] = file
    files.pop(package.name, None)
    return files


def module_of(name: str, modules: dict[str, Path]) -> str | None:
    """The module of the package that an imported name is, or is in."""
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name or None


def python_violations(package: Path, rooms: list[str]) -> list[str]:
    """Rooms that look at one below them, circles, own modules imported late, and extras imported early."""
    modules = module_files(package)
    graph: dict[str, set[str]] = {}
    found = []
    for name, file in modules.items():
        room = name.split(".")[1]
        if room not in rooms:
            found.append(f"{name} is in no room: the map of CONTRIBUTING.md has {', '.join(rooms)}")
            continue
        for statement in imports_of(file, package):
            early = {n.split(".")[0] for n in statement.names} & LATE
            if early and not statement.late and not statement.typing_only:
                found.append(f"{name} imports {', '.join(sorted(early))} when it is loaded")
            for own in {module_of(n, modules) for n in statement.names} - {None, name}:
                if statement.late:
                    found.append(f"{name} imports {own} in a function")
                if statement.typing_only and (name, own) not in FOR_TYPES_ONLY:
                    found.append(
                        f"{name} imports {own} for type checkers only, and FOR_TYPES_ONLY has no reason for it"
                    )
                if statement.typing_only:
                    continue
                other = own.split(".")[1]
                if other in rooms and rooms.index(other) > rooms.index(room):
                    found.append(f"{name} imports {own}: {other} stands below {room}")
                if not name.startswith(own + "."):  # a folder that gathers names has been entered already
                    graph.setdefault(name, set()).add(own)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        found.append("circle of imports: " + " -> ".join(error.args[1]))
    return found


def rooms_of(language: str) -> list[str]:
    """Rooms of a table of CONTRIBUTING.md, from top to bottom."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    table = re.search(rf"^\| room of `{language}` \|.*\n\|---.*\n((?:\|.*\n)+)", text, re.MULTILINE)
    assert table, f"CONTRIBUTING.md has no table of the rooms of {language}"
    return [room for line in table[1].splitlines() for room in re.findall(r"`(\w+)`", line.split("|")[1])]


def private_attributes(cls: type) -> set[str]:
    """Private attributes of `self` that the methods of a class use."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(cls)))
    return {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "self"
        and node.attr.startswith("_")
    }


def test_the_map_of_rooms_is_whole():
    assert rooms_of("cpp/") == room_order(ROOT / "cpp")
    package = ROOT / "python" / "withe"
    assert sorted(rooms_of("python/withe/")) == sorted({name.split(".")[1] for name in module_files(package)})


def test_no_cpp_room_includes_one_that_it_may_not_see():
    assert include_violations(ROOT / "cpp") == []


def test_every_room_sees_only_rooms_above_it():
    order = room_order(ROOT / "cpp")
    visible = visible_rooms(ROOT / "cpp")
    assert sorted(order) == sorted(visible)
    for place, room in enumerate(order):
        assert visible[room] <= set(order[:place]), room


def test_python_rooms_see_only_rooms_above_them_and_import_extras_late():
    assert python_violations(ROOT / "python" / "withe", rooms_of("python/withe/")) == []


@pytest.mark.parametrize(
    ("public", "shared"),
    [
        (withe.Scene, {"_directory", "_bearer"}),
        (withe.Simulation, {"_session", "_bearer"}),
        (withe.Batch, {"_lanes"}),
    ],
)
def test_what_a_public_class_is_made_of_shares_one_object(public, shared):
    for cls in public.__bases__:
        assert set(cls.__bases__) <= {object, ABC}, f"{cls.__name__} stands on {cls.__bases__}"
        assert len(private_attributes(cls)) == 1, cls.__name__
        assert private_attributes(cls) <= shared, cls.__name__


def test_bindings_hold_no_numerics():
    for file in sorted((ROOT / "python" / "bindings").glob("*.?pp")):
        assert "std::sqrt" not in file.read_text(), f"{file.name} computes: that belongs into cpp/"


@pytest.mark.parametrize(
    ("include", "problem"),
    [
        ('#include "solvers/linear_solver.hpp"', "may not see solvers"),
        ('#include "missing/file.hpp"', "no file of cpp/"),
    ],
)
def test_a_forbidden_include_is_found(tmp_path, include, problem):
    for room, depends in {"common": "Eigen3::Eigen", "solvers": "common"}.items():
        (tmp_path / room).mkdir()
        (tmp_path / room / "CMakeLists.txt").write_text(f"withe_room({room} DEPENDS {depends})")
    (tmp_path / "solvers" / "linear_solver.hpp").write_text("#pragma once\n")
    (tmp_path / "common" / "check.hpp").write_text(f"#pragma once\n{include}\n")
    (violation,) = include_violations(tmp_path)
    assert problem in violation


@pytest.mark.parametrize(
    ("module", "text", "problem"),
    [
        ("scene/scene.py", "import scipy.sparse\n", "imports scipy"),
        ("scene/scene.py", "if True:\n    import torch\n", "imports torch"),
        ("scene/scene.py", "def f():\n    import torch, scipy\n", None),
        ("scene/scene.py", "from .. import view\n", "view stands below scene"),
        ("scene/scene.py", "from withe.scene import rods\nfrom withe.io import save\n", None),
        ("scene/scene.py", "from withe.view import picture\n", "view stands below scene"),
        ("scene/scene.py", "def f():\n    from withe.io import save\n", "in a function"),
        ("scene/rods.py", "from withe.scene.scene import Scene\n", "circle"),
        (
            "io.py",
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from withe import view\n",
            "type checkers only",
        ),
        ("io.py", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import torch\n", None),
        ("films.py", "", "in no room"),
    ],
)
def test_a_forbidden_import_is_found(tmp_path, module, text, problem):
    package = tmp_path / "withe"
    for file, content in {
        "__init__.py": "from withe.scene import Scene\n",
        "io.py": "def save(): ...\n",
        "scene/__init__.py": "from withe.scene.scene import Scene\n",
        "scene/rods.py": "",
        "scene/scene.py": "from .rods import Rod\n",
        "view/__init__.py": "from withe.view.pictures import picture\n",
        "view/pictures.py": "from withe import io\n",
    }.items():
        (package / file).parent.mkdir(parents=True, exist_ok=True)
        (package / file).write_text(content)
    with (package / module).open("a") as stream:
        stream.write(text)
    violations = python_violations(package, ["io", "scene", "view"])
    if problem is None:
        assert violations == []
    else:
        assert len(violations) == 1
        assert problem in violations[0]
