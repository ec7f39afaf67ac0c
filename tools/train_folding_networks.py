"""Train the networks of sheets anew: the small one, into the package, and the dissertation's, into out/.

python tools/train_folding_networks.py [--seed 0] [--source-minutes 60] [--threads 1]
"""

import argparse
from pathlib import Path

from withe import folding

ROOT = Path(__file__).resolve().parent.parent
SMALL = ROOT / "python" / "withe" / "folding" / "small.pt"
SOURCE = ROOT / "out" / "networks" / "source.pt"


def main() -> None:
    """Train both, and say how that went. Ctrl-C ends one with the best so far."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--source-minutes", type=float, default=60.0, help="at most; 0 leaves it out")
    options = parser.parse_args()
    SOURCE.parent.mkdir(parents=True, exist_ok=True)
    for name, path, minutes in (("small", SMALL, 60.0), ("source", SOURCE, options.source_minutes)):
        if minutes > 0:
            network = folding.train(name, options.seed, threads=options.threads, time_limit=60.0 * minutes)
            print(f"{path}: {network}, {network.network.training}")
            network.save(path)


if __name__ == "__main__":
    main()
