"""The gallery: every entry has a film in the documentation, and films show what they should."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import withe

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "examples"))
import gallery  # noqa: E402

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0, viscosity=2e3)


def fallen(floor):
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0.1), end=(0.2, 0, 0.1), nodes=11, radius=5e-3, material=RUBBER)
    if floor:
        scene.add_floor()
    return scene.build(time_step=2e-3).run(0.02, 0.01, progress=False)


def test_the_page_shows_every_entry_and_its_films_are_small():
    page = (ROOT / "docs" / "gallery.md").read_text()
    shown = re.findall(r"\]\(gallery/(\w+)\.webp\)", page)
    assert sorted(shown) == sorted([*gallery.ENTRIES, "traced"])
    films = [ROOT / "docs" / "gallery" / f"{name}.webp" for name in shown]
    assert all(film.read_bytes()[8:12] == b"WEBP" for film in films)
    assert sum(film.stat().st_size for film in films) < 6e6


def test_a_film_has_the_floor_of_its_scene_or_one_below_the_rods():
    record = fallen(floor=True)
    assert gallery.Shot(record).floor() is None
    assert gallery.Shot(record, ground=-0.1).floor() == -0.1
    hanging = gallery.Shot(fallen(floor=False))
    lowest = hanging.record.positions()[..., 2].min()
    assert lowest - 0.02 < hanging.floor() < lowest


def test_a_camera_of_the_gallery_sees_its_target_in_the_middle_and_upright():
    camera = gallery.camera_at((0.5, -1.0, 0.7), (0.1, 0.2, 0.0), 0.8)
    middle, above = camera.project(np.array([[0.1, 0.2, 0.0], [0.1, 0.2, 0.1]]))
    np.testing.assert_allclose(middle, (479.5, 269.5), atol=1e-6)
    assert above[0] == pytest.approx(middle[0])
    assert above[1] < middle[1]
    right = np.array([[0.1, 0.2, 0.0]]) + 0.4 * camera.rotation[0]
    assert camera.project(right)[0, 0] == pytest.approx(959.5)


def test_a_sheet_is_shown_as_wide_as_it_is():
    record = fallen(floor=True)
    sheet = gallery.Sheet(record, 0.2, 1e-3)
    assert sheet.rods[0].widths.shape == (10, 2)
    assert record.rods[0].widths is None
    assert len(sheet) == len(record)
    np.testing.assert_array_equal(sheet.positions(), record.positions())


def test_an_entry_makes_a_film(renderer, tmp_path, monkeypatch):
    encoder = pytest.importorskip("imageio_ffmpeg")
    monkeypatch.setitem(gallery.ENTRIES, "fallen", lambda: gallery.Shot(fallen(floor=True), speed=0.3))
    film = gallery.make("fallen", tmp_path, (64, 36), quality="draft")
    reader = encoder.read_frames(str(film))
    assert next(reader)["size"] == (64, 36)
    assert len(list(reader)) == 3
    gallery.shrink(film, tmp_path / "fallen.webp")
    assert (tmp_path / "fallen.webp").read_bytes()[8:12] == b"WEBP"


@pytest.mark.skipif(importlib.util.find_spec("cv2") is None, reason="needs OpenCV")
def test_cables_are_traced_one_after_the_other(tmp_path):
    encoder = pytest.importorskip("imageio_ffmpeg")
    gallery.traced(tmp_path / "traced.mp4", (320, 180), 4)
    reader = encoder.read_frames(str(tmp_path / "traced.mp4"))
    assert next(reader)["size"] == (320, 180)
    pictures = [np.frombuffer(picture, np.uint8).astype(int) for picture in reader]
    assert len(pictures) == 4
    changes = [np.abs(picture - pictures[0]).mean() for picture in pictures]
    assert changes[0] == 0.0
    assert changes[1] < changes[3]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["helix", "servo_arm"])
def test_a_scene_of_the_gallery_runs(name):
    shot = gallery.ENTRIES[name]()
    assert 4.0 < (shot.record.times[-1] - shot.record.times[0]) / shot.speed < 10.0
