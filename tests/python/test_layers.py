"""No room looks at one below it: C++ includes, CMake targets and Python imports, read from the sources.

The order of the C++ rooms stands once, in cpp/CMakeLists.txt, and what each may see in its own CMakeLists.txt.
In Python, modules of the package must not import each other in a circle, tools must not be imported by the core,
and packages that are extras, or slow to import, must not be imported when withe is.
"""

import ast
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
TOOLS = {"real2sim", "perception", "folding", "deployment", "learning"}
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
    "elastica",
}


def visible_rooms(cpp: Path) -> dict[str, set[str]]:
    """What each room may see, from the DEPENDS of its target."""
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


def imports_when_loaded(tree: ast.Module) -> list[ast.Import | ast.ImportFrom]:
    """Import statements that run when the module is imported: not in functions, not for type checkers only."""
    found: list[ast.Import | ast.ImportFrom] = []
    pending: list[ast.AST] = list(tree.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            pending += node.orelse
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            pending += ast.iter_child_nodes(node)
    return found


def module_imports(package: Path) -> dict[str, set[str]]:
    """Full names that every module of the package imports when it is loaded."""
    modules = {}
    for file in sorted(package.rglob("*.py")):
        parts = (package.name, *file.relative_to(package).with_suffix("").parts)
        name = ".".join(parts).removesuffix(".__init__")
        here = list(parts[:-1])
        names = set()
        for node in imports_when_loaded(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
            else:
                base = here[: len(here) - node.level + 1] if node.level else []
                origin = ".".join(base + ([node.module] if node.module else []))
                names |= {origin} | {f"{origin}.{alias.name}" for alias in node.names}
        modules[name] = names
    return modules


def python_violations(package: Path) -> list[str]:
    """Circles, core modules that import tools, and extras imported too early."""
    modules = module_imports(package)
    found = []
    for name, names in modules.items():
        top = name.split(".")[1] if "." in name else ""
        late = {n.split(".")[0] for n in names} & LATE
        if late and top not in {"learning"}:
            found.append(f"{name} imports {', '.join(sorted(late))} when it is loaded")
        used = {n.split(".")[1] for n in names if n.startswith(package.name + ".")} & TOOLS
        if top and top not in TOOLS and used:
            found.append(f"{name} is core and imports {', '.join(sorted(used))}")
    # The package itself gathers names from all; importing them from it would be a circle of its own.
    graph = {name: {n for n in names if n in modules and n != name} for name, names in modules.items()}
    graph = {name: names - {package.name} for name, names in graph.items() if name != package.name}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        found.append("circle of imports: " + " -> ".join(error.args[1]))
    return found


def test_the_map_of_rooms_is_whole():
    named = re.findall(r"^\| `(\w+)` \|", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    assert named == room_order(ROOT / "cpp")


def test_no_cpp_room_includes_one_that_it_may_not_see():
    assert include_violations(ROOT / "cpp") == []


def test_every_room_sees_only_rooms_above_it():
    order = room_order(ROOT / "cpp")
    visible = visible_rooms(ROOT / "cpp")
    assert sorted(order) == sorted(visible)
    for place, room in enumerate(order):
        assert visible[room] <= set(order[:place]), room


def test_python_modules_import_downwards_and_extras_late():
    assert python_violations(ROOT / "python" / "withe") == []


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
        ("scene.py", "import scipy.sparse\n", "imports scipy"),
        ("scene.py", "from . import perception\n", "is core"),
        ("scene.py", "from withe.simulation import Simulation\n", "circle"),
        ("scene.py", "if True:\n    import torch\n", "imports torch"),
        ("scene.py", "def f():\n    import torch, scipy\n    from . import perception\n", None),
        (
            "scene.py",
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import torch\n",
            None,
        ),
    ],
)
def test_a_forbidden_import_is_found(tmp_path, module, text, problem):
    package = tmp_path / "withe"
    (package / "perception").mkdir(parents=True)
    (package / "__init__.py").write_text("from withe.scene import Scene\n")
    (package / "perception" / "__init__.py").write_text("")
    (package / "simulation.py").write_text("from .scene import Scene\n")
    (package / module).write_text(text)
    violations = python_violations(package)
    if problem is None:
        assert violations == []
    else:
        assert len(violations) == 1
        assert problem in violations[0]
