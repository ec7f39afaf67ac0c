"""Pages made of other files: for each public name, room of the engine, benchmark, example and notebook."""

import ast
import hashlib
import importlib
import inspect
import json
import re
import types
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import withe

MODULES = {
    "withe": "Scenes, simulations and records",
    "withe.learning": "Learning: functions of torch, environments, policies",
    "withe.real2sim": "Real to sim: fits to pictures and motions",
    "withe.perception": "Perception: cables and tags in pictures",
    "withe.folding": "Folding of paper",
    "withe.deployment": "Laying of cables",
    "withe.knots": "Knots",
    "withe.shapes": "Shapes of centrelines",
    "withe.solids": "Solids of rigid bodies",
    "withe.view": "Pictures and films",
    "withe.view.style": "Style of plots",
    "withe.io": "Files of poses and frames",
}
# Names for users of a module that is also for other modules of the package.
FOR_USERS = {"withe.io": ("load_poses", "save_poses", "write_vtk")}
# Classes whose objects come from a function, which their docstring names. Their constructors are not for users.
MADE_BY = {
    "withe.Body": "Scene.add_body",
    "withe.BodyPoint": "Body.at",
    "withe.CustomForce": "Scene.add_custom_force",
    "withe.Drag": "Scene.add_drag",
    "withe.EdgeHandle": "Rod.edge",
    "withe.Fluid": "Scene.add_fluid",
    "withe.Hand": "Scene.grasp",
    "withe.Joint": "Scene.join",
    "withe.Load": "Scene.add_force",
    "withe.Mass": "Scene.add_mass",
    "withe.NodeHandle": "Rod.node",
    "withe.Obstacle": "Scene.add_floor",
    "withe.Record": "Simulation.run",
    "withe.Robot": "Scene.add_robot",
    "withe.Rod": "Scene.add_rod",
    "withe.RunningHand": "Simulation.grasp",
    "withe.Simulation": "Scene.build",
    "withe.Snapshot": "Simulation.snapshot",
    "withe.Spring": "Scene.add_spring",
    "withe.Support": "Scene.clamp",
    "withe.Tendon": "Scene.add_tendon",
    "withe.TorsionSpring": "Scene.add_torsion_spring",
    "withe.learning.Network": "train_network",
    "withe.real2sim.Calibration": "calibrate",
    "withe.view.LiveView": "Simulation.view",
    "withe.view.SliderView": "Simulation.view",
    "withe.view.style.Colors": "use",
}
# Benchmarks by topic, the most important first: title of the page, and the question that the benchmark answers.
BENCHMARKS = {
    "work_precision": ("Run time against error", "Which simulator reaches an error first, for beams and helices?"),
    "peers": ("Scenes in three simulators", "How fast are withe, PyElastica and MuJoCo at the same error?"),
    "bodies": ("Rods with rigid bodies", "How fast are withe and MuJoCo at the same error, with a body at a rod?"),
    "friction_precision": (
        "Run time against error, friction",
        "Which simulator reaches an error first with friction?",
    ),
    "rl_throughput": ("Throughput of learning tasks", "How many control steps a second do learning tasks reach?"),
    "conservation": ("Conservation", "Which integrator conserves momentum, angular momentum and energy?"),
    "robustness": ("Robustness", "Are results right in violent scenes with drawn parameters?"),
    "contact": ("Contact", "How does the run time of contact grow with the size of a scene?"),
    "contact_robustness": ("Robustness of contact", "Are results right in drawn scenes of impacts, piles and knots?"),
    "contact_fold": ("Contact of a folded sheet", "How much of a fold's run time does contact take?"),
    "parallel": ("Many simulations", "How do many simulations scale with threads?"),
    "gradients": ("Gradients", "How much does a gradient cost, over the run or the equilibrium?"),
    "settings": ("Settings", "How long does it take to set a parameter?"),
    "drawing": ("Pictures and films", "How long do a frame of a film and the first picture take?"),
    "skips": ("Shortcuts of the plan", "How much run time does each shortcut of `plan` save?"),
    "ablation": ("Parts of Newton's method", "How much does each part of Newton's method save?"),
    "newton_iteration": ("One Newton iteration", "How long does an iteration take, over LAPACK's band solver?"),
    "sparse_solvers": ("Sparse solvers", "How fast is the sparse solver, beside Eigen and CHOLMOD?"),
    "real2sim": ("Fits to camera data", "How accurate are fits to camera data?"),
    "perception": ("Perception", "How accurate and fast is the tracing of cables in photographs?"),
    "folding": ("Plans of folds", "How accurate and fast are plans of folds, and which friction do they need?"),
    "folding_replay": ("A fold in PyElastica", "Does another simulator confirm the slide of a fold?"),
    "folding_spin": ("Rotation of creases", "How far do creases turn in half folds of narrow and wide sheets?"),
    "folding_trials": ("Folds with noise", "How accurate are folds with noise, beside the published robot?"),
    "deployment": ("Grasps of a cable", "How accurate and fast are grasps that lay a cable?"),
    "deployment_tables": ("Patterns laid by a gripper", "How accurate is a laid cable, beside the published robot?"),
    "deployment_refining": ("Refinement of laid cables", "How do the mesh and the speed change a laid cable?"),
    "deployment_uses": ("Posts and knots", "Does a gripper place cables between posts and tie knots?"),
}
EXAMPLES = {
    "Start": ("cantilever", "helix", "robot", "quadruped", "soft_limb"),
    "Actuation and control": (
        "servo_arm",
        "arm_with_cable",
        "tendon_arm",
        "upright_arm",
        "throwing_tip",
        "tapered_arm",
        "snake",
    ),
    "Many robots and learning": (
        "stiffness_sweep",
        "domain_randomisation",
        "follow_by_derivatives",
        "follow_by_gradients",
        "learn_follow",
    ),
    "Contact and friction": ("friction", "spider", "gripper", "flagella", "flagella_contact", "guidewire"),
    "Rigid bodies": ("hanging_plug", "satellite", "crane_load", "lift_ball", "pinch_box", "soft_legs"),
    "Hands, cables and sheets": (
        "carry_rope",
        "pull_rope",
        "track_cables",
        "place_cable",
        "write_word",
        "tie_knot",
        "fold_paper",
        "fold_sheet",
        "press_sheet",
    ),
    "Knots and instabilities": (
        "ring_buckling",
        "plectoneme",
        "knot",
        "knot_limit",
        "overhand",
        "granny_reef",
    ),
}
PICTURES = {
    "follow_by_derivatives": "follow.gif",
    "follow_by_gradients": "follow.gif",
    "learn_follow": "follow.gif",
    "granny_reef": "reef.png",
    "knot": "knot_plot.png",
}
ROOT = Path(__file__).resolve().parent.parent
GENERATED = "generated"


