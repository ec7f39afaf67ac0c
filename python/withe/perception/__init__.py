"""Find every rope or cable in an image, in order, and which one lies on top. Follow them through films.

>>> import withe
>>> tracing = withe.perception.trace("cables.jpg")  # doctest: +SKIP
>>> tracing.centrelines[0]                          # (n, 2) pixels, end to end # doctest: +SKIP
"""

from withe.perception.boards import CharucoBoard, Chessboard
from withe.perception.camera import Camera
from withe.perception.drawing import draw, draw_tracked
from withe.perception.film import FilmFrame, read_film
from withe.perception.learned_mask import learned_filter
from withe.perception.mask_quality import MaskQuality
from withe.perception.mask_training import MaskTraining, train_mask
from withe.perception.masks import border_filter, color_filter, ground_filter, network_mask
from withe.perception.results import Ambiguity, Crossing, Joint, Tracing
from withe.perception.rod_prior import RodPrior
from withe.perception.tags import TagDetection, detect_tags
from withe.perception.tracing import trace, trace_mask
from withe.perception.tracker import TrackedCable, Tracker
from withe.perception.triangulation import CableInSpace, triangulate

__all__ = [
    "Ambiguity",
    "CableInSpace",
    "Camera",
    "CharucoBoard",
    "Chessboard",
    "Crossing",
    "FilmFrame",
    "Joint",
    "MaskQuality",
    "MaskTraining",
    "RodPrior",
    "TagDetection",
    "Tracing",
    "TrackedCable",
    "Tracker",
    "border_filter",
    "color_filter",
    "detect_tags",
    "draw",
    "draw_tracked",
    "ground_filter",
    "learned_filter",
    "network_mask",
    "read_film",
    "trace",
    "trace_mask",
    "train_mask",
    "triangulate",
]
