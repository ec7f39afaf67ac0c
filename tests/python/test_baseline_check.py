"""Instructions that old machines lack are found in compiled files, outside of and in the kernels for AVX2."""

import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
COMPILER = shutil.which("g++") or shutil.which("c++")

pytestmark = [
    pytest.mark.skipif(platform.machine() != "x86_64", reason="the baseline is that of x86-64"),
    pytest.mark.skipif(not COMPILER or not shutil.which("objdump"), reason="needs a compiler and binutils"),
]

SUM = "double NAME(const double* x, double y) { double s = y; for (int i = 0; i < 64; ++i) s += x[i] * y; return s; }"
KERNEL = f"namespace avx2 {{ {SUM.replace('NAME', 'sum')} }}"


@pytest.fixture
def check(tmp_path):
    """Return a function that compiles sources, a file each, as a build does, and returns what the check tells."""
    room = tmp_path / "cpp" / "room"
    room.mkdir(parents=True)

    def checked(*flags, **sources):
        for name, source in sources.items():
            file = room / f"{name}.cpp"
            file.write_text(source)
            own = ("-mavx2", "-mfma") if name.endswith("_avx2") else flags
            subprocess.run([COMPILER, "-O1", *own, "-c", file, "-o", f"{file}.o"], check=True)
        command = [sys.executable, ROOT / "tools" / "baseline_check.py", tmp_path]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    return checked


def test_kernels_may_have_newer_instructions_and_other_files_may_not(check):
    plain = SUM.replace("NAME", "plain")
    assert check(plain=plain, kernels_avx2=KERNEL) == (
        0, "2 files: newer instructions in 1 of them only, which only newer machines run.\n"
    )  # fmt: skip
    failed, told = check("-mavx", plain=plain)
    assert failed
    assert "plain.cpp.o: plain(double const*, double) has v" in told
    failed, told = check("-mpopcnt", plain="int plain(unsigned long x) { return __builtin_popcountl(x); }")
    assert failed
    assert "has popcnt" in told


def test_kernels_define_nothing_that_other_files_may_call(check):
    inline = f"inline {SUM.replace('NAME', 'helper')} double (*taken)(const double*, double) = helper;"
    failed, told = check(kernels_avx2=f"{inline} {KERNEL}")
    assert failed
    assert "other files may call helper(double const*, double)" in told


def test_kernels_run_nothing_when_the_program_starts(check):
    failed, told = check(kernels_avx2=f"{KERNEL} double begin(); static double begun = begin();")
    assert failed
    assert "kernels_avx2.cpp.o: runs code when the program starts" in told


def test_a_build_without_kernels_shows_nothing(check):
    failed, told = check(plain=SUM.replace("NAME", "plain"))
    assert failed
    assert "has no kernels for AVX2" in told
