"""Labelled photographs of cables and how tracings are scored on them."""

import numpy as np
from scipy.optimize import linear_sum_assignment

# Colours that the labels follow.
RANGES = [
    ((0, 20, 75), (20, 255, 255)),
    ((160, 20, 75), (180, 255, 255)),
    ((25, 20, 75), (50, 255, 255)),
    ((50, 20, 20), (120, 255, 255)),
]


def pictures(folder):
    """Tier, name, RGB picture and labels of every image."""
    import cv2

    for tier in ("S1", "S2", "S3"):
        for path in sorted((folder / tier / "images").glob("*.jpg")):
            labels = cv2.imread(str(folder / tier / "labels" / f"{path.stem}.png"), cv2.IMREAD_GRAYSCALE)
            yield tier, path.stem, np.ascontiguousarray(cv2.imread(str(path))[..., ::-1]), labels


def dice(found, labels):
    """Mean Dice over matched cables and background, and the match: label of the picture by found label."""
    count, cables = int(found.max()), int(labels.max())
    pairs = np.zeros((count + 1, cables + 1))
    np.add.at(pairs, (found.ravel(), labels.ravel()), 1)
    scores = 2 * pairs / np.maximum(pairs.sum(axis=1)[:, None] + pairs.sum(axis=0)[None], 1)
    rows, columns = linear_sum_assignment(-scores[1:, 1:])
    matched = scores[1:, 1:][rows, columns].sum()
    match = {int(row) + 1: int(column) + 1 for row, column in zip(rows, columns, strict=True)}
    return (matched + scores[0, 0]) / (cables + 1), match


def orders(tracing, labels):
    """Crossings of two cables with the right one above, and how many the labels decide (90 % of 5 x 5 pixels)."""
    _, match = dice(tracing.labels, labels)
    right = total = 0
    for crossing in tracing.crossings:
        over, under = crossing.over[0], crossing.under[0]
        if over == under:
            continue
        x, y = np.round(crossing.point).astype(int)
        patch = labels[max(0, y - 2) : y + 3, max(0, x - 2) : x + 3]
        for cable, good in ((over, 1), (under, 0)):
            if cable + 1 in match and (patch == match[cable + 1]).mean() >= 0.9:
                total += 1
                right += good
    return right, total
