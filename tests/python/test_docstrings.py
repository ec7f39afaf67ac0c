"""Examples in docstrings run, and print what they say."""

import doctest
import importlib
import pkgutil

import numpy as np
import pytest

import withe

MODULES = [
    name for _, name, _ in pkgutil.walk_packages(withe.__path__, "withe.") if not name.endswith(("__main__", "._core"))
]


def words():
    """Names that an example may use: an arm that hangs from a wall, far above a floor, with a load at its tip."""
    scene = withe.Scene()
    # Viscous, as rubber is: without, it whips in modes that steps of 5 ms do not resolve, with a warning.
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=2e3)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=rubber, name="arm")
    scene.clamp(arm.start)
    floor = scene.add_floor(-1.0)
    tip_load = scene.add_force(arm.end, (0, 0, -0.01))
    simulation = scene.build()
    record = simulation.copy().run(duration=0.1, record_every=0.02, progress=False)
    return {
        "np": np,
        "withe": withe,
        "scene": scene,
        "arm": arm,
        "floor": floor,
        "tip_load": tip_load,
        "simulation": simulation,
        "record": record,
    }


def examples(name):
    return [test for test in doctest.DocTestFinder().find(importlib.import_module(name), name) if test.examples]


def test_examples_are_found():
    assert sum(len(examples(name)) for name in MODULES) > 10


@pytest.mark.parametrize("name", MODULES)
def test_examples_of(name, tmp_path, monkeypatch):
    if name == "withe.view":
        pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    for test in examples(name):
        test.globs.update(words())
        report = []
        doctest.DocTestRunner(verbose=False).run(test, out=report.append)
        assert not report, "".join(report)
