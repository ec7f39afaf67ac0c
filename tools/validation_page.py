"""Write the tables of docs/validation.md from the tests that are marked as cases.

    python -m pytest tests/physics tests/python -m case --cases docs/cases.json    # measure, about ten minutes
    python tools/validation_page.py                                                # write the tables
    python tools/validation_page.py --check                                        # exit status 1 if they would change

A case is a test with the marker `case(group, title, source=)`. Its row has the error and the order of convergence that
docs/cases.json has for its title. The script reads the tests without running them.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/physics"))

from cases import as_text  # noqa: E402

PAGE = ROOT / "docs" / "validation.md"
FIGURES = ROOT / "docs" / "cases.json"
TESTS = ("tests/physics", "tests/python")
BEGIN, END = "<!-- tables of tools/validation_page.py: begin -->", "<!-- tables of tools/validation_page.py: end -->"
GROUPS = {
    "statics": "Statics",
    "stability": "Stability",
    "dynamics": "Dynamics",
    "bodies": "Rigid bodies",
    "contact": "Contact and friction",
    "knots": "Knots",
    "fluid": "Fluid",
    "actuation": "Actuation",
    "inverse": "Inverse problems",
    "planners": "Planners",
}
ROUNDING = 1e-9  # errors below this differ between machines


@dataclass(frozen=True)
class Case:
    """A test that is marked as a case."""

    group: str
    title: str
    source: str
    file: str
    test: str
    command: str
    exact: bool  # True if the test compares whole numbers or names, which are equal


def find_cases(root: Path = ROOT) -> list[Case]:
    """Return the cases of all tests, by file and line."""
    return [case for folder in TESTS for path in sorted((root / folder).glob("test_*.py")) for case in of(path, root)]


def of(path: Path, root: Path) -> Iterator[Case]:
    """Yield the cases of a file."""
    text = path.read_text()
    if "mark.case(" not in text:
        return
    lines, file = text.splitlines(), str(path.relative_to(root))
    for node in ast.walk(ast.parse(text)):
        for mark in node.decorator_list if isinstance(node, ast.FunctionDef) else []:
            if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.case":
                group, title = (ast.literal_eval(argument) for argument in mark.args)
                words = {word.arg: ast.literal_eval(word.value) for word in mark.keywords}
                rest = "\n".join(lines[: node.decorator_list[0].lineno - 1] + lines[node.end_lineno :])
                run = command(file, node.name, rest)
                yield Case(group, title, words["source"], file, node.name, run, "exact" in words)


def command(file: str, name: str, rest: str) -> str:
    """Return the command that runs a test: by the fewest words of its name that the rest of its file does not have.

    `pytest -k` finds words in the names of tests, parameters, files and folders, in upper or lower case. If the name of
    another test begins with this name, the command excludes a word of that other test.
    """
    words, others = name.split("_")[1:], (rest + file).lower()
    longer = re.findall(rf"\b{name}_(\w+)", others)
    others = re.sub(rf"\b{name}_\w+", "", others)
    excluded = "".join(f" and not {max(more.split('_'), key=len)}" for more in longer)
    for count in range(1, len(words) + 1):
        found = ["_".join(words[i : i + count]) for i in range(len(words) - count + 1)]
        found = [text for text in found if len(text) > 3 and text not in others]
        if found:
            chosen = max(found, key=len) + excluded
            return f"python -m pytest {file} -k " + (f'"{chosen}"' if excluded else chosen)
    return f"python -m pytest {file}::{name}"


def number(value: float) -> str:
    """Return a number with two digits, and with an exponent where that is shorter."""
    if 0.01 <= abs(value) < 1000.0:
        return f"{value:.2g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa.removesuffix('.0')}e{int(exponent)}"


def error_of(case: Case, figures: dict[str, Any]) -> str:
    """Return the error of a case as the page has it."""
    error, unit = figures["error"], figures["unit"]
    if case.exact or error is None:
        return "equal" if case.exact else "-"
    if not unit and error < ROUNDING:
        return "rounding"
    return f"{number(error)} {unit}".rstrip()


def order_of(figures: dict[str, Any]) -> str:
    """Return the order of convergence of a case, or the range of orders of its parameters."""
    if not figures["orders"]:
        return "-"
    least, greatest = figures["orders"]
    return f"{least:.1f}" if greatest - least < 0.5 else f"{least:.1f} to {greatest:.1f}"


def tables(cases: list[Case], figures: dict[str, dict[str, Any]]) -> str:
    """Return the tables of all groups in Markdown."""
    lines: list[str] = []
    for group, heading in GROUPS.items():
        rows = [case for case in cases if case.group == group]
        if not rows:
            continue
        lines += ["", f"### {heading}", "", "| case | source | error | order | command |", "|---|---|---|---|---|"]
        for case in rows:
            found = figures.get(case.title, {"error": None, "unit": "", "orders": None})
            cells = (case.title, case.source, error_of(case, found), order_of(found), f"`{case.command}`")
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n\n"


def page(text: str, cases: list[Case], figures: dict[str, dict[str, Any]]) -> str:
    """Return the text of the page with new tables."""
    head, rest = text.split(BEGIN)
    _, tail = rest.split(END)
    text = re.sub(r"\b\d+ cases\b", f"{len(cases)} cases", head)
    return f"{text}{BEGIN}\n{tables(cases, figures)}{END}{tail}"


def main() -> int:
    """Write or check the page, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="change nothing; exit status 1 if the page would change")
    arguments = parser.parse_args()
    cases = find_cases()
    figures = json.loads(FIGURES.read_text())
    titles = {case.title for case in cases}
    for title in sorted(titles - set(figures)):
        print(f"no figures of {title!r}: run its test with --cases {FIGURES.relative_to(ROOT)}")
    for title in sorted(set(figures) - titles):
        print(f"no test of {title!r}: its figures are {'left over' if arguments.check else 'removed'}")
    kept = {title: found for title, found in figures.items() if title in titles}
    new = page(PAGE.read_text(), cases, kept)
    if arguments.check:
        return int(titles != set(figures) or new != PAGE.read_text())
    FIGURES.write_text(as_text(kept))
    PAGE.write_text(new)
    print(f"{len(cases)} cases in {PAGE.relative_to(ROOT)}")
    return int(not titles <= set(kept))


if __name__ == "__main__":
    sys.exit(main())
