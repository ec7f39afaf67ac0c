"""The prose linter finds what the house style forbids, in its place, and nothing else."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
SAMPLES = ROOT / "tests" / "data" / "prose"
TOOL = ROOT / "tools" / "prose_lint.py"

FORBIDDEN = {
    "bad.cpp": [
        (1, "opening"),
        (2, "number"),
        (3, "repetition"),
        (5, "opening"),
        (10, "says-so"),
        (11, "number"),
        (15, "length"),
        (15, "opening"),
    ],
    "bad.py": [
        (1, "opening"),
        (10, "length"),
        (10, "number"),
        (13, "opening"),
        (15, "repetition"),
        (15, "number"),
        (16, "range"),
    ],
    "bad.md": [(3, "number"), (3, "range"), (8, "number"), (10, "says-so")],
}


@pytest.fixture(scope="module")
def prose_lint():
    spec = importlib.util.spec_from_file_location("prose_lint", TOOL)
    module = importlib.util.module_from_spec(spec)
    sys.modules["prose_lint"] = module  # its dataclasses look themselves up
    spec.loader.exec_module(module)
    yield module
    del sys.modules["prose_lint"]


def found(prose_lint, name):
    text = (SAMPLES / name).read_text()
    return sorted((finding.first, finding.rule) for finding in prose_lint.findings_of(name, text))


@pytest.mark.parametrize("name", sorted(FORBIDDEN))
def test_bad_prose_is_found_in_its_line(prose_lint, name):
    assert found(prose_lint, name) == sorted(FORBIDDEN[name])


@pytest.mark.parametrize("name", ["good.cpp", "good.py", "good.md"])
def test_good_prose_and_code_are_not_found(prose_lint, name):
    assert found(prose_lint, name) == []


def git(folder, *arguments):
    identity = ["-c", "user.name=Tester", "-c", "user.email=tester@example.org"]
    subprocess.run(["git", *identity, *arguments], cwd=folder, check=True, capture_output=True)


def test_only_changed_lines_are_judged_when_asked(prose_lint, tmp_path, monkeypatch, capsys):
    git(tmp_path, "init", "--quiet")
    file = tmp_path / "notes.md"
    file.write_text("In .4 ms.\n\n" + "It says so.\n")
    git(tmp_path, "add", "notes.md")
    git(tmp_path, "commit", "--quiet", "-m", "Begin")
    file.write_text("In .4 ms.\n\n" + "She says so.\n")
    (tmp_path / "new.md").write_text("In .2 ms.\n")
    monkeypatch.setattr(prose_lint, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", ["prose_lint.py", "--changed", "HEAD"])
    assert prose_lint.main() == 1
    printed = capsys.readouterr().out
    assert "notes.md:3: says-so" in printed
    assert "notes.md:1" not in printed
    assert "new.md:1: number" in printed