def public_names(module: str) -> list[str]:
    """Return the public names of a module that are not modules themselves, sorted."""
    found = importlib.import_module(module)
    names = FOR_USERS.get(module, found.__all__)
    return sorted(name for name in names if not name.startswith("_") and not inspect.ismodule(getattr(found, name)))


def reference(folder: Path) -> None:
    """Write one page for each module, and one for each public name in it."""
    index = ["# Reference", "", "Every public name. Units are SI, angles are in radians.", ""]
    index += ["```{toctree}", ":maxdepth: 1", ""]
    for module, title in MODULES.items():
        index.append(f"{title} <{module}>")
        names = public_names(module)
        lines = [f"# {title}", "", f"Module `{module}`.", "", "```{eval-rst}", ".. currentmodule:: " + module, ""]
        lines += [".. autosummary::", "   :nosignatures:", ""]
        lines += [f"   {name}" for name in names]
        lines += ["```", "", "```{toctree}", ":hidden:", ""]
        lines += [f"{name} <{module}.{name}>" for name in names]
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
        return [*lines, f".. autoclass:: {name}", "```", *member_sections(module, name, value)]
    lines += [f".. autofunction:: {name}" if inspect.isroutine(value) else f".. autodata:: {name}"]
    return [*lines, "```"]


def member_sections(module: str, name: str, owner: type) -> list[str]:
    """Return tables of the members of a class by purpose, and a section for each purpose."""
    groups = purposes(owner)
    begin = ["", "```{eval-rst}", f".. currentmodule:: {module}", ""]
    lines = list(begin)
    few = len(groups) == 1 and len(*groups.values()) < 4  # the section itself is short
    for purpose, names in () if few else groups.items():
        lines += [f".. rubric:: {purpose}", "", ".. autosummary::", "   :nosignatures:", ""]
        lines += [f"   ~{name}.{member}" for member in names] + [""]
    lines += ["```"]
    own = dict(members(owner))
    for purpose, names in groups.items():
        lines += ["", f"## {purpose}", *begin]
        for member in names:
            kind = "autoproperty" if isinstance(own[member], property | cached_property) else "automethod"
            lines += [f".. {kind}:: {name}.{member}"]
        lines += ["```"]
    return lines


