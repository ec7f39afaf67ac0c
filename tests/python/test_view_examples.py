"""Examples and notebooks run as a user runs them, in an empty folder."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
EXAMPLES = {"helix.py": [], "ring_buckling.py": ["--nodes", "40"], "robot.py": ["--steps", "2"]}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_an_example_runs_and_writes_its_pictures(name, tmp_path, renderer):
    command = [sys.executable, ROOT / "examples" / name, *EXAMPLES[name], "--out", tmp_path]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, timeout=300)
    assert list(tmp_path.glob("*.png"))


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((ROOT / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs_from_top_to_bottom(path, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
