"""Pictures of AprilTags whose places are known: 64 rays a pixel, blur, noise."""

import numpy as np


def pattern(cv2, number):
    """Black and white cells of a tag of family 36h11 with two cells of white around."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    cells = np.full((12, 12), 255, np.uint8)
    cells[2:10, 2:10] = cv2.aruco.generateImageMarker(dictionary, number, 8)
    return cells


def render_tags(cv2, tags, to_tag, size=(1280, 720), blur=0.8, noise=3.0, seed=0):
    """A picture of tags.

    tags: {number: (x, y) of its centre in the picture, and how far around it to draw, in pixels}. The function
    to_tag(number, x, y) gives coordinates in the tag, x right and y down from its centre. The black square goes from
    -0.5 to 0.5.
    """
    width, height = size
    picture = np.full((height, width), 190.0)
    for number, (center, reach) in tags.items():
        cells, rays = pattern(cv2, number), 8
        left, top = (int(c) - int(reach) for c in center)
        count = 2 * int(reach) + 1
        fine = (np.arange(count * rays) + 0.5) / rays - 0.5
        u, v = to_tag(number, *np.meshgrid(left + fine, top + fine))
        column, row = np.floor(8 * u + 6).astype(int), np.floor(8 * v + 6).astype(int)
        inside = (column >= 0) & (column < 12) & (row >= 0) & (row < 12)
        value = np.where(inside, cells[row.clip(0, 11), column.clip(0, 11)] * 0.75 + 30, 190.0)
        patch = value.reshape(count, rays, count, rays).mean(axis=(1, 3))
        window = picture[top : top + count, left : left + count]
        drawn = inside.reshape(count, rays, count, rays).any(axis=(1, 3))
        window[drawn] = patch[drawn]
    picture = cv2.GaussianBlur(picture, (0, 0), blur)
    picture += np.random.default_rng(seed).normal(0, noise, picture.shape)
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)


def turned_tags(cv2, rng, width, **options):
    """A picture of nine tags turned at random, and {number: (centre, angle)}."""
    truth = {}
    for i, number in enumerate(range(101, 110)):
        center = np.array([150 + (i % 5) * 240, 180 + (i // 5) * 330]) + rng.uniform(-20, 20, 2)
        truth[number] = center, rng.uniform(-np.pi, np.pi)

    def to_tag(number, x, y):
        (cx, cy), angle = truth[number]
        c, s = np.cos(angle) / width, np.sin(angle) / width
        return c * (x - cx) + s * (y - cy), -s * (x - cx) + c * (y - cy)

    places = {number: (center, 1.1 * width + 2) for number, (center, _) in truth.items()}
    return render_tags(cv2, places, to_tag, **options), truth
