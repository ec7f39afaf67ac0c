"""Figures of the learned mask, on grounds that its training never saw: drawn kinds, photographs, and wood.

The photographs are samples of scikit-image, such as a wooden table, brick, a machine and printed pages, with drawn
cables on them.
"""

import importlib.util
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import withe
from labelled import pictures
from scoring import score
from withe.perception import ground_filter, learned_filter, trace
from withe.perception.backgrounds import cast_shadow, wood
from withe.perception.cluttered_pictures import make_picture
from withe.perception.synthetic import SyntheticScene, make_case, render, render_mask
from withe.perception.unseen_clutter import UNSEEN_GROUNDS

SHAPE = (360, 640)
PHOTOGRAPHS = {
    "wood": ("coffee",),
    "print": ("page", "text", "color"),
    "machine": ("motorcycle_left",),
    "rough": ("brick", "gravel", "grass", "coins"),
    "people and animals": ("astronaut", "camera", "chelsea"),
}
VIVID = [(200, 40, 40), (40, 90, 200), (40, 150, 60), (235, 200, 40), (120, 50, 140), (240, 240, 240)]


@dataclass
class Figure:
    """Overlaps of one picture: of the learned mask, the ground filter and the default mask; True if `trace` warned."""

    learned: float
    ground: float
    default: float
    warned: bool


def overlap(found, truth):
    """Return the intersection over the union of two masks; 1 if both are empty."""
    union = (found | truth).sum()
    return float((found & truth).sum() / union) if union else 1.0


def traced(image, mask=None):
    """Return the tracing, and True if its mask looked poor."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        tracing = trace(image, mask=mask)
    return tracing, any(issubclass(each.category, withe.PoorMaskWarning) for each in caught)


def figure(image, truth):
    """Return the overlaps of one picture."""
    learned, ground = learned_filter(image), ground_filter(image)
    tracing, warned = traced(image)
    used = learned if tracing.mask_method == "learned" else ground
    return Figure(overlap(learned, truth), overlap(ground, truth), overlap(used, truth), warned)


def unseen(count, first_seed):
    """Return the figures of each kind of ground that no training saw."""
    return {
        kind: [
            figure(made.image, made.mask)
            for made in (
                make_picture([first_seed, seed], SHAPE, UNSEEN_GROUNDS, kind, cables=True) for seed in range(count)
            )
        ]
        for kind in UNSEEN_GROUNDS
    }


def photograph(name):
    """Return the middle of a sample picture of scikit-image, as large as SHAPE."""
    import cv2

    data = Path(importlib.util.find_spec("skimage").origin).parent / "data"
    (path,) = data.glob(f"{name}.*")
    image = cv2.imread(str(path))[..., ::-1]
    factor = max(SHAPE[0] / image.shape[0], SHAPE[1] / image.shape[1])
    size = int(np.ceil(image.shape[1] * factor)), int(np.ceil(image.shape[0] * factor))
    image = cv2.resize(np.ascontiguousarray(image), size, interpolation=cv2.INTER_AREA)
    top, left = (image.shape[0] - SHAPE[0]) // 2, (image.shape[1] - SHAPE[1]) // 2
    return image[top : top + SHAPE[0], left : left + SHAPE[1]].astype(np.float32)


def on_photographs(count, first_seed):
    """Return the figures of each kind of photograph, or nothing without scikit-image."""
    if importlib.util.find_spec("skimage") is None:
        return {}
    found = {}
    for kind, names in PHOTOGRAPHS.items():
        for name in names:
            background = photograph(name)
            for seed in range(count):
                made = make_picture([first_seed, seed], SHAPE, background=background, cables=True)
                found.setdefault(kind, []).append(figure(made.image, made.mask))
    return found


def labelled_photographs(folder):
    """Return for each photograph: the overlap of the learned mask, True if its count is right, True if it warned."""
    found = []
    for _, _, image, labels in pictures(folder):
        tracing, _ = traced(image, "learned")
        _, warned = traced(image)
        found.append((overlap(learned_filter(image), labels > 0), len(tracing) == labels.max(), warned))
    return found


def coloured_cables_on_wood(cables, seed):
    """Return a scene of cables of different colours, and its picture on wood."""
    case = make_case("crossing 60" if cables == 2 else "six cables", seed)
    lines, widths = case.centrelines[:cables], case.widths[:cables]
    closed, cut = [False] * cables, case.cut[:cables]
    crossings = [each for each in case.crossings if max(each.over[0], each.under[0]) < cables]
    mask = render_mask(lines, widths, closed, case.mask.shape, cut)
    scene = SyntheticScene(mask, lines, widths, closed, crossings, cut)
    rng = np.random.default_rng(seed)
    ground = cast_shadow(wood(rng, mask.shape), mask, rng)
    return scene, render(scene, rng, VIVID[:cables], background=ground, grain=3.0, shading=0.45)


def exchanged(scene, tracing):
    """Count traced cables that follow one true cable over more than a tenth of their points, and then another."""
    count = 0
    for line in tracing.centrelines:
        apart = np.stack([np.hypot(*(line[:, None] - true[None]).transpose(2, 0, 1)).min(axis=1)
                          for true in scene.centrelines])  # fmt: skip
        clear = np.partition(apart, 1, axis=0)[1] > 12 if len(apart) > 1 else np.ones(len(line), bool)
        shares = np.bincount(apart.argmin(axis=0)[clear], minlength=len(apart)) / max(clear.sum(), 1)
        count += np.sort(shares)[-1] < 0.9
    return int(count)


def on_wood(count, first_seed, mask=None):
    """Return for 2, 4 and 6 cables the number of right pictures, and of traces that change from cable to cable."""
    found = {}
    for cables in (2, 4, 6):
        right = swapped = 0
        for seed in range(first_seed, first_seed + count):
            scene, image = coloured_cables_on_wood(cables, seed)
            tracing, _ = traced(image, mask)
            right += score(scene, tracing, tolerance=8.0, tip_tolerance=8.0).right
            swapped += exchanged(scene, tracing)
        found[cables] = right, swapped
    return found


def milliseconds(rounds):
    """Return the processor time of the learned mask of a picture of SHAPE, on one thread, in the fastest round [ms]."""
    import cv2

    cv2.setNumThreads(1)
    image = make_picture(0, SHAPE).image
    times = []
    for _ in range(rounds):
        started = time.process_time()
        learned_filter(image)
        times.append(time.process_time() - started)
    return 1e3 * min(times), 1e3 * float(np.median(times))
