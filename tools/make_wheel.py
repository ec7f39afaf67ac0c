"""Build a wheel that runs without root or compiler, check what it carries, and try it in a clean environment.

KLU, AMD, COLAMD and BTF travel inside as shared libraries. Three kinds of wheels are refused: a wheel with a library
that is partly GPL, one that needs BLAS or Fortran, and one that needs a newer glibc than 2.34.
"""

import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
REFUSED = ("libcholmod", "libumfpack", "libblas", "libopenblas", "libgfortran")
NEWEST_GLIBC = (2, 34)
BUILD_GLIBC = (2, 36)  # whose libraries still run with 2.34


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    """Run a command and return its output; on failure print the output and stop."""
    print("+", *command, flush=True)
    result = subprocess.run(command, cwd=cwd, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if result.returncode != 0:
        sys.exit(f"{result.stdout}\nmake wheel: the command above failed ({result.returncode})")
    return result.stdout


def refusals(wheel_name: str, members: list[str]) -> list[str]:
    """Reasons why a wheel of this name with these files must not be given away."""
    reasons = [f"contains {member}" for member in members if any(bad in Path(member).name for bad in REFUSED)]
    glibc = [(int(major), int(minor)) for major, minor in re.findall(r"manylinux_(\d+)_(\d+)", wheel_name)]
    if not glibc:
        reasons.append("has no manylinux tag")
    elif min(glibc) > NEWEST_GLIBC:
        reasons.append(
            f"needs glibc {'.'.join(map(str, min(glibc)))}: manylinux_2_34 or older is wanted "
            "(build on Debian 12; std::condition_variable::wait alone makes it 2_35)"
        )
    return reasons


def main() -> None:
    """Build, repair, check, install and try."""
    if shutil.which("patchelf") is None:
        sys.exit("make wheel needs patchelf on the PATH")
    library, version = platform.libc_ver()
    if library == "glibc" and tuple(map(int, version.split("."))) > BUILD_GLIBC:
        sys.exit(f"make wheel needs Debian 12 (glibc 2.36): libraries of glibc {version} would travel inside")
    raw, dist = ROOT / "build" / "wheel_raw", ROOT / "dist"
    shutil.rmtree(raw, ignore_errors=True)
    shutil.rmtree(dist, ignore_errors=True)
    pip = (sys.executable, "-m", "pip")
    run(*pip, "wheel", "--quiet", "--no-build-isolation", "--no-deps", "--wheel-dir", raw,
        "--config-settings=build-dir=build/wheel", ".")  # fmt: skip
    run("auditwheel", "repair", "--wheel-dir", dist, *raw.glob("*.whl"))
    (wheel,) = dist.glob("*.whl")
    members = zipfile.ZipFile(wheel).namelist()
    libraries = sorted(Path(name).name for name in members if ".libs/" in name and ".so" in name)
    print("Carries:", *libraries)
    if reasons := refusals(wheel.name, members):
        wheel.unlink()
        sys.exit(f"{wheel.name} is refused: it " + "; it ".join(reasons))

    with tempfile.TemporaryDirectory() as scratch:
        python = Path(scratch) / "venv" / "bin" / "python"
        run(sys.executable, "-m", "venv", Path(scratch) / "venv")
        run(python, "-m", "pip", "install", "--quiet", "--constraint", ROOT / "constraints.txt", wheel)
        print(run(python, ROOT / "tools" / "smoke_test.py", cwd=Path(scratch)), end="")
    print(f"{wheel.relative_to(ROOT)}: {wheel.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
