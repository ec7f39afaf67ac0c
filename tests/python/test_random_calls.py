"""No input ends the interpreter: random sequences of calls, in processes of their own, with fixed seeds."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PARTS = 5
SEQUENCES = 500 * int(os.environ.get("WITHE_DRAWS", "1"))  # each


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, PARTS))])
def test_random_calls_end_in_a_result_or_an_exception(seed):
    script = Path(__file__).with_name("random_calls.py")
    result = subprocess.run(
        [sys.executable, script, str(SEQUENCES), str(seed)], capture_output=True, text=True, timeout=600
    )
    assert result.returncode == 0, f"exit status {result.returncode}\n{result.stderr[-4000:]}"
    counted = re.fullmatch(r"(\d+) sequences, (\d+) results, (\d+) refusals", result.stdout.strip())
    assert counted, result.stdout
    sequences, results, refusals = map(int, counted.groups())
    assert sequences >= SEQUENCES
    assert results > SEQUENCES  # they do reach the engine,
    assert refusals > SEQUENCES  # and they do find bad input
