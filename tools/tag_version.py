"""Version of the package: that of the last git tag, such as v0.1.0, or of CITATION.cff without tags.

scikit-build-core calls `dynamic_metadata` when it builds (pyproject.toml). `python tools/tag_version.py` prints the
version. It comes from the first of these that exists:

1. PKG-INFO in an unpacked source archive (sdist), which has the version of the checkout that made the archive
2. the last tag v* in the history of a git checkout; N commits later the version is X.Y.Z.postN
3. `version:` in CITATION.cff, for a checkout without tags and for an archive without git
"""

import re
import subprocess
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def dynamic_metadata(field: str, settings: Mapping[str, object] | None = None) -> str:
    """Return the version for scikit-build-core."""
    if field != "version" or settings:
        raise ValueError(f"tools/tag_version.py gives the version only, without settings, got {field!r}: {settings}")
    return version(ROOT)


def version(root: Path) -> str:
    """Return the version of a checkout or of an unpacked archive."""
    archive = root / "PKG-INFO"
    if archive.exists():
        return found(r"^Version: (.+)$", archive)
    return of_tag(root) or found(r"^version: (.+)$", root / "CITATION.cff")


def of_tag(root: Path) -> str | None:
    """Return the version of the last tag; None outside of a git checkout, without git, and without tags."""
    if not (root / ".git").exists():  # a folder of another checkout has no tags of ours
        return None
    command = ("git", "-C", str(root), "describe", "--tags", "--long", "--match", "v[0-9]*")
    try:
        described = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    parts = re.fullmatch(r"v(\d+\.\d+\.\d+)-(\d+)-g[0-9a-f]+", described.strip())
    if parts is None:
        return None
    return parts[1] if parts[2] == "0" else f"{parts[1]}.post{parts[2]}"


def found(pattern: str, path: Path) -> str:
    """Return what a pattern finds in a file."""
    match = re.search(pattern, path.read_text(), re.MULTILINE)
    if match is None:
        raise ValueError(f"{path} has no version")
    return match[1].strip()


if __name__ == "__main__":
    print(version(ROOT))
