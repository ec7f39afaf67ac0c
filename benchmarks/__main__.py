"""Run benchmarks, one process each, and list what reached its goal.

python benchmarks [--quick] [NAME ...]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

from reporting import OUT, bar

NAMES = (
    "newton_iteration",
    "sparse_solvers",
    "skips",
    "settings",
    "drawing",
    "gradients",
    "parallel",
    "rl_throughput",
    "work_precision",
    "peers",
    "bodies",
    "friction_precision",
    "robustness",
    "ablation",
    "conservation",
    "contact",
    "contact_fold",
    "contact_robustness",
    "perception",
    "real2sim",
    "deployment",
    "deployment_tables",
    "deployment_uses",
    "folding",
    "folding_trials",
    "folding_spin",
    "folding_replay",
)


def main() -> int:
    """Run the requested benchmarks, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"by default {', '.join(NAMES)}")
    parser.add_argument("--quick", action="store_true", help="the short form of each")
    options = parser.parse_args()
    unknown = set(options.names) - set(NAMES)
    if unknown:
        parser.error(f"no benchmark of the name {', '.join(sorted(unknown))}; there are {', '.join(NAMES)}")
    names, failed = options.names or NAMES, []
    with bar(len(names), "benchmarks", "benchmarks") as shown:
        for name in names:
            print(f"\n== {name}", flush=True)
            command = [sys.executable, str(Path(__file__).with_name(f"{name}.py")), *["--quick"] * options.quick]
            if subprocess.run(command, check=False).returncode != 0:
                failed.append(name)
            shown.advance(1)
    print("\n== goals")
    for name in names:
        path = OUT / f"{name}.json"
        if name in failed or not path.exists():
            print(f"  {name}: " + ("failed" if name in failed else "has no file of figures"))
            continue
        goals = json.loads(path.read_text())["goals"]
        missed = [goal["name"] for goal in goals if not goal["met"]]
        print(f"  {name}: {len(goals) - len(missed)} of {len(goals)} met" + "".join(f"\n    not: {n}" for n in missed))
    return len(failed)


if __name__ == "__main__":
    sys.exit(main())
