"""A simulated sheet is carried out on; what the continuum's equilibria and Coulomb's law say is the oracle."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import withe
from cases import measured
from withe.folding import Jaw, Noise, Paper, SimulatedSheet, plan

ROOM = Path(__file__).resolve().parents[2] / "python" / "withe" / "folding"
COARSE = {"edges": 75, "time_step": 0.02}
PLANNER = {"planning", "plans", "grid", "manifold", "moment_free", "free_moment", "sheets", "timing", "widths"}
WORLD = {"carrying", "simulated_sheet", "wide_sheet", "jaw_motion", "noise", "paper_rods", "views"}


def reached(module: str) -> set[str]:
    """Modules of the room that one imports, directly or not."""
    found, pending = set(), [module]
    while pending:
        tree = ast.parse((ROOM / f"{pending.pop()}.py").read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("withe.folding."):
                name = node.module.rpartition(".")[2]
                if name not in found:
                    found.add(name)
                    pending.append(name)
    return found


def still(poses: np.ndarray, times: np.ndarray | None = None) -> SimpleNamespace:
    """A motion: rows of x, z, angle, a second apart."""
    poses = np.asarray(poses, dtype=float)
    x, z, angle = poses.T
    zero = np.zeros_like(x)
    rows = np.stack([x, zero, z, zero, np.sin(angle / 2), zero, np.cos(angle / 2)], axis=1)
    return SimpleNamespace(times=np.arange(len(x), dtype=float) if times is None else times, poses=rows, target=0.297)


@pytest.fixture(scope="module")
def a4():
    return Paper.a4()


@pytest.fixture(scope="module")
def half(a4):
    return plan(a4)


def test_planners_know_no_simulated_sheet_and_it_knows_no_planner():
    assert {path.stem for path in ROOM.glob("*.py")} >= PLANNER | WORLD
    for module in PLANNER:
        assert not reached(module) & WORLD, module
    for module in WORLD:
        assert not reached(module) & PLANNER, module


@pytest.mark.case("planners", "Slide of a fold in the rod engine", source="elastica and Coulomb")
def test_a_sheet_slides_as_the_continuum_and_coulomb_say(a4, half):
    found = SimulatedSheet(a4, edges=100, time_step=0.02).fold(half, progress=False)
    assert found.failure is None
    assert half.slide[-1] > 5e-3
    measured(1e3 * (found.slide - half.slide[-1]), "mm")
    assert found.slide == pytest.approx(half.slide[-1], abs=1e-4)
    # The edge is where the plan takes it; the sheet has slid on: the gap is the slide, and the crease off by half.
    assert found.error == pytest.approx(-0.5 * found.slide, abs=1e-6)
    assert found.length == pytest.approx(0.5 * 0.297 + found.error)
    times, slides = found.record.times, found.record.positions("sheet")[:, -1, 0] - 0.297
    assert slides == pytest.approx(np.interp(times, half.times, half.slide), abs=2e-4)


def test_the_sheet_bends_as_planned(a4, half):
    found = SimulatedSheet(a4, **COARSE).fold(half, progress=False)
    assert found.max_curvature == pytest.approx(half.max_curvature.max(), rel=0.05)


def test_half_a_circle_pushes_the_sheet_away_until_it_snaps(a4):
    found = SimulatedSheet(a4, **COARSE).fold(plan(a4, method="intuitive"), progress=False)
    assert found.failure is not None
    assert "snapped" in found.failure
    assert found.slide > 0.15


def test_seeds_repeat_and_differ(a4):
    lift = still([(0, 0, 0), (0.0005, 0.02, 0.3), (0.002, 0.04, 0.5)])
    sheets = [SimulatedSheet(a4, seed, Noise(), **COARSE) for seed in (5, 5, 6)]
    ends = [(sheet.carry_out([lift], 0.297, progress=False), sheet.positions())[1] for sheet in sheets]
    again = (sheets[0].carry_out([lift], 0.297, progress=False), sheets[0].positions())[1]
    assert (ends[0] == ends[1]).all()
    assert (ends[0] == again).all()
    assert np.abs(ends[0] - ends[2]).max() > 1e-4
    assert sheets[0].truth == sheets[1].truth
    assert sheets[0].paper == a4


def test_noise_has_the_spread_that_it_says(a4):
    def spread(noise: Noise) -> list[float]:
        truths = [SimulatedSheet(a4, seed, noise, edges=20).truth for seed in range(200)]
        relative = np.array([(t.gravito_bending_length / 0.048, t.friction / 0.12) for t in truths]) - 1.0
        assert np.abs(relative.mean(axis=0)).max() < 0.2 * 0.2
        return list(relative.std(axis=0))

    # A normal distribution that ends at two standard deviations has 0.88 of its spread.
    assert spread(Noise()) == pytest.approx([0.88 * 0.05, 0.88 * 0.2], rel=0.15)
    assert spread(replace(Noise.none(), friction=0.1)) == pytest.approx([0.0, 0.088], rel=0.15)


def test_friction_of_a_table_varies_from_place_to_place(a4):
    x = np.linspace(0.0, 0.6, 2001)
    drawn = [SimulatedSheet(a4, seed, Noise(friction=0.0), edges=20)._drawn for seed in range(100)]
    share = np.array([each.friction_at(x) for each in drawn])
    assert share.mean() == pytest.approx(1.0, abs=0.01)
    assert share.std() == pytest.approx(0.1, rel=0.1)
    # It is the same within a few millimetres, and another half a wave on.
    near, far = (share[:, gap:] - share[:, :-gap] for gap in (10, 1000))
    assert near.std() < 0.4 * share.std() < far.std()
    assert (SimulatedSheet(a4, 0, Noise.none(), edges=20)._drawn.friction_at(x) == 1.0).all()


def pulled(sheet: SimulatedSheet) -> tuple[np.ndarray, float]:
    """Places of the nodes beyond the jaw that pulls a sheet back over the table, and its tension there."""
    seen = []
    first = int(np.searchsorted(sheet.positions()[:, 0], sheet.jaw.depth))

    def motions():
        yield still([(0, 0, 0), (-0.02, 0, 0)])
        seen.append((sheet.positions()[first:, 0], sheet.simulation.tensions(sheet.rod)[first]))

    sheet.carry_out(motions(), 0.297, progress=False)
    return seen[0]


def test_a_sheet_is_pulled_with_the_friction_of_where_it_lies(a4):
    varied = SimulatedSheet(a4, 2, replace(Noise.none(), friction_variation=0.3), **COARSE)
    (x, tension), (_, even) = pulled(varied), pulled(SimulatedSheet(a4, 2, **COARSE))
    lies = np.linspace(x[2], x[-1], 2001)  # the first two are borne by the jaw
    share = varied._drawn.friction_at(lies).mean()
    assert abs(share - 1.0) > 0.03
    assert tension / even == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_curled_sheet_lifts_its_far_edge_by_the_cube_of_lgb(a4, seed):
    # The last l of it is lifted, y'' = k - w s^2 / (2 EI) at s from the end, and 0 at s = l: y(0) = EI k^2 / (2 w).
    sheet = SimulatedSheet(a4, seed, replace(Noise.none(), curl=6.0), edges=150)
    curl = sheet._drawn.curl
    sheet.carry_out([still([(0, 0, 0), (0, 0, 0)])], 0.297, progress=False)
    assert sheet.positions()[-1, 2] == pytest.approx(0.048**3 * curl**2 if curl > 0 else 0.0, rel=0.05, abs=1e-5)


def test_motions_follow_each_other_and_are_asked_for_in_time(a4):
    seen = []
    sheet = SimulatedSheet(a4, **COARSE)

    def motions():
        yield still([(0, 0, 0), (0.0, 0.02, 0.3)])
        seen.append((sheet.simulation.time, sheet.positions()[0, 2]))
        yield still([(0.0, 0.02, 0.3), (0.0, 0.01, 0.2)])
        seen.append((sheet.simulation.time, sheet.positions()[0, 2]))

    found = sheet.carry_out(motions(), 0.297, progress=False)
    assert [time for time, _ in seen] == pytest.approx([1.0, 2.0])
    weight = 9.81 * 800.0 * a4.thickness * a4.width * a4.length
    yields = weight / 2e3  # of which the jaw carries a part
    assert [height for _, height in seen] == pytest.approx([0.02, 0.01], abs=yields)
    assert found.record.times[-1] == pytest.approx(2.5)


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        (still([(0.05, 0, 0), (0.1, 0, 0)]), "must begin where the jaw is"),
        (
            still([(0, 0, 0), (0, 0.01, 0)], np.array([0.0, 0.0])),
            "times of a motion must be two or more increasing values",
        ),
        (still([(0, 0, 0), (0, np.nan, 0)]), "poses of a motion"),
    ],
)
def test_a_motion_that_cannot_be_carried_out_is_refused(a4, motion, message):
    with pytest.raises(ValueError, match=message):
        SimulatedSheet(a4, **COARSE).fold(motion, progress=False)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("a4",), "paper must be a Paper"),
        ((Paper.a4(), -1), "seed"),
        ((Paper.a4(), 0, "loud"), "noise must be a Noise"),
    ],
)
def test_a_sheet_of_nonsense_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        SimulatedSheet(*arguments)
    with pytest.raises(ValueError, match="friction"):
        Noise(friction=-0.1)


def test_a_sheet_is_part_of_the_package():
    assert withe.folding.SimulatedSheet is SimulatedSheet


@pytest.mark.parametrize("force_limit", [20.0, 1.5])
@pytest.mark.parametrize("case", ["flat", "tilted", "folded"])
def test_a_jaw_that_comes_too_low_yields_and_rests_on_the_table(a4, half, case, force_limit):
    """It presses by its stiffness times how much too low it is, up to its limit, and no step is cut for it."""
    stiffness, low = 2e3, 1e-3
    sheet = SimulatedSheet(a4, jaw=Jaw(stiffness=(stiffness, 10.0), force_limit=force_limit))
    angle = 0.4 if case == "tilted" else 0.0
    above, below = (0.02, 0.03, angle), (0.02, 0.01 * np.sin(angle) - low, angle)
    motions = [still([(0, 0, 0), (0.02, 0.06, 0.5 * angle), above, below, below])]
    if case == "folded":
        x, _, z, _, sine, _, cosine = half.poses[-1]
        angle = 2.0 * np.arctan2(sine, cosine)
        motions = [half, still([(x, z, angle), (x, z - low, angle), (x, z - low, angle)])]
    found = sheet.carry_out(motions, 0.1485, progress=False)
    assert found.failure is None
    simulation, positions = sheet.simulation, sheet.positions()
    assert simulation.statistics.rejected_steps == 0
    assert simulation.statistics.steps - round(simulation.time / 0.01) in range(len(motions) + 1)  # at their ends
    assert positions[:, 2].min() > -0.1 * a4.thickness  # the table has not given way
    force, held = simulation.wrench("jaw").force, simulation.deflection("jaw")
    size, shift = np.linalg.norm(force), np.linalg.norm(held.shift + held.slip)
    assert size == pytest.approx(min(stiffness * shift, force_limit), rel=1e-6)
    assert size <= force_limit * (1.0 + 1e-12)
    # The plan of a fold ends with a finger's thickness between the layers.
    assert shift > (low - sheet.jaw.finger if case == "folded" else low) * 0.99
    assert -force[2] > 0.95 * size
    if case == "flat":
        assert shift == pytest.approx(low, rel=0.02)


def test_a_sheet_four_times_as_large_slides_four_times_as_far():
    """And as the plan says, for the jaw is no softer against it: it slid a quarter further."""
    slides = []
    for scale in (1.0, 4.0):
        paper = Paper(0.25 * scale, 0.18 * scale, 0.045 * scale, friction=0.2, thickness=1e-4 * scale)
        jaw = Jaw(depth=0.01 * scale, finger=5e-4 * scale, reach=0.06 * scale, force_limit=10.0 * scale**3)
        slower = 1.0 / np.sqrt(scale)
        planned = plan(paper, jaw=jaw, speed=0.05 / slower, turning=slower, progress=False)
        sheet = SimulatedSheet(paper, jaw=jaw, edges=75, time_step=0.02 / slower)
        slides.append(sheet.fold(planned, progress=False).slide / scale)
        assert abs(slides[-1]) == pytest.approx(np.abs(planned.slide).max() / scale, rel=0.02)
    assert slides[1] == pytest.approx(slides[0], rel=0.005)


def test_a_sheet_that_slips_in_the_jaw_says_so():
    """A mat of 24 N asks for more than a jaw's 10 N; one that presses harder folds it as planned."""
    mat = Paper(1.189, 0.841, 0.15, friction=0.6, thickness=3e-3)
    planned = plan(mat, progress=False)
    weak = SimulatedSheet(mat, **COARSE)
    with pytest.warns(UserWarning, match=r"the sheet slipped by \d+\.\d mm in the jaw: .* force_limit"):
        found = weak.fold(planned, progress=False)
    assert found.failure is None
    assert found.slip > 0.02
    strong = SimulatedSheet(mat, jaw=Jaw(force_limit=1e3), **COARSE).fold(planned, progress=False)
    assert strong.slip == 0.0
    assert abs(strong.error) < 0.1 * abs(found.error)


@pytest.mark.parametrize(("expected", "ends"), [(700.0, True), (1.0, False)])
def test_slow_motions_are_carried_out_to_their_end_or_said_not_to_be(a4, expected, ends):
    sheet = SimulatedSheet(a4, edges=20, time_step=1.0, record_every=np.inf)
    motion = still([(0, 0, 0), (0, 0, 0)], np.array([0.0, 700.0]))
    found = sheet.carry_out([motion], 0.1485, duration=expected, progress=False)
    assert found.failure == (None if ends else "not over after 600 s")
    assert sheet.simulation.time == pytest.approx(700.5 if ends else 600.0, abs=1.0)