CONTENTS = "Methods and properties by purpose:"
"""Line of a docstring above a list of members by purpose, "* purpose: `member`, ...", which ends at an empty line."""


def purposes(owner: type) -> dict[str, list[str]]:
    """Return the members of a class by purpose, in the order of its docstring, or methods and properties apart."""
    own = dict(members(owner))
    groups: dict[str, list[str]] = {}
    _, found, text = (owner.__doc__ or "").partition(CONTENTS + "\n")
    if found:
        for row in re.split(r"\n\s*\n", text.strip("\n"))[0].split("* ")[1:]:
            groups[row.split(":")[0].strip().capitalize()] = re.findall(r"`(\w+)`", row)
    else:
        properties = [each for each in own if isinstance(own[each], property | cached_property)]
        groups = {"Methods": [each for each in own if each not in properties], "Properties": properties}
    old = [name for name in own if (own[name].__doc__ or "").startswith("Deprecated")]
    groups = {purpose: [name for name in names if name not in old] for purpose, names in groups.items()}
    return {purpose: names for purpose, names in (groups | {"Old names": old}).items() if names}


def members(owner: type) -> Iterator[tuple[str, Any]]:
    """Yield the public methods and properties of a class that the package defines."""
    for name in dir(owner):
        if name.startswith("_"):
            continue
        home = next(each for each in owner.__mro__ if name in vars(each))
        found = vars(home)[name]
        documented = inspect.isroutine(found) or isinstance(found, property | cached_property)
        if documented and home.__module__.partition(".")[0] == "withe":
            yield name, found


@cache
def names_by_id() -> dict[int, str]:
    """Return the public names by the id of their value."""
    found = {module: importlib.import_module(module) for module in MODULES}
    return {
        id(getattr(value, name)): f"{module}.{name}" for module, value in found.items() for name in public_names(module)
    }


def overridden(owner: type, member: str) -> tuple[str, Any] | None:
    """Return name and function of the public method that a method of a class overrides; None if there is none."""
    public = names_by_id()
    homes = [each for each in owner.__mro__ if member in vars(each)]
    for base in homes[1:]:
        if id(base) in public and isinstance(vars(base)[member], types.FunctionType):
            return f"{public[id(base)]}.{member}", vars(base)[member]
    return None


