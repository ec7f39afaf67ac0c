"""The reference has a page for each public name, and every public docstring is complete: tools/reference_check.py."""

import importlib
import sys
from pathlib import Path

import pytest

import withe

TOOLS = Path(__file__).resolve().parent.parent.parent / "tools"


@pytest.fixture(scope="module")
def check():
    sys.path.insert(0, str(TOOLS))
    try:
        return importlib.import_module("reference_check")
    finally:
        sys.path.remove(str(TOOLS))


def test_no_public_docstring_is_incomplete(check):
    pytest.importorskip("gymnasium")  # whose subclasses are public
    found = check.faults()
    assert not found, "\n" + "\n".join(map(str, found))


def test_a_missing_page_is_found(check, monkeypatch):
    pytest.importorskip("gymnasium")
    monkeypatch.delitem(check.pages.MODULES, "withe.shapes")
    without = [name for name in check.public() if name != ("withe", "HeldPose")]
    places = {fault.where for fault in check.page_faults(without)}
    assert places == {"withe.shapes", "withe.simulation.hands.HeldPose"}


def test_a_docstring_that_names_what_has_no_page_is_found(check, monkeypatch):
    pytest.importorskip("gymnasium")
    monkeypatch.setitem(check.pages.FOR_USERS, "withe.io", ("load_poses",))
    (fault,) = check.named_faults(check.public())
    assert str(fault) == "page: withe.Record.to_vtk: names withe.io.write_vtk, which has no page"


def complete(force: float, count: int) -> float:
    """Return the work of a force.

    Parameters
    ----------
    force : float [N]
    count : int

    Returns
    -------
    float [J]

    Raises
    ------
    ValueError
        The force is negative.
    """
    if force < 0.0:
        raise ValueError("force must not be negative")
    return force * count


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("", "", None),
        ("    count : int\n", "", "parameter: f: argument 'count' is not documented"),
        ("count", "number", "parameter: f: argument 'count' is not documented"),
        ("float [N]", "float", "unit: f: force : float has neither unit nor shape"),
        ("float [J]", "float", "unit: f: result float has neither unit nor shape"),
        ("    Returns\n    -------\n    float [J]\n\n", "", "returns: f: returns float"),
        ("Raises\n    ------\n    ValueError", "Notes\n    -----\n", "raises: f: ValueError is not under Raises"),
    ],
)
def test_an_incomplete_docstring_is_found(check, monkeypatch, old, new, fault):
    text = complete.__doc__
    assert old in text
    monkeypatch.setattr(complete, "__doc__", text.replace(old, new))
    found = [str(each) for each in check.faults_of(check.Subject("f", complete))]
    assert found[:1] == ([] if fault is None else [fault])


def test_an_error_of_a_function_that_is_called_must_be_documented(check):
    def sized(radius: float) -> None:
        """Check a radius.

        Parameters
        ----------
        radius : float [m]
        """
        positive(radius, "radius")

    (fault,) = check.faults_of(check.Subject("f", sized))
    assert str(fault) == "raises: f: ValueError is not under Raises"


positive = withe.common.validation.positive


def test_an_error_that_is_caught_need_not_be_documented(check):
    def tried(radius: float) -> None:
        """Try a radius.

        Parameters
        ----------
        radius : float [m]
        """
        try:
            positive(radius, "radius")
        except ValueError:
            radius = 0.0

    assert list(check.faults_of(check.Subject("f", tried))) == []


def test_every_example_has_a_page_with_its_text_and_a_small_picture(check, tmp_path):
    pages = check.pages
    pages.examples(tmp_path)
    index = (tmp_path / "index.md").read_text()
    for path in (pages.ROOT / "examples").glob("*.py"):
        assert f":link: {path.stem}\n" in index
        page = (tmp_path / f"{path.stem}.md").read_text()
        text, _, _ = path.read_text().removeprefix('"""').partition("\n")
        assert text.removesuffix('"""') in page
    for name in (name for names in pages.EXAMPLES.values() for name in names):
        picture = pages.ROOT / "examples" / "pictures" / pages.PICTURES.get(name, f"{name}.png")
        assert 0 < picture.stat().st_size < 300_000
