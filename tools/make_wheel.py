"""Build a wheel that runs without root or compiler, check what it carries, and try it in a clean environment.

`make_wheel.py` builds a wheel for the Python that runs it. `make_wheel.py --all` builds one for each Python of VERSIONS
that is installed with its headers, and names the others.

KLU, AMD, COLAMD and BTF travel inside as shared libraries. Three kinds of wheels are refused: a wheel with a library
that is partly GPL, one that needs BLAS or Fortran, and one that needs a newer glibc than 2.34.
"""

import argparse
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD, DIST = ROOT / "build", ROOT / "dist"
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
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


def interpreter(version: str) -> Path | None:
    """Return a Python of a version with its headers: this one, one on the PATH, or one of pyenv; None without any."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    candidates = [
        Path(sys.executable),
        *(Path(folder) / f"python{version}" for folder in os.environ.get("PATH", "").split(os.pathsep)),
        *sorted(pyenv.glob(f"{version}.*/bin/python{version}")),
    ]
    look = (
        "import sys, sysconfig, pathlib, ensurepip, venv; print(*sys.version_info[:2], sep='.'); "
        "sys.exit(not pathlib.Path(sysconfig.get_path('include'), 'Python.h').exists())"
    )
    for each in candidates:
        if each.exists():
            told = subprocess.run((each, "-c", look), text=True, capture_output=True)
            if told.returncode == 0 and told.stdout.strip() == version:
                return each
    return None


def builder(version: str, python: Path) -> Path:
    """Return a Python with the tools that build a wheel: this one, or that of a new environment in build/."""
    if python == Path(sys.executable):
        return python
    folder = BUILD / f"wheel_python_{version}"
    run(python, "-m", "venv", "--clear", folder)
    made = folder / "bin" / "python"
    needed = run(sys.executable, ROOT / "tools" / "requirements.py", "build").splitlines()
    run(made, "-m", "pip", "install", "--quiet", "--constraint", ROOT / "constraints.txt", *needed)
    return made


def make(python: Path) -> Path:
    """Build, repair, check, install and try the wheel of a Python; return its path."""
    raw = BUILD / "wheel_raw"
    shutil.rmtree(raw, ignore_errors=True)
    # One build folder for all: the engine does not depend on the Python, and is compiled once.
    run(python, "-m", "pip", "wheel", "--quiet", "--no-build-isolation", "--no-deps", "--wheel-dir", raw,
        "--config-settings=build-dir=build/wheel", "--config-settings=cmake.define.WITHE_PRECOMPILE_HEADERS=ON",
        ".")  # fmt: skip
    (built,) = raw.glob("*.whl")
    run("auditwheel", "repair", "--wheel-dir", DIST, built)
    (wheel,) = DIST.glob(f"{'-'.join(built.name.split('-')[:3])}-*.whl")  # name, version and Python; another platform
    members = zipfile.ZipFile(wheel).namelist()
    libraries = sorted(Path(name).name for name in members if ".libs/" in name and ".so" in name)
    print("Carries:", *libraries)
    if reasons := refusals(wheel.name, members):
        wheel.unlink()
        sys.exit(f"{wheel.name} is refused: it " + "; it ".join(reasons))
    with tempfile.TemporaryDirectory() as scratch:
        clean = Path(scratch) / "venv" / "bin" / "python"
        run(python, "-m", "venv", Path(scratch) / "venv")
        run(clean, "-m", "pip", "install", "--quiet", "--constraint", ROOT / "constraints.txt", wheel)
        print(run(clean, ROOT / "tools" / "smoke_test.py", cwd=Path(scratch)), end="")
    return wheel


def main() -> None:
    """Make the wheel of this Python, or those of all."""
    arguments = argparse.ArgumentParser(description="Build wheels into dist/, and try each in a clean environment.")
    arguments.add_argument("--all", action="store_true", help=f"for each Python of {', '.join(VERSIONS)} that is there")
    every = arguments.parse_args().all
    if shutil.which("patchelf") is None:
        sys.exit("make wheel needs patchelf on the PATH")
    library, version = platform.libc_ver()
    if library == "glibc" and tuple(map(int, version.split("."))) > BUILD_GLIBC:
        sys.exit(f"make wheel needs Debian 12 (glibc 2.36): libraries of glibc {version} would travel inside")
    shutil.rmtree(DIST, ignore_errors=True)
    # Each Python recommends its own name of the compiler, and another name would compile the engine again.
    os.environ.setdefault("CC", "cc")
    os.environ.setdefault("CXX", "c++")
    wanted = {each: interpreter(each) for each in VERSIONS} if every else {"": Path(sys.executable)}
    if not any(wanted.values()):
        sys.exit(f"make wheels found none of Python {', '.join(VERSIONS)} with its headers")
    made = [make(builder(version, python)) for version, python in wanted.items() if python is not None]
    for wheel in made:
        print(f"{wheel.relative_to(ROOT)}: {wheel.stat().st_size / 1e6:.2f} MB")
    if missing := [version for version, python in wanted.items() if python is None]:
        print(
            f"No wheel for Python {', '.join(missing)}: no interpreter with headers was found on the PATH or in pyenv"
        )


if __name__ == "__main__":
    main()
