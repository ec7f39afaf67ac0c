"""Limits in space and time of the motions of `rods_in_motion`, ours and PyElastica's.

    python benchmarks/limits.py [withe | elastica]

This computes the limits again (in some minutes; only for the named side, if any) and writes
``benchmarks/data/limits.npz``. For every case the file holds the displacement of the tip at equidistant times, and the
difference of two extrapolations from different meshes. The two limits differ, because the rods of PyElastica have
shear and rotary inertia, and the rods of withe have neither.
"""

from __future__ import annotations

import argparse
import concurrent.futures
from pathlib import Path

import numpy as np
from reporting import DATA, bar
from rods_in_motion import CASES, Case, Motion, centreline, record
from scipy.interpolate import CubicSpline

import withe

__all__ = ["LIMITS", "load_limits"]

LIMITS = DATA / "limits.npz"
_FRAMES = 1000
# Coarsest of three meshes, and the step on it as a fraction of the source's; both are halved twice.
_OURS = {"beam a": (100, 0.1), "beam b": (100, 0.1), "helix a": (100, 0.1), "helix b": (100, 0.05)}
_ELASTICA = {"beam a": 50, "beam b": 50, "helix a": 100, "helix b": 100}


def _even(case: Case, motion: Motion) -> np.ndarray:
    return CubicSpline(motion.times, motion.tip)(np.linspace(0.0, case.duration, _FRAMES + 1))


def _extrapolate(sizes: list[float], tips: list[np.ndarray]) -> tuple[np.ndarray, float]:
    """Return the limit of the two finest results, of second order in edges and steps, and its change."""

    def limit(a: int, b: int) -> np.ndarray:
        weight = sizes[b] ** 2 / (sizes[a] ** 2 - sizes[b] ** 2)
        return tips[b] + weight * (tips[b] - tips[a])

    best, before = limit(1, 2), limit(0, 1)
    size = np.sqrt(np.mean(np.sum((best - best.mean(axis=0)) ** 2, axis=1)))
    return best, float(np.sqrt(np.mean(np.sum((best - before) ** 2, axis=1))) / size)


def _ours(case: Case, level: int) -> np.ndarray:
    edges, fraction = _OURS[case.name]
    step = case.time_step * fraction / 2**level
    return _even(
        case,
        record(
            case,
            edges * 2**level,
            case.duration,
            frames=_FRAMES,
            time_step=step,
            solver=withe.Solver(step_tolerance=1e-12),
        ),
    )


def _elastica(case: Case, level: int) -> np.ndarray:
    from elastica_rods import ElasticaRun, largest_stable_step

    elements = _ELASTICA[case.name] * 2**level
    step = 0.8 * largest_stable_step(case, elements, moved_wall=True)
    motion = ElasticaRun(case, elements, case.duration, step, moved_wall=True).record(_FRAMES)
    if motion is None:
        raise RuntimeError(f"PyElastica blew up: {case.name}, {elements} elements, step {step:g} s")
    return _even(case, motion)


def _job(key: tuple[str, str, int]) -> np.ndarray:
    side, name, level = key
    return (_ours if side == "withe" else _elastica)(CASES[name], level)


def compute(sides: list[str], path: Path = LIMITS) -> None:
    """Compute the limits of some sides on all processors, and write them beside the others."""
    keys = [(side, name, level) for level in (2, 1, 0) for side in sides for name in CASES]
    tips: dict[tuple[str, str, int], np.ndarray] = {}
    with bar(len(keys), "limits") as shown, concurrent.futures.ProcessPoolExecutor() as pool:
        futures = {pool.submit(_job, key): key for key in keys}
        for future in concurrent.futures.as_completed(futures):
            tips[futures[future]] = future.result()
            shown.advance(1)
    arrays: dict[str, np.ndarray] = {}
    if path.exists():
        with np.load(path) as kept:
            arrays.update(kept)
    for side in sides:
        for name, case in CASES.items():
            # PyElastica's first edge is half behind the wall.
            sizes = [
                1.0 / (_ELASTICA[name] * 2**k - 0.5) if side == "elastica" else 1.0 / (_OURS[name][0] * 2**k)
                for k in range(3)
            ]
            limit, apart = _extrapolate(sizes, [tips[side, name, level] for level in range(3)])
            key = f"{side} {name}"
            start = centreline(case, np.array([case.length]))[0]
            arrays[key] = (limit - start).astype(np.float32)
            arrays[f"{key} apart"] = np.array(apart)
            print(f"{key}: extrapolations of two pairs of meshes differ by {apart:.1e} of the motion")
    path.parent.mkdir(exist_ok=True)
    np.savez_compressed(path, **arrays)


def load_limits(side: str) -> dict[str, tuple[Motion, float]]:
    """Limits of "withe" or "elastica" by case, and how far off they may be, relative to the motion."""
    found = {}
    with np.load(LIMITS) as arrays:
        for name, case in CASES.items():
            start = centreline(case, np.array([case.length]))[0]
            tip = arrays[f"{side} {name}"].astype(float) + start
            times = np.linspace(0.0, case.duration, len(tip))
            found[name] = Motion(times, tip), float(arrays[f"{side} {name} apart"])
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Limits in space and time of the motions that are compared.")
    parser.add_argument("side", nargs="?", choices=["elastica", "withe"])
    asked = parser.parse_args().side
    compute([asked] if asked else ["elastica", "withe"])
