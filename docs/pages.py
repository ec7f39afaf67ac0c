"""Pages that are made of other files: one for each public name, each room of the engine and each benchmark."""

import importlib
import inspect
import json
import re
from pathlib import Path

MODULES = {
    "withe": "Scenes, simulations and records",
    "withe.learning": "Learning: functions of torch, environments, policies",
    "withe.real2sim": "Real to sim: fits to pictures and motions",
    "withe.perception": "Perception: cables and tags in pictures",
    "withe.folding": "Folding of paper",
    "withe.deployment": "Laying of cables",
    "withe.knots": "Knots",
    "withe.shapes": "Shapes of centrelines",
    "withe.view": "Pictures and films",
}
ROOT = Path(__file__).resolve().parent.parent
GENERATED = "generated"


def public_names(module: str) -> list[str]:
    """Return the public names of a module that are not modules themselves, sorted."""
    found = importlib.import_module(module)
    return sorted(
        name for name in found.__all__ if not name.startswith("_") and not inspect.ismodule(getattr(found, name))
    )


def reference(folder: Path) -> None:
    """Write one page for each module, and one for each public name in it."""
    index = ["# Reference", "", "Every public name. Units are SI, angles are in radians.", ""]
    index += ["```{toctree}", ":maxdepth: 1", ""]
    for module, title in MODULES.items():
        index.append(f"{title} <{module}>")
        names = public_names(module)
        lines = [f"# {title}", "", f"Module `{module}`.", "", "```{eval-rst}", ".. currentmodule:: " + module, ""]
        lines += [".. autosummary::", ""]
        lines += [f"   {name}" for name in names]
        lines += ["```", "", "```{toctree}", ":hidden:", ""]
        lines += [f"{module}.{name}" for name in names]
        put(folder / f"{module}.md", [*lines, "```"])
        for name in names:
            put(folder / f"{module}.{name}.md", name_page(module, name))
    index.append("Keys of a scene file <scene_file>")
    put(folder / "scene_file.md", scene_file_page())
    put(folder / "index.md", [*index, "```"])


def scene_file_page() -> list[str]:
    """Return the page of the keys of scene files, from their JSON schema."""
    schema = json.loads((ROOT / "python/withe/scene/scene.schema.json").read_text(encoding="utf-8"))
    lines = ["# Keys of a scene file", "", "How to write one: [Scenes in files](../../how_to/scene_files.md).", ""]
    tables = [("[materials.NAME]", schema["$defs"]["material"])]
    for name, content in schema["properties"].items():
        kinds = content.get("items", {}).get("anyOf", [content.get("items", {})])
        if "properties" in kinds[0]:
            tables += [(f"[[{name}]]", each) for each in kinds]
        elif "properties" in content:
            tables.append((f"[{name}]", content))
    for title, content in tables:
        keys = content["properties"]
        kind = keys.get("kind", {}).get("const")
        lines += [f"## `{title}`" + (f", kind {kind!r}" if kind else ""), ""]
        lines += ["| key | needed | meaning |", "|---|---|---|"]
        for key, value in keys.items():
            if key != "kind" or not kind:
                needed = "yes" if key in content.get("required", ()) else ""
                text = value.get("description", "").replace("|", "\\|").replace("*", "\\*")
                choices = ", ".join(f'`"{each}"`' for each in value.get("enum", ()))
                lines.append(f"| `{key}` | {needed} | {text or choices} |")
        lines.append("")
    return lines


def name_page(module: str, name: str) -> list[str]:
    """Return the page of a public name."""
    value = getattr(importlib.import_module(module), name)
    lines = [f"# {module}.{name}", "", "```{eval-rst}", f".. currentmodule:: {module}", ""]
    if inspect.isclass(value):
        bases = "Env, Exception, VectorEnv, object, tuple"  # whose members are documented elsewhere
        lines += [f".. autoclass:: {name}", "   :members:", f"   :inherited-members: {bases}"]
    else:
        lines += [f".. autofunction:: {name}" if inspect.isroutine(value) else f".. autodata:: {name}"]
    return [*lines, "```"]


def rooms(folder: Path) -> None:
    """Write a page for each room of the engine, from its README."""
    order = re.search(r"set\(WITHE_ROOMS ([a-z ]+?)(?: PARENT_SCOPE)?\)", (ROOT / "cpp/CMakeLists.txt").read_text())
    assert order
    names = [name for name in order.group(1).split() if (ROOT / "cpp" / name / "README.md").exists()]
    for name in names:
        put(folder / f"{name}.md", (ROOT / "cpp" / name / "README.md").read_text().splitlines())
    lines = ["# Theory", "", "One page for each room of the engine, with its equations and sources."]
    put(folder / "index.md", [*lines, "", "```{toctree}", ":maxdepth: 1", "", *names, "```"])


def benchmarks(folder: Path) -> None:
    """Write a page for each benchmark, from the sections of benchmarks/README.md."""
    text = (ROOT / "benchmarks/README.md").read_text().replace("](pictures/", "](../../../benchmarks/pictures/")
    head, *sections = text.split("\n## ")
    names = []
    for section in sections:
        title, _, body = section.partition("\n")
        names.append(title)
        put(folder / f"{title}.md", [f"# {title}", *body.replace("\n### ", "\n## ").splitlines()])
    put(folder / "index.md", [*head.splitlines(), "", "```{toctree}", ":maxdepth: 1", "", *names, "```"])


def put(path: Path, lines: list[str]) -> None:
    """Write a page unless the file has that text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = "\n".join(lines) + "\n"
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def write(folder: Path) -> None:
    """Write all generated pages into docs/generated."""
    reference(folder / GENERATED / "reference")
    rooms(folder / GENERATED / "theory")
    benchmarks(folder / GENERATED / "benchmarks")
