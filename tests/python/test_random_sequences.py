"""The next step of a simulation follows from its state alone: random sequences, compared to the bit."""

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

DRAWS = int(os.environ.get("WITHE_DRAWS", "1"))


@pytest.mark.parametrize("sequences", [7 * DRAWS, pytest.param(28 * DRAWS, marks=pytest.mark.slow)])
def test_reset_copies_pickles_snapshots_and_files_go_on_to_the_bit(sequences):
    script = Path(__file__).with_name("random_sequences.py")
    result = subprocess.run(
        [sys.executable, script, str(sequences), "28"], capture_output=True, text=True, timeout=3600
    )
    assert result.returncode == 0, f"exit status {result.returncode}\n{result.stdout[-3000:]}\n{result.stderr[-3000:]}"
    printed = re.findall(r"(\d+) ([a-zA-Z_ ]+)", result.stdout.rpartition("failed:")[2])
    counted = Counter({what: int(n) for n, what in printed})
    assert counted["sequences that agree"] >= 0.9 * sequences
    assert counted["lifted out of the plane"] >= sequences // 14
    assert counted["ConvergenceError"] >= sequences // 9
    assert counted["KeyboardInterrupt"] >= sequences // 9
