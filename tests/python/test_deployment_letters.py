"""Words that a cable can be laid along."""

import numpy as np
import pytest

from withe.deployment import Pattern
from withe.deployment.letters import LETTERS, written


@pytest.mark.parametrize("letter", sorted(LETTERS))
def test_each_letter_goes_along_the_base_line_from_left_to_right(letter):
    points = written(f"n{letter}n", 0.01) / 0.01
    before, after = (written(text, 1.0)[-1] for text in ("n", f"n{letter}"))
    np.testing.assert_allclose(points[0], 0.0, atol=1e-12)
    if letter != " ":  # which is nothing at an end of a word
        assert after[0] > before[0] + 0.9
    assert np.abs([points[-1, 1], before[1], after[1]]).max() < 1e-9
    high = 2.2 if letter in "bdfhklt" else 1.25
    low = -1.25 if letter in "fgjpqyz" else -0.25
    assert low < points[:, 1].min()
    assert points[:, 1].max() < high
    if letter != " ":
        assert written(f" {letter} ", 1.0)[:, 1].max() > 0.9


def test_a_word_is_one_curve_without_corners():
    points = written("the quick brown fox jumps over a lazy dog", 0.02)
    steps = np.diff(points, axis=0)
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs((np.diff(directions) + np.pi) % (2 * np.pi) - np.pi)
    assert turns.max() < 0.5
    assert np.linalg.norm(steps, axis=1).max() < 0.1 * 0.02


def test_a_word_is_as_high_as_was_asked_for_and_crosses_itself_in_loops():
    small, large = (Pattern.word("lie", height) for height in (0.05, 0.1))
    assert small.points[:, 1].max() == pytest.approx(0.1, rel=0.05)
    assert large.length == pytest.approx(2 * small.length, rel=0.01)
    assert len(small.crossings) == 3


def test_letters_of_loops_bend_no_tighter_than_the_docstring_says():
    for word in ("lie", "toe", "eel"):
        pattern = Pattern.word(word, 0.1, smoothing=0.006)
        assert np.abs(pattern.curvature).max() * 0.1 < 8.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "text must be a word, got ''"),
        ("  ", "text must be a word"),
        (7, "text must be a word, got 7"),
        ("Tie!", "letters a to z and spaces, got '!T' in 'Tie!'"),
    ],
)
def test_what_cannot_be_written_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        Pattern.word(text, 0.1)
    with pytest.raises(ValueError, match="height must be positive"):
        Pattern.word("a", 0.0)
