"""The page of validation has a row for each test that is a case, and no others."""

import importlib.util
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import cases

ROOT = Path(__file__).resolve().parent.parent.parent
TOOL = ROOT / "tools" / "validation_page.py"
SPEC = importlib.util.spec_from_file_location("validation_page", TOOL)
validation_page = importlib.util.module_from_spec(SPEC)
sys.modules["validation_page"] = validation_page
SPEC.loader.exec_module(validation_page)

FOUND = validation_page.find_cases()
FIGURES = json.loads(validation_page.FIGURES.read_text())


def test_page_and_tests_have_the_same_cases():
    done = subprocess.run([sys.executable, str(TOOL), "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr + f"run python {TOOL.relative_to(ROOT)}"


def test_titles_are_unique_and_groups_known():
    assert [title for title, count in Counter(case.title for case in FOUND).items() if count > 1] == []
    assert {case.group for case in FOUND} <= set(validation_page.GROUPS)


def test_every_case_names_its_source_and_has_an_error_or_an_order():
    assert [case.title for case in FOUND if not case.source] == []
    missing = [case for case in FOUND if FIGURES[case.title]["error"] is None and not FIGURES[case.title]["orders"]]
    assert [case.title for case in missing if not case.exact] == []


def test_a_test_that_is_marked_later_is_missed(tmp_path):
    """The page of the tests as they are differs from that of tests with one more case, or with one less."""
    (tmp_path / "tests/physics").mkdir(parents=True)
    (tmp_path / "tests/python").mkdir()
    file = tmp_path / "tests/physics/test_new.py"
    file.write_text('@pytest.mark.case("statics", "A new case", source="its author")\ndef test_new():\n    pass\n')
    (new,) = validation_page.find_cases(tmp_path)
    assert new.title == "A new case"
    text = validation_page.PAGE.read_text()
    assert validation_page.page(text, FOUND, FIGURES) == text
    assert validation_page.page(text, [*FOUND, new], FIGURES) != text
    assert validation_page.page(text, FOUND[1:], FIGURES) != text


def test_commands_select_one_test_of_a_file():
    rest = "def test_a_rod_rolls(): pass\ndef test_rings_roll(): pass"
    names = ["test_a_rod_rolls_down", "test_a_rod_rolls", "test_rings_roll"]
    commands = [validation_page.command("tests/test_rings.py", name, rest.replace(name + "(", "")) for name in names]
    assert commands == [
        "python -m pytest tests/test_rings.py -k down",
        "python -m pytest tests/test_rings.py -k rolls",
        "python -m pytest tests/test_rings.py -k rings_roll",
    ]
    longer = validation_page.command("tests/test_a.py", "test_a_rod_rolls", "def test_a_rod_rolls_down(): pass")
    assert longer == 'python -m pytest tests/test_a.py -k "rolls and not down"'
    assert validation_page.command("tests/test_a.py", "test_rolls", "# it rolls") == (
        "python -m pytest tests/test_a.py::test_rolls"
    )


def test_errors_are_recorded_from_comparisons_unless_the_test_states_them():
    with cases.recording() as figures:
        assert pytest.approx(1.0, rel=0.1) == 1.01
        assert pytest.approx([2.0, 4.1], rel=0.1) == [2.0, 4.0]
    assert figures.as_dict() == {"error": pytest.approx(0.1 / 4.1), "unit": "", "orders": None}
    with cases.recording() as figures:
        assert pytest.approx(1.0, rel=0.1) == 1.01
        cases.measured([-0.3, 0.2], "mm")
        cases.measured_order([1.0, 2.0])
    assert figures.as_dict() == {"error": 0.3, "unit": "mm", "orders": [2.0, 2.0]}
    with cases.recording(), pytest.raises(AssertionError):
        assert pytest.approx(1.0, rel=0.1) == 1.5
    cases.measured(1.0)  # outside of a case it has no effect
