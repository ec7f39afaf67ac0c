"""Print the requirements of this project, one a line: `requirements.py [build] [runtime] [EXTRA ...]`.

Lets make install what a step needs without building the package first.
"""

import re
import sys
import tomllib
from pathlib import Path


def requirements(names: list[str]) -> list[str]:
    """Requirements of the named groups; an extra that names `withe[...]` is resolved."""
    project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())
    groups = project["project"]["optional-dependencies"] | {
        "build": project["build-system"]["requires"] + ["cmake>=3.25", "ninja"],
        "runtime": project["project"]["dependencies"],
    }
    found: list[str] = []
    for name in names:
        for requirement in groups[name]:
            own = re.fullmatch(r"withe\[(.+)\]", requirement)
            found += requirements(own[1].split(",")) if own else [requirement]
    return list(dict.fromkeys(found))


if __name__ == "__main__":
    print("\n".join(requirements(sys.argv[1:])))
