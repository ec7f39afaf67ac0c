"""Train the networks of sheets and grasps anew: the small ones, into the package, and the dissertation's, into out/.

python tools/train_networks.py [folding deployment] [--seed 0] [--source-minutes 60] [--threads 1]
"""

import argparse
from pathlib import Path

from withe import deployment, folding

ROOT = Path(__file__).resolve().parent.parent
ROOMS = {"folding": folding.train, "deployment": deployment.train}


def main() -> None:
    """Train both of each room, and say how that went. Ctrl-C ends one with the best so far."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(ROOMS)}; by default all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--source-minutes", type=float, default=60.0, help="at most; 0 leaves it out")
    options = parser.parse_args()
    unknown = set(options.rooms) - set(ROOMS)
    if unknown:
        parser.error(f"no networks of {', '.join(sorted(unknown))}; there are {', '.join(ROOMS)}")
    out = ROOT / "out" / "networks"
    out.mkdir(parents=True, exist_ok=True)
    for room in options.rooms or ROOMS:
        files = {"small": ROOT / "python" / "withe" / room / "small.pt", "source": out / f"{room}_source.pt"}
        for name, path in files.items():
            minutes = options.source_minutes if name == "source" else 60.0
            if minutes > 0:
                network = ROOMS[room](name, options.seed, threads=options.threads, time_limit=60.0 * minutes)
                print(f"{path}: {network}, {network.network.training}")
                network.save(path)


if __name__ == "__main__":
    main()
