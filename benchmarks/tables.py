"""Write the tables of the last run of each benchmark to ``benchmarks/README.md``.

    python benchmarks/tables.py

Reads ``out/benchmarks/*.json``, leaves out short forms, and keeps what the page has of benchmarks that were not run.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import peers_picture
from reporting import OUT

PAGE = Path(__file__).with_name("README.md")
NOT_SHOWN = ("Fronts",)  # dozens of rows: the plot shows them
PICTURES = {  # of the folder pictures, by benchmark: what they show
    "peers": "Run time against error in six scenes, for withe, PyElastica and MuJoCo",
    "work_precision": "Error of the tip against run time for beams and helices: every integrator, and PyElastica",
}
HEAD = """# Benchmarks

`make bench` runs all of these, `make bench NAME=skips` one; each leaves figures, spread, machine and goals in
`out/benchmarks`. `python benchmarks/tables.py` writes this page from there. Times are processor times of one thread,
medians of interleaved runs; spread is half the distance between quartiles over the median.
"""


def _cells(row: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"


def _table(rows: list[list[str]]) -> str:
    return "\n".join([_cells(rows[0]), "|" + "---|" * len(rows[0]), *map(_cells, rows[1:])])


def picture(name: str) -> str:
    """Return the picture of a benchmark as Markdown."""
    return f"![{PICTURES[name]}](pictures/{name}.png)"


def section(content: dict) -> str:
    """One benchmark as Markdown."""
    machine = content["machine"]
    lines = [
        f"## {content['name']}",
        "",
        f"{machine['processor']}, {machine['processors']} processors; {content['compiler']}; withe "
        f"{content['versions']['withe']}, Python {content['versions']['python']}; `{content['command']}`, "
        f"{content['date'][:10]}, took {content['took']:.0f} s.",
        "",
    ]
    if content["name"] in PICTURES:
        lines += [picture(content["name"]), ""]
    for title, rows in content["tables"].items():
        if not title.startswith(NOT_SHOWN) and len(rows) > 1:
            lines += [f"**{title}**", "", _table(rows), ""]
    goals = [["goal", "value", "target", ""]]
    for goal in content["goals"]:
        value = "not measured" if goal["value"] is None else f"{goal['value']:.4g}"
        goals.append([goal["name"], value, f"{goal['sign']} {goal['target']:g}", "met" if goal["met"] else "not met"])
    return "\n".join([*lines, _table(goals), ""])


def main() -> None:
    """Replace the sections of the benchmarks that have been run."""
    old = PAGE.read_text() if PAGE.exists() else HEAD
    sections = {match[1]: match[0] for match in re.finditer(r"^## (\w+)\n.*?(?=^## |\Z)", old, re.M | re.S)}
    for path in sorted(OUT.glob("*.json")):
        content = json.loads(path.read_text())
        if not content["quick"]:
            sections[content["name"]] = section(content)
    PAGE.write_text("\n".join([HEAD, *(sections[name].rstrip() + "\n" for name in sorted(sections))]))
    peers_picture.draw(PAGE.read_text())
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
