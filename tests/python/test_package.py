"""Promises of the package: a light import, types, and wheels with allowed content only."""

import importlib.metadata
import importlib.util
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import withe

ROOT = Path(__file__).resolve().parent.parent.parent
LATE = ("scipy", "matplotlib", "pyvista", "imageio_ffmpeg", "IPython", "torch", "cv2", "dask", "pxr")


def load_tool(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_import_loads_numpy_and_nothing_slower(tmp_path):
    code = f"import sys, withe; print([name for name in {LATE} if name in sys.modules])"
    output = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert output.stdout.strip() == "[]"


def test_the_installed_package_is_tested_and_typed():
    folder = Path(withe.__file__).parent
    assert ROOT / "python" not in folder.parents
    assert (folder / "py.typed").is_file()
    assert (folder / "_core.pyi").is_file()


def test_version_is_the_same_everywhere():
    assert withe.__version__ == importlib.metadata.version("withe") == withe._core.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+(\.post\d+)?", withe.__version__)


def test_readme_and_citation_name_one_release():
    (cited,) = re.findall(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert re.findall(r"version = \{(.+)\}", (ROOT / "README.md").read_text()) == [cited]


def git(folder, *words):
    identity = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
    subprocess.run(["git", "-C", folder, *identity, *words], check=True, capture_output=True)


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_the_version_is_that_of_the_last_tag_and_without_tags_that_of_the_citation(tmp_path):
    version = load_tool("tag_version").version
    (tmp_path / "CITATION.cff").write_text("cff-version: 1.2.0\nversion: 0.1.0\n")
    assert version(tmp_path) == "0.1.0"
    git(tmp_path, "init", "-q")
    git(tmp_path, "commit", "-q", "--allow-empty", "-m", "first")
    assert version(tmp_path) == "0.1.0"
    git(tmp_path, "tag", "v0.2.0")
    git(tmp_path, "tag", "notes")
    assert version(tmp_path) == "0.2.0"
    for _ in range(2):
        git(tmp_path, "commit", "-q", "--allow-empty", "-m", "later")
    assert version(tmp_path) == "0.2.0.post2"
    inner = tmp_path / "archive"  # unpacked within another checkout
    inner.mkdir()
    (inner / "CITATION.cff").write_text("version: 0.1.0\n")
    assert version(inner) == "0.1.0"
    (inner / "PKG-INFO").write_text("Metadata-Version: 2.4\nVersion: 0.1.0.post3\n")
    assert version(inner) == "0.1.0.post3"


def test_pyproject_takes_the_version_from_the_tool():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert settings["project"]["dynamic"] == ["version"]
    provider = settings["tool"]["scikit-build"]["metadata"]["version"]
    assert (ROOT / provider["provider-path"] / f"{provider['provider']}.py").is_file()


def test_wheels_are_made_for_the_pythons_of_the_classifiers():
    tool, project = load_tool("make_wheel"), tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [each.rpartition(" :: ")[2] for each in project["classifiers"] if "Python :: 3." in each]
    assert tuple(named) == tool.VERSIONS
    assert project["requires-python"] == f">={tool.VERSIONS[0]}"
    assert tool.interpreter("2.0") is None


@pytest.mark.skipif(platform.libc_ver() != ("glibc", "2.36"), reason="wheels are built on Debian 12, with glibc 2.36")
def test_the_compiled_module_needs_no_newer_system_than_wheels_promise():
    names = set(re.findall(rb"(GLIBC|GLIBCXX)_(\d+)\.(\d+)(?:\.(\d+))?\0", Path(withe._core.__file__).read_bytes()))
    versions = [(library, tuple(int(part) for part in version if part)) for library, *version in names]
    assert versions
    limits = {b"GLIBC": (2, 34), b"GLIBCXX": (3, 4, 29)}
    assert [found for found in versions if found[1] > limits[found[0]]] == []


GOOD = "withe-0.1.0-cp311-cp311-manylinux_2_34_x86_64.whl"


@pytest.mark.parametrize(
    ("name", "members", "reason"),
    [
        (GOOD, ["withe.libs/libcholmod-1.so.3"], "libcholmod"),
        (GOOD, ["withe.libs/libklu-1.so", "withe.libs/libgfortran-2.so.5"], "libgfortran"),
        ("withe-0.1.0-cp311-cp311-manylinux_2_35_x86_64.whl", [], "glibc 2.35"),
        ("withe-0.1.0-cp311-cp311-linux_x86_64.whl", [], "manylinux tag"),
    ],
)
def test_a_wheel_that_carries_or_needs_too_much_is_refused(name, members, reason):
    (refusal,) = load_tool("make_wheel").refusals(name, members)
    assert reason in refusal


def test_a_wheel_with_klu_alone_is_accepted():
    tags = "withe-0.1.0-cp311-cp311-manylinux_2_27_x86_64.manylinux_2_34_x86_64.whl"
    assert load_tool("make_wheel").refusals(tags, ["withe.libs/libklu-1.so.1", "withe/_core.so"]) == []
