"""The help of `Scene` and `Simulation` begins with a table of contents by purpose."""

import re

import pytest

import withe

PURPOSES = ["describe", "hold", "load", "touch", "run", "read", "differentiate"]


def table(kind):
    """Purposes of a class and the names that stand beside each, in order."""
    text = kind.__doc__.split("Methods and properties by purpose:\n")[1]
    rows = re.split(r"\n\s*\n", text.strip("\n"))[0]
    return [(row.split(":")[0].strip(), re.findall(r"`(\w+)`", row)) for row in rows.split("* ")[1:]]


@pytest.mark.parametrize("kind", [withe.Scene, withe.Simulation, withe.Batch, withe.Record])
def test_every_public_method_stands_in_the_contents_exactly_once(kind):
    listed = [name for _, names in table(kind) for name in names]
    assert sorted(listed) == sorted(name for name in dir(kind) if not name.startswith("_"))


@pytest.mark.parametrize("kind", [withe.Scene, withe.Simulation])
def test_contents_are_ordered_by_purpose(kind):
    purposes = [purpose.split()[0] for purpose, _ in table(kind)]
    assert list(dict.fromkeys(purposes)) == PURPOSES
    assert purposes == sorted(purposes, key=PURPOSES.index)
    assert re.match(r"\s*\S.*\n\n\s*Methods and properties by purpose:", kind.__doc__)
