"""Builds and runs the benchmarks that are written in C++ on Google Benchmark."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from reporting import ROOT

BUILD = ROOT / "build" / "make"


def build(name: str) -> Path:
    """Configure with the benchmarks on, and build this one."""
    subprocess.run(
        ["cmake", "-S", str(ROOT), "-B", str(BUILD), "-DWITHE_BUILD_BENCHMARKS=ON"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    subprocess.run(["cmake", "--build", str(BUILD), "--target", name], check=True)
    return BUILD / "benchmarks" / name


def repetitions(
    executable: Path, environment: dict[str, str], *, quick: bool, left_out: str = "^$"
) -> list[dict[str, Any]]:
    """All of its benchmarks in random order, again and again: what Google Benchmark tells of each repetition.

    Those whose name matches the pattern `left_out` do not run.
    """
    with tempfile.NamedTemporaryFile(suffix=".json") as file:
        subprocess.run(
            [
                str(executable),
                "--benchmark_enable_random_interleaving=true",
                f"--benchmark_repetitions={1 if quick else 11}",
                f"--benchmark_min_time={0.01 if quick else 0.2}",
                f"--benchmark_filter=-{left_out}",
                f"--benchmark_out={file.name}",
                "--benchmark_out_format=json",
            ],
            check=True,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | environment,
            stdout=subprocess.DEVNULL,
        )
        content = json.loads(Path(file.name).read_text())
    return [run for run in content["benchmarks"] if run["run_type"] == "iteration"]
