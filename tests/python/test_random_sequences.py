"""The next step of a simulation follows from its state alone: random sequences, compared to the bit."""

import os
import re
import subprocess
import sys
from pathlib import Path

SEQUENCES = 28 * int(os.environ.get("WITHE_DRAWS", "1"))


def test_reset_copies_pickles_snapshots_and_files_go_on_to_the_bit():
    script = Path(__file__).with_name("random_sequences.py")
    result = subprocess.run(
        [sys.executable, script, str(SEQUENCES), "28"], capture_output=True, text=True, timeout=3600
    )
    assert result.returncode == 0, f"exit status {result.returncode}\n{result.stdout[-3000:]}\n{result.stderr[-3000:]}"
    counted = {what: int(n) for n, what in re.findall(r"(\d+) ([a-zA-Z_ ]+)", result.stdout.rpartition("failed:")[2])}
    assert counted["sequences that agree"] >= 0.9 * SEQUENCES
    assert counted["lifted out of the plane"] >= 2
    assert counted["ConvergenceError"] >= 3
    assert counted["KeyboardInterrupt"] >= 3
