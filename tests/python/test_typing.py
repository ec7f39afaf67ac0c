"""Type checkers know the words of `set` and `get` of each kind of part, as the table of parts has them."""

import importlib.util
import os
import re
import subprocess
import sys
import typing
from pathlib import Path

import pytest

import withe
from withe.batch.reading import Reading
from withe.batch.setting import Setting
from withe.parts.table import KINDS, PAIR_WORDS, SCENE_WORDS
from withe.simulation import typed_words
from withe.simulation.control import Control

ROOT = Path(__file__).resolve().parent.parent.parent
PAIR, SCENE = "two bodies", "the scene"
SETTABLE = {kind.handle: {word.name for word in kind.words if word.is_set} for kind in KINDS} | {
    PAIR: {word.name for word in PAIR_WORDS if word.is_set},
    SCENE: {word.name for word in SCENE_WORDS if word.is_set},
}
READABLE = {kind.handle: {word.name for word in kind.words if word.is_read} for kind in KINDS} | {
    PAIR: {word.name for word in PAIR_WORDS if word.is_read},
    SCENE: {word.name for word in SCENE_WORDS if word.is_read},
}


def hints_of(overload):
    module = sys.modules[overload.__module__]
    return typing.get_type_hints(overload, vars(module), include_extras=True)


def kind_of(target):
    if target is type(None):
        return SCENE
    return PAIR if typing.get_origin(target) is tuple else target


def words_of_overloads(owner):
    """Words of `set` by the kind of target, from the overloads of a class."""
    found = {}
    for overload in typing.get_overloads(owner.set):
        hints = hints_of(overload)
        if hints["target"] is not str:
            (words,) = typing.get_args(hints["values"])
            found[kind_of(hints["target"])] = set((typing.get_origin(words) or words).__annotations__)
    return found


def literals_of_overloads(owner):
    """Words of `get` by the kind of target, from the overloads of a class."""
    found = {}
    for overload in typing.get_overloads(owner.get):
        hints = hints_of(overload)
        if typing.get_origin(hints["target"]) is typing.Literal:
            found.setdefault(SCENE, []).extend(typing.get_args(hints["target"]))
        elif hints["target"] is not str:
            found.setdefault(kind_of(hints["target"]), []).extend(typing.get_args(hints["word"]))
    return found


@pytest.mark.parametrize("owner", [Control, Setting], ids=["Simulation", "Batch"])
def test_set_knows_the_words_of_the_table(owner):
    assert words_of_overloads(owner) == {kind: words for kind, words in SETTABLE.items() if words}


@pytest.mark.parametrize("owner", [Control, Reading], ids=["Simulation", "Batch"])
def test_get_knows_the_words_of_the_table_each_once(owner):
    found = literals_of_overloads(owner)
    assert {kind: sorted(words) for kind, words in found.items()} == {
        kind: sorted(words) for kind, words in READABLE.items() if words
    }


def test_every_type_of_words_is_used():
    text = "".join(Path(sys.modules[each.__module__].__file__).read_text() for each in (Control, Setting, Reading))
    assert [name for name in typed_words.__all__ if not re.search(rf"\b{name}\b", text)] == []


GOOD = """
simulation.set(arm, youngs_modulus=1e6, natural_curvature=(0, 1.0), over=0.1)
simulation.set(load, force=lambda t: (0, 0, -t))
simulation.set(spring, stiffness=np.float64(3.0), over=1)
simulation.set((arm, floor), friction=0.3)
simulation.set((arm, "floor 1"), friction=(0.3, 0.1))
simulation.set(floor, friction=np.array([0.1, 0.2]))
simulation.set(gravity=(0, 0, 0))
simulation.set(None, contact_stiffness=None)
simulation.set("arm", anything=3)
simulation.set(scene["arm"], youngs_modulus=3)
simulation.set(wall, position=(0, 0, 1), rotation=np.eye(3))
simulation.set(simulation.grasp(arm, at=0.5), position=(0, 0, 1))
simulation.set(arm, **{"youngs_modulus": 1.0})
stiffness: float = simulation.get(spring, "stiffness")
shape: tuple[int, ...] = simulation.get(arm, "natural_curvature").shape
contact_stiffness: float | None = simulation.get("contact_stiffness")
simulation.get("gravity") * 2
simulation.get("arm", "anything")
batch.set(arm, youngs_modulus=[1.0, 2.0], lanes=[0, 1])
batch.set(spring, stiffness=[1.0, 2.0], over=0.1)
batch.set(load, force=[lambda t: (0, 0, t), lambda t: (0, 0, -t)])
batch.set(gravity=[(0, 0, 1), (0, 0, 2)])
batch.get(spring, "stiffness").mean()
"""
BAD = """
simulation.set(arm, youngs_modulis=1)
simulation.get(arm, "youngs_modulis")
simulation.set(spring, stiffness="soft")
simulation.set(spring, stiffness=[1.0, 2.0])
simulation.set(spring, tension=1.0)
simulation.set(arm.start, position=(0, 0, 0))
simulation.set(gravty=(0, 0, 0))
simulation.get(spring)
batch.set(arm, youngs_modulis=[1, 2])
batch.get(arm, "youngs_modulis")
batch.set(spring, lane=[0], stiffness=1.0)
"""
HEAD = """
import numpy as np
import withe
scene = withe.Scene()
material = withe.Material(youngs_modulus=1e6, density=1000.0)
arm = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=3, radius=0.01, material=material)
load = scene.add_force(arm.end, (0, 0, -1))
spring = scene.add_spring(arm.start, arm.end, stiffness=1.0)
floor = scene.add_floor()
wall = scene.clamp(arm.start)
simulation = scene.build()
batch = scene.build_batch(2)
"""


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")
def test_mypy_refuses_exactly_the_wrong_words(tmp_path):
    text = HEAD + GOOD + BAD
    (tmp_path / "snippet.py").write_text(text)
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", ROOT / "pyproject.toml", "snippet.py"]
    environment, folder = dict(os.environ), Path(withe.__file__).parent.parent
    if folder.name != "site-packages":  # which mypy searches by itself
        environment["MYPYPATH"] = str(folder)
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    refused = {int(line) for line in re.findall(r"^snippet\.py:(\d+): error:", result.stdout, re.MULTILINE)}
    wrong = [number for number, line in enumerate(text.splitlines(), 1) if line in BAD.splitlines() and line]
    assert refused == set(wrong), result.stdout + result.stderr
