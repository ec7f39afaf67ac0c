"""Logs of tags are read as they are written, and what is wrong with one is said."""

import numpy as np
import pytest

from soft_limb import LOG, log, published, robot, seen_curvatures
from withe.real2sim import read_log


def test_a_log_has_times_pixels_and_what_was_seen():
    found = log()
    assert found.pixels.shape == (169, 9, 2)
    assert found.valid.all()
    assert found.tags == tuple(range(101, 110))
    assert found.times[[0, 1, -1]] == pytest.approx([0.0, 0.2, 33.622])
    assert found.pixels[0, 0] == pytest.approx([33.2706401008992, 53.8785561665])


def test_rows_without_tags_are_frames_in_which_nothing_was_seen():
    found = read_log(LOG, tags=range(101, 110))
    assert len(found.times) == 176
    assert not found.valid[:6].any()
    assert found.valid[6:].all()
    assert np.isnan(found.pixels[:6]).all()


def test_curvatures_of_the_pixels_are_those_published():
    _, places = robot()
    assert np.abs(seen_curvatures(places).values - published()[0]).max() < 1e-8


@pytest.mark.parametrize(
    ("options", "text", "message"),
    [
        ({"tags": []}, None, "tags must be different numbers"),
        ({"tags": [1, 1]}, None, "tags must be different numbers"),
        ({"tags": [9]}, "time,tagid_x_1\n0,1\n", "must have a column 'tagid_x_9'; it has time, tagid_x_1"),
        ({"tags": [1]}, "time,tagid_x_1,tagid_y_1\n0,a,2\n", "column 'tagid_x_1' must hold numbers, got 'a' in row 0"),
        ({"tags": [1]}, "time,tagid_x_1,tagid_y_1\n5,1,2\n5,1,2\n", "numbers that increase"),
        ({"tags": [1]}, "time,tagid_x_1,tagid_y_1\n5,0,0\n6,,\n", "tags must be seen in some frame"),
        ({"tags": [1], "skip": 2}, "time,tagid_x_1,tagid_y_1\n5,1,2\n", "more than skip=2 rows"),
        (
            {"tags": [1]},
            "time,tagid_x_1,tagid_y_1\n0,101,5,202,5\n",
            "name every column, got 5 cells and 3 names in row 1",
        ),
        ({"tags": [1]}, "", "which is empty"),
    ],
)
def test_a_bad_log_is_refused(tmp_path, options, text, message):
    path = LOG
    if text is not None:
        path = tmp_path / "log.csv"
        path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_log(path, **options)


def test_a_missing_log_is_refused(tmp_path):
    with pytest.raises(ValueError, match="path must be a file that can be read"):
        read_log(tmp_path / "none.csv", tags=[1])
