"""Copy pictures of examples from a folder of results into examples/pictures: 1200 pixels wide at most, 256 colours.

python tools/example_pictures.py out servo_arm tendon_arm
"""

import sys
from pathlib import Path

from PIL import Image

WIDEST, COLORS = 1200, 256
FOLDER = Path(__file__).resolve().parent.parent / "examples" / "pictures"


def main() -> None:
    """Copy the pictures of the given names."""
    source, *names = sys.argv[1:]
    for name in names:
        picture = Image.open(Path(source) / f"{name}.png").convert("RGB")
        if picture.width > WIDEST:
            size = WIDEST, round(picture.height * WIDEST / picture.width)
            picture = picture.resize(size, Image.Resampling.LANCZOS)
        path = FOLDER / f"{name}.png"
        picture.quantize(COLORS, dither=Image.Dither.FLOYDSTEINBERG).save(path, optimize=True)
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
