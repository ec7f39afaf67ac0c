"""Style of plots: legends lie beside the curves, boxes fill their frame, and colours differ for all readers."""

import itertools

import numpy as np
import pytest

from withe.common.progress import progress, track
from withe.view import style

plt = pytest.importorskip("matplotlib.pyplot")

# Colours as seen with a missing kind of cones, in linear RGB [Machado, Oliveira and Fernandes 2009, severity 1].
SEEN = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}


def linear(code):
    """Linear RGB of a colour code."""
    values = np.array([int(code[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """CIE L*a*b* of linear RGB, in which a distance of some 10 is seen at once."""
    matrix = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(np.maximum(matrix @ rgb, 1e-4) / (0.9505, 1.0, 1.089))
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.fixture(autouse=True)
def figures():
    plt.switch_backend("Agg")
    yield
    plt.close("all")


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("cones", SEEN)
def test_colours_of_curves_differ_for_the_colour_blind(theme, cones):
    seen = [lab(np.clip(SEEN[cones] @ linear(code), 0.0, 1.0)) for code in style.colors(theme).cycle]
    nearest = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
    assert nearest > 12.0


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_and_curves_stand_out_from_the_background(theme):
    colors = style.colors(theme)
    light = {name: np.array([0.2126, 0.7152, 0.0722]) @ linear(getattr(colors, name)) for name in vars(colors)}

    def contrast(name):
        low, high = sorted((light[name], light["paper"]))
        return (high + 0.05) / (low + 0.05)

    assert contrast("ink") > 10.0
    assert contrast("grey") > 3.0
    assert min(contrast(name) for name in ("blue", "red", "green")) > 3.0


def test_a_context_ends_with_the_settings_before():
    before = dict(plt.rcParams)
    with style.context("dark") as colors:
        assert plt.rcParams["figure.facecolor"] == colors.paper
        assert style.colors() is colors
    assert dict(plt.rcParams) == before
    assert style.colors() is style.colors("light")


def test_the_order_of_a_ramp_is_that_of_lightness():
    for theme, sign in (("light", -1.0), ("dark", 1.0)):
        shades = style.ramp(theme)(np.linspace(0.0, 1.0, 20))[:, :3]
        lightness = [lab(rgb**2.2)[0] for rgb in shades]
        assert np.all(sign * np.diff(lightness) > 0.0)


def test_labels_have_units():
    with style.context():
        axes = plt.figure().add_subplot(projection="3d")
    style.label(axes, x=("time", "s"), z="turns")
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()) == ("time [s]", "", "turns")


@pytest.mark.parametrize("side", ["right", "top"])
@pytest.mark.parametrize("projection", [None, "3d"])
def test_a_legend_hides_neither_curves_nor_the_title(side, projection):
    with style.context():
        axes = plt.figure(figsize=(6.0, 4.0)).add_subplot(projection=projection)
        axes.set_title("several curves")
        for k in range(5):
            axes.plot([0.0, 1.0], [0.0, k], *([[0.0, 1.0]] if projection else []), label=f"curve {k}")
        legend = style.legend(axes, side=side)
        if projection:
            style.fill_frame(axes, [(0.0, 0.0, 0.0), (1.0, 4.0, 1.0)])
        axes.figure.draw_without_rendering()
    box, inside, page = legend.get_window_extent(), axes.get_window_extent(), axes.figure.bbox
    assert box.x0 >= inside.x1 or box.y0 >= inside.y1
    assert page.x0 <= box.x0 < box.x1 <= page.x1
    assert page.y0 <= box.y0 < box.y1 <= page.y1
    title = axes._left_title.get_window_extent()
    assert title.y0 >= box.y1 or (side == "right" and title.x1 <= box.x0)


@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (1.0, 1.0, 8.0), (8.0, 1.0, 0.0)])
@pytest.mark.parametrize("page", [(4.0, 4.0), (8.0, 3.0)])
def test_a_box_fills_its_frame_at_equal_scales_with_its_labels_inside(size, page):
    with style.context():
        figure = plt.figure(figsize=page)
        axes = figure.add_subplot(projection="3d")
        style.label(axes, x=("x", "m"), y=("y", "m"), z=("z", "m"))
        style.fill_frame(axes, np.array([(0.0, 0.0, 0.0), size]))
        first, last = style._drawn(axes)
    assert np.all(first >= figure.bbox.min)
    assert np.all(last <= figure.bbox.max)
    assert np.max((last - first) / figure.bbox.size) > 0.85
    spans = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    np.testing.assert_allclose(spans / spans[0], axes._box_aspect / axes._box_aspect[0])


def test_unknown_words_are_refused():
    with pytest.raises(ValueError, match="theme must be 'light' or 'dark', got 'black'"):
        style.use("black")
    with pytest.raises(ValueError, match="side must be 'right' or 'top', got 'left'"):
        style.legend(plt.figure().add_subplot(), side="left")


def test_a_tracked_loop_has_all_items_and_counts_them(monkeypatch):
    counted = []
    monkeypatch.setattr("withe.common.progress.Progress.advance", lambda self, amount: counted.append(amount))
    assert list(track(iter("abc"), enabled=False)) == ["a", "b", "c"]
    assert counted == [1, 1, 1]
    with pytest.raises(ValueError, match="progress must be"), progress(1.0, enabled=2):
        pass
