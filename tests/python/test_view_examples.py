"""Examples run as a user runs them, in an empty folder."""

import re
from pathlib import Path

import pytest

from scripts import run_script

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parent.parent.parent
# Options of each example, the number that it prints, and between what that number must lie.
EXAMPLES = {
    "upright_arm.py": (["--duration", "4"], r"tip at most [.\d]+ mm aside, ([.\d]+) mm in the end", 0.0, 1.0),
    "arm_with_cable.py": ([], r"shoulder: torque -([.\d]+) N m", 6.0, 7.0),
    "carry_rope.py": (["--step", "1e-2"], r"carries up to (\d+)% of the weight", 40.0, 110.0),
    "crane_load.py": ([], r"theory within ([.\d]+) %", 0.0, 0.5),
    "domain_randomisation.py": (["--arms", "8"], r"feedback: ([.\d]+) mm off", 0.0, 2.0),
    "flagella.py": (["--step", "2e-3", "--duration", "6"], r"drawn together by (\d+)%", 20.0, 80.0),
    "flagella_contact.py": (
        ["--counts", "2", "--frictions", "0.3", "--steps", "200"],
        r"2 +0  at most ([.\d]+) radii apart",
        1e-6,
        0.05,
    ),
    "fold_sheet.py": (
        ["--edges", "75", "--time-step", "0.02"],
        r"Least force: it slides by ([.\d]+) mm \(predicted 7",
        7.5,
        7.9,
    ),
    "friction.py": (["--forces", "11"], r"at most ([.\d]+)% off", 0.0, 1.0),
    "granny_reef.py": (
        ["--frictions", "0.5", "--moduli", "--leaning", "--step", "1e-2"],
        r"granny [-.\de]+: \+([.\d]+)%; half the step changes 0",
        8.0,
        12.0,
    ),
    "gripper.py": (["--duration", "4"], r"friction 0.5: \d+ contacts, nearest ([-+.\d]+) radii", -0.05, 0.1),
    "guidewire.py": ([], r"dissipated, \+?(-?[.\d]+) % unaccounted", -1.0, 1.0),
    "hanging_plug.py": (["--duration", "10"], r"theory within ([.\d]+) %", 0.0, 0.1),
    "helix.py": ([], r"(\d+) um from the public code", 0.0, 100.0),
    "knot.py": (["--nodes", "201", "--points", "2", "--speed", "8e-3"], r" 200 .*?([-+.\d]+)%", -6.0, 6.0),
    "knot_limit.py": (["--points", "4"], r"at epsilon = 0: pull ([.\d]+) of the limit", 0.97, 1.03),
    "lift_ball.py": ([], r"forces equal weights within ([.\d]+) %", 0.0, 0.05),
    "overhand.py": (["--knots", "1", "--speed", "8e-3"], r" 200 .* ([.\d]+)\n", 0.75, 0.92),
    "pinch_box.py": ([], r"1\.50 of the least force.* ([.\d]+) mm above", 59.9, 60.1),
    "plectoneme.py": (["--forces", ".01", "--turns", "2"], r"moment at most ([.\d]+)% off", 0.0, 3.0),
    "ring_buckling.py": (["--nodes", "40"], r"\(([-+.\d]+) %\)", -3.0, 3.0),
    "place_cable.py": (["--nodes", "110", "--letters", "U"], r"U, exact: passes (\d+) of 14 posts", 14.0, 14.0),
    "press_sheet.py": (["--edges", "75"], r"presses with ([.\d]+) N for each mm", 1.95, 2.0),
    "pull_rope.py": (["--step", "1e-2"], r"([.\d]+) cm of the rope are through the eye", 75.0, 90.0),
    "quadruped.py": (["--duration", "1.8"], r"walked ([.\d]+) body lengths", 1.0, 2.0),
    "robot.py": (["--steps", "2"], r"walked ([-.\d]+) cm", 4.0, 10.0),
    "satellite.py": ([], r"theory within ([.\d]+) %", 0.0, 0.1),
    "servo_arm.py": ([], r"by ([.\d]+) mm where it is shaped", 0.0, 1.0),
    "snake.py": (["--periods", "3"], r"Crawls at ([.\d]+) mm/s", 27.8, 28.7),
    "soft_legs.py": (["--duration", "3"], r"theory within ([.\d]+) %", 0.0, 0.1),
    "soft_limb.py": ([], r"tip ([.\d]+) mm off on the mean", 0.3, 0.7),
    "stiffness_sweep.py": (["--arms", "60"], r"tips within ([-.\de]+) L of theory", 0.0, 1e-3),
    "tapered_arm.py": ([], r"tapered: clearance off by ([.\d]+) mm", 0.0, 1.0),
    "tendon_arm.py": (["--points", "4"], r"mm, ([.\d]+) mm off theory", 0.0, 0.05),
    "throwing_tip.py": (["--iterations", "120"], r"within ([.\d]+) mm of each point", 0.0, 1.0),
    "tie_knot.py": (["--knots", "trefoil", "--nodes", "60"], r"trefoil: tied (\d) of 1", 1, 1),
    "track_cables.py": (["--duration", "1.5"], r"with the rod: hidden nodes are ([.\d]+) px off", 0.1, 3.0),
    "write_word.py": (["--nodes", "140", "--ways", "exact"], r"exact: ([.\d]+) mm off on the mean", 0.0, 2.5),
    "spider.py": (["--duration", "0.2"], r"half the step: no node moves by more than ([.\d]+)%", 0.0, 2.0),
}


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_an_example_finds_what_it_claims_and_writes_its_pictures(name, tmp_path, renderer):
    if name == "domain_randomisation.py":
        pytest.importorskip("gymnasium")
    options, pattern, low, high = EXAMPLES[name]
    arguments = [*options, "--out", str(tmp_path)]
    printed = run_script(ROOT / "examples" / name, arguments, tmp_path, {"MPLBACKEND": "Agg"})
    match = re.search(pattern, printed)
    assert match, printed
    assert low <= float(match[1]) <= high
    assert list(tmp_path.glob("*.png"))
