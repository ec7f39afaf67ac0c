"""Plans of folds in files and in copies: what is read back is what was written."""

import copy
import json
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from planned_folds import freely, planned
from withe.folding import FoldPlan, Jaw, Paper, plan, replan


def test_saved_tables_hold_the_plan(tmp_path):
    folded = planned("a4")
    rows = np.genfromtxt(folded.save(tmp_path / "fold.csv"), delimiter=",", names=True)
    assert rows.dtype.names == ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
    np.testing.assert_allclose(rows["t"], folded.times, atol=1e-6)
    np.testing.assert_allclose(rows["qw"], folded.poses[:, 6], atol=1e-8)
    content = json.loads(folded.save(tmp_path / "fold.json").read_text())
    assert content["paper"]["gravito_bending_length"] == 0.048
    assert content["units"]["length"] == "m"
    np.testing.assert_allclose(content["prediction"]["slide"], folded.slide)
    json.loads(planned("a4", method="intuitive").save(tmp_path / "snaps.json").read_text(), parse_constant=pytest.fail)
    with pytest.raises(ValueError, match=r"\.csv or \.json"):
        folded.save(tmp_path / "fold.txt")


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda folded: pickle.loads(pickle.dumps(folded))])
@pytest.mark.parametrize("paper", [Paper.a4(), replace(Paper.origami(), length=0.4, width=0.4)])
@pytest.mark.parametrize("method", ["ucs", "intuitive"])
@pytest.mark.filterwarnings("ignore:the sheet jumps")
def test_plans_that_have_been_used_are_pickled_and_copied(copied, paper, method):
    folded = plan(paper, 0.25, method=method)
    slide, worst = folded.slide, folded.worst_slide  # from the engine, and kept
    again = copied(folded)
    assert again.worst_slide == worst
    np.testing.assert_array_equal(again.poses, folded.poses)
    stiffer = replace(paper, gravito_bending_length=1.05 * paper.gravito_bending_length)
    np.testing.assert_array_equal(again.slide, slide)
    np.testing.assert_array_equal(again.slide_of(stiffer), folded.slide_of(stiffer))
    if method == "ucs":
        np.testing.assert_array_equal(
            replan(again, again.poses[100], 0.002).poses, replan(folded, folded.poses[100], 0.002).poses
        )


def same(first, second):
    """True if two plans, or their parts, agree to the last digit."""
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and np.array_equal(first, second, equal_nan=True)
    if hasattr(first, "__dataclass_fields__"):
        return all(same(getattr(first, each.name), getattr(second, each.name)) for each in fields(first))
    return type(first) is type(second) and first == second


def saved_plans():
    yield planned("a4")
    yield planned("a4", method="intuitive")
    yield freely("a4")
    yield replan(planned("a4"), planned("a4").poses[100], 0.004)
    yield plan(Paper.origami(), 0.3, jaw=Jaw(depth=0.012), speed=0.03)


def test_a_plan_is_read_back_as_it_was(tmp_path):
    for number, folded in enumerate(saved_plans()):
        again = FoldPlan.load(folded.save(tmp_path / f"{number}.json"))
        assert same(again, folded)
        np.testing.assert_array_equal(again.slide, folded.slide)
        assert repr(again) == repr(folded)
    rest, other = (replan(each, folded.poses[100], 0.002) for each in (again, folded))
    np.testing.assert_array_equal(rest.poses, other.poses)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda text: text[: len(text) // 2], "is not a withe file, or damaged: it is not JSON"),
        (lambda text: text.replace("withe plan of a fold", "withe record"), "holds a withe record, expected"),
        (lambda text: text.replace('"version": 1', '"version": 7'), "of version 7, this withe reads version 1"),
        (lambda text: "[1, 2]", "is not a withe file"),
        (lambda text: text.replace('"jaw"', '"jaws"'), "is a damaged plan of a fold: it has no 'jaw'"),
        (lambda text: text.replace('"friction": 0.12', '"friction": -1'), "damaged .*: friction must be positive"),
        (lambda text: text.replace('"thickness"', '"weight"'), "damaged .*weight"),
        (lambda text: text.replace('"method": "ucs"', '"method": "best"'), "damaged .*: method must be"),
        (lambda text: without(text, "times"), "damaged .*: poses must have shape"),
        (lambda text: without(text, "angles"), "damaged .*: angles must have shape"),
        (lambda text: json.dumps({**json.loads(text), "sheet": None}), "damaged .*: sheet must be given"),
        (
            lambda text: json.dumps({**json.loads(text), "angles": [0.1] * 251}),
            "poses must be turned about y by angles",
        ),
    ],
)
def test_a_plan_that_is_damaged_is_refused(damage, message, tmp_path):
    file = planned("a4").save(tmp_path / "fold.json")
    text = file.read_text()
    assert damage(text) != text
    file.write_text(damage(text))
    with pytest.raises(ValueError, match=message):
        FoldPlan.load(file)
    with pytest.raises(OSError, match="nowhere"):
        FoldPlan.load(tmp_path / "nowhere.json")


def without(text, name):
    content = json.loads(text)
    return json.dumps({**content, name: content[name][:-1]})