def process_docstring(app: Any, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Leave the contents of a class to the tables of its page, and name the method that a method overrides."""
    if what == "class" and CONTENTS in lines:
        first = lines.index(CONTENTS)
        last = next(place for place in range(first + 2, len(lines)) if not lines[place].strip())
        del lines[first : last + 1]
    elif what == "method" and not any(line.startswith((":param", ":Parameters:", "   :param")) for line in lines):
        module, owner, member = name.rsplit(".", 2)
        found = overridden(getattr(importlib.import_module(module), owner), member)
        if found is not None:
            lines += ["", f"Arguments and result are those of :meth:`{found[0]}`.", ""]


def process_signature(app: Any, what: str, name: str, *others: Any) -> tuple[str, None] | None:
    """Leave out the constructor of a class whose objects come from a function."""
    return ("", None) if what == "class" and name in MADE_BY else None


def report_missing(app: Any, environment: Any) -> None:
    """Warn of public names, and members of public classes, that no page describes."""
    from sphinx.util import logging

    described = environment.get_domain("py").objects
    for module in MODULES:
        for name in public_names(module):
            value = getattr(importlib.import_module(module), name)
            wanted = [f"{module}.{name}"]
            if inspect.isclass(value):
                wanted += [f"{module}.{name}.{member}" for member, _ in members(value)]
            for each in wanted:
                if each not in described:
                    logging.getLogger(__name__).warning("%s is public, and the reference lacks it", each)


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
    """Write a page for each benchmark from the sections of benchmarks/README.md, and an index with their questions."""
    text = (ROOT / "benchmarks/README.md").read_text().replace("](pictures/", "](../../../benchmarks/pictures/")
    head, *parts = text.split("\n## ")
    sections = dict(part.split("\n", 1) for part in parts)
    if unknown := sections.keys() - BENCHMARKS.keys():
        raise KeyError(f"docs/pages.py has no title and question of the benchmarks {', '.join(sorted(unknown))}")
    names = [name for name in BENCHMARKS if name in sections]
    rows = []
    for name in names:
        title, question = BENCHMARKS[name]
        body = sections[name].replace("\n### ", "\n## ")
        put(folder / f"{name}.md", [f"# {title}", "", question, "", *body.strip("\n").splitlines()])
        took = re.search(r"took (\d+) s", body)
        rows.append(f"| [{title}]({name}.md) | {question} | `make bench NAME={name}` | {duration(took)} |")
    table = ["| benchmark | question | command | duration |", "|---|---|---|---|", *rows]
    put(
        folder / "index.md",
        [*head.splitlines(), "", *table, "", "```{toctree}", ":maxdepth: 1", ":hidden:", "", *names, "```"],
    )


def duration(took: re.Match[str] | None) -> str:
    """Return how long the last run of a benchmark took."""
    if took is None:
        return "-"
    seconds = int(took[1])
    return (
        f"{seconds} s" if seconds < 100 else f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
    )


def examples(folder: Path) -> None:
    """Write a gallery of thumbnails, and a page for each example with its text, its picture and its code."""
    index = [
        "# Examples",
        "",
        "One script for each subject. Each checks its result, and fails if the result is wrong.",
        "",
    ]
    listed = {name for names in EXAMPLES.values() for name in names}
    others = [path.stem for path in sorted((ROOT / "examples").glob("*.py")) if path.stem not in listed]
    for section, names in [*EXAMPLES.items(), *([("More", others)] if others else [])]:
        index += [f"## {section}", "", "::::{grid} 1 2 3 3", ":gutter: 2", ""]
        for name in names:
            path = ROOT / "examples" / f"{name}.py"
            tree = ast.parse(path.read_text())
            head, _, body = (ast.get_docstring(tree) or "").partition("\n")
            first = tree.body[1].lineno  # the text stands above the code
            title = name.replace("_", " ").capitalize()
            index += [f":::{{grid-item-card}} {title}", f":link: {name}", ":link-type: doc"]
            page = [f"# {title}", "", head, ""]
            picture = PICTURES.get(name, f"{name}.png")
            if (ROOT / "examples" / "pictures" / picture).exists():
                index += [f":img-top: ../../../examples/pictures/{picture}", f":img-alt: {json.dumps(head)}"]
                page += [f"![{title}](../../../examples/pictures/{picture})"]
            index += ["", head, ":::", ""]
            page += [*body.splitlines(), ""]
            page += [
                "```bash",
                f"python examples/{name}.py",
                "```",
                "",
                f"```{{literalinclude}} ../../../examples/{name}.py",
            ]
            put(folder / f"{name}.md", [*page, ":language: python", f":lines: {first}-", "```"])
        index += ["::::", "", "```{toctree}", ":hidden:", "", *names, "```", ""]
    put(folder / "index.md", index)


def notebooks(folder: Path) -> None:
    """Copy the notebooks and their list. Links from notebooks/ to docs/ become links within docs."""
    for path in [ROOT / "notebooks/README.md", *sorted((ROOT / "notebooks").glob("*.ipynb"))]:
        text = path.read_text().replace("](../docs/", "](../../")
        put(folder / path.name.replace("README", "index"), text.splitlines())


def digest_of_package() -> str:
    """Return a digest of all files of the installed package."""
    digest = hashlib.sha256()
    folder = Path(withe.__file__).parent
    for path in sorted(path for path in folder.rglob("*") if path.suffix in {".py", ".so", ".pt", ".onnx"}):
        digest.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


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
    examples(folder / GENERATED / "examples")
    notebooks(folder / GENERATED / "notebooks")
