"""Scripts that run as from a shell, each in a process of its own. The process has imported large packages beforehand.

A server imports these packages once and forks itself for each script. Importing them took more than half of the
processor time of most examples.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
import types
from pathlib import Path

# Neither torch nor numba: they start threads, or read the environment of a script when they are imported.
IMPORTED = ["matplotlib.pyplot", "pyvista", "pyvista.plotting", "scipy.interpolate", "scipy.optimize", "withe"]
STOPPED_AFTER = 300.0  # [s]
ROOT = Path(__file__).resolve().parents[2]
OF_TESTS = [str(ROOT / name) for name in ("tests/python", "tests/physics", "examples", "benchmarks")]


def run_script(path: Path, arguments: list[str], folder: Path, environment: dict[str, str]) -> str:
    """Run a script in `folder` with changes of the environment, and return what it printed.

    Fails unless the script ends with exit code 0 within `STOPPED_AFTER`.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(IMPORTED)
    with tempfile.TemporaryDirectory() as logs:
        process = context.Process(target=_execute, args=(str(path), arguments, str(folder), environment, logs))
        process.start()
        process.join(STOPPED_AFTER)
        code = process.exitcode
        if code is None:
            process.kill()
            process.join()
        printed, errors = (log.read_text() if (log := Path(logs, name)).exists() else "" for name in ("out", "errors"))
    assert code == 0, f"{path.name} ended with exit code {code}\n{printed}{errors}"
    return printed


def _execute(path: str, arguments: list[str], folder: str, environment: dict[str, str], logs: str) -> None:
    """Become the script: in its folder, with its output, environment, arguments and path of modules."""
    for stream, name in ((1, "out"), (2, "errors")):
        os.dup2(os.open(Path(logs, name), os.O_WRONLY | os.O_CREAT), stream)
    os.chdir(folder)
    os.environ.update(environment)
    if backend := environment.get("MPLBACKEND"):  # which matplotlib read when the server imported it
        import matplotlib

        matplotlib.use(backend)
    multiprocessing.set_start_method(None, force=True)  # the default of scripts, not that of this server
    sys.argv = [path, *arguments]
    sys.path[:] = [str(Path(path).parent), *(place for place in sys.path if place not in OF_TESTS)]
    script = types.ModuleType("__main__")
    script.__file__ = path
    sys.modules["__main__"] = sys.modules["__mp_main__"] = script  # its classes come back from its own processes
    exec(compile(Path(path).read_bytes(), path, "exec"), script.__dict__)
