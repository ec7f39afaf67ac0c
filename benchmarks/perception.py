"""Perception: every figure beside its goal, on one thread.

    python benchmarks/perception.py [--quick] [--first-seed N]

Labelled photographs are read from WITHE_DATA/mbest. If they are missing, the benchmark prints a note and skips them.
Synthetic scenes come from seeds that were not used for tuning. Speed is a ratio to one 3 x 3 distance transform of
OpenCV in the same run (d), by medians of interleaved runs, so that it is comparable between machines. On a busy machine
the fastest runs, printed beside, are more reliable.
"""

import argparse
import os
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from reporting import Report
from tracking_peers import CoherentPointDrift, TracedFrames

from withe import _core
from withe.perception import Camera, Tracker, color_filter, trace, trace_mask
from withe.perception.synthetic import CASES, SyntheticScene, make_case, render, render_mask

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "python"))
import cluttered_masks

from cable_films import NODES, RATE, SHAPE, TRUE_NODES, camera, crossing_film, hanging_film
from labelled import RANGES, dice, orders, pictures
from scoring import score

FIRST_SEED = 90_000
GOALS = {
    "crossing 90": 100,
    "crossing 60": 100,
    "crossing 45": 100,
    "crossing 30": 100,
    "crossing 20": 97,
    "crossing 15": 90,
    "ragged 60": 100,
    "ragged 30": 100,
    "three at a point": 100,
    "T": 100,
    "gap": 97,
    "loop": 100,
    "self": 100,
    "six cables": 95,
    "curls": 80,
    "specks": 100,
}


REPORT = Report("perception", quick="--quick" in sys.argv)


def beside(name, value):
    """Print one figure that has no goal, and keep it."""
    REPORT.figures[name] = value
    print(f"  {name:42s} {value:>22s}")


def line(name, shown, value, target, *, at_least=True):
    """Print one figure beside its goal, and hold it against it."""
    REPORT.goal(name, value, target, at_least=at_least)
    met = "" if REPORT.goals[-1]["met"] else "   NOT MET"
    print(f"  {name:42s} {shown:>22s}   goal: {'at least' if at_least else 'at most'} {target:g}{met}")


def photographs(folder):
    """Counts, DICE and order on the labelled images."""
    mask = color_filter(RANGES)
    found = {}
    right = total = 0
    for tier, name, image, labels in pictures(folder):
        tracing = trace(image, mask=mask)
        published = trace(image, mask=mask, method="mbest")
        default = trace(image)
        good, count = orders(tracing, labels)
        right, total = right + good, total + count
        found.setdefault(tier, []).append(
            (
                len(tracing) == labels.max(),
                len(default) == labels.max(),
                100 * dice(tracing.labels, labels)[0],
                100 * dice(published.labels, labels)[0],
                100 * dice(default.labels, labels)[0],
                name,
            )
        )
    print(f"Photographs ({sum(map(len, found.values()))})")
    for (tier, rows), ours, theirs in zip(found.items(), (99.9, 99.8, 99.7), (98.2, 97.1, 97.0), strict=True):
        exact, default = (sum(row[column] for row in rows) for column in (0, 1))
        line(f"{tier}: exact counts", f"{exact} of {len(rows)}", exact, len(rows))
        beside(f"{tier}: exact counts, default filter", f"{default} of {len(rows)}")
        mean, published, default = (statistics.mean(row[column] for row in rows) for column in (2, 3, 4))
        line(f"{tier}: DICE, mean", f"{mean:.2f}", mean, ours)
        worst = min(rows, key=lambda row: row[2])
        line(f"{tier}: DICE, worst", f"{worst[2]:.2f} ({worst[-1]})", worst[2], 99.5)
        off = abs(published - theirs)
        line(f"{tier}: DICE, mbest, from {theirs}", f"{published:.2f}", off, 0.1, at_least=False)
        beside(f"{tier}: DICE, default filter", f"{default:.2f}")
    line("order: labels that tell", f"{total}", total, 280)
    line("order: right where labels tell", f"{right} of {total}", right, total)


def synthetic(count, scale, first_seed):
    """Print the share of correct scenes of every kind."""
    print(f"Synthetic masks, {count} a case, scale {scale:g}")
    for case in CASES:
        right = touching = tips = 0
        for seed in range(first_seed, first_seed + count):
            scene = make_case(case, seed, scale)
            tracing = trace_mask(scene.mask)
            distance, tip = (8.0, 8.0) if case == "curls" else (2.0, 5.0)
            result = score(scene, tracing, distance, tip * max(scale, 1.0))
            right += result.right
            touching += not result.right and result.count > len(scene.centrelines)
            tips += not result.right and result.distance <= distance
        goal = GOALS[case] - (0 if scale == 1 else 5)
        extra = "".join(f", {n} {word}" for n, word in ((touching, "split"), (tips, "by tips only")) if n)
        line(f"{case}, scale {scale:g}: right [%]", f"{100 * right / count:.1f}{extra}", 100 * right / count, goal)


def order_of_self_crossings(count, first_seed):
    """Which strand is on top where a cable of one colour crosses itself."""
    right = total = 0
    for seed in range(first_seed, first_seed + count):
        scene = make_case("self", seed)
        tracing = trace(render(scene, np.random.default_rng(seed)), mask=scene.mask)
        total += 1
        if len(tracing.crossings) != 1 or len(tracing) != 1:
            continue
        crossing, true = tracing.crossings[0], scene.crossings[0]
        # True if the upper strand is nearer to the start, in the common direction of both lines.
        ours = tracing.centrelines[0]
        same = np.hypot(*(ours[0] - scene.centrelines[0][0])) < np.hypot(*(ours[-1] - scene.centrelines[0][0]))
        first = (crossing.over[1] < crossing.under[1]) == same
        right += first == (true.over[1] < true.under[1])
    print("Order")
    line("self-crossings, rendered: right [%]", f"{100 * right / total:.1f} of {total}", 100 * right / total, 95)


def metres():
    """Print the error of a scene that a tilted camera sees."""
    angle = np.radians(30)
    tilt = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    camera = Camera(
        [[900, 0, 320], [0, 905, 240], [0, 0, 1]],
        (-0.18, 0.05, 0.001, -0.0015, 0.004),
        tilt @ np.diag([1.0, -1.0, -1.0]),
        (0, 0, 0.9),
    )
    t = np.linspace(-0.2, 0.2, 400)
    world = [
        np.column_stack([t, 0.05 * np.sin(9 * t) + 0.02, 0 * t]),
        np.column_stack([0.03 * np.cos(11 * t), 0.7 * t, 0 * t]),
    ]
    lines = [camera.project(points) for points in world]
    mask = render_mask(lines, [9.0, 9.0], [False, False], (480, 640))
    scene = SyntheticScene(mask, lines, [9.0, 9.0], [False, False], [], [True, True])
    tracing = trace(render(scene, np.random.default_rng(0)))
    means, worsts = [], []
    for i in range(len(tracing)):
        points = tracing.points(i, camera)[:, :2]
        apart = [np.hypot(*(points[:, None] - truth[None, :, :2]).transpose(2, 0, 1)).min(axis=1) for truth in world]
        error = min(apart, key=np.mean) / (0.9 / 900)
        means.append(error.mean())
        worsts.append(error.max())
    print("Metres, camera tilted 30 degrees with distortion")
    line("error, mean [px's worth]", f"{max(means):.2f}", max(means), 1, at_least=False)
    line("error, worst [px's worth]", f"{max(worsts):.2f}", max(worsts), 3, at_least=False)


def speed(folder, rounds):
    """Medians in units of one distance transform."""
    import cv2

    cv2.setNumThreads(1)
    filter_ = color_filter(RANGES)
    images = [image for _, _, image, _ in pictures(folder)][::5]
    ratios = {}
    unit = []
    for image in images:
        mask = np.ascontiguousarray(filter_(image)).view(np.uint8)
        times = {}

        def timed(name, action, times=times):
            start = time.perf_counter()
            result = action()
            times.setdefault(name, []).append(time.perf_counter() - start)
            return result

        for _ in range(rounds):
            timed("d", lambda mask=mask: cv2.distanceTransform(mask, cv2.DIST_L2, 3))
            steps = trace_mask(mask).timings
            paths = sum(seconds for step, seconds in steps.items() if step not in ("order", "labels"))
            times.setdefault("thinning", []).append(steps.get("thin", 0.0))
            times.setdefault("mask to ordered paths", []).append(paths)
            timed("image to labels", lambda image=image: trace(image, mask=filter_))
            timed("image to labels, default filter", lambda image=image: trace(image))
            timed("colour filter", lambda image=image: filter_(image))
        d = statistics.median(times["d"])
        unit.append(d)
        for name, values in times.items():
            ratios.setdefault(name, []).append((statistics.median(values) / d, min(values) / min(times["d"])))
    goals = {"thinning": 0.8, "mask to ordered paths": 3.5, "image to labels": 7}
    print(f"Speed at 896 x 672, d = {1e3 * statistics.median(unit):.2f} ms")
    for name, values in ratios.items():
        if name != "d":
            middle, fastest = np.mean(values, axis=0)
            shown = f"{middle:.2f} (fastest {fastest:.2f})"
            if name in goals:
                line(f"{name} [d]", shown, middle, goals[name], at_least=False)
            else:
                beside(f"{name} [d]", shown)
    whole = np.mean([middle for middle, _ in ratios["image to labels"]]) * statistics.median(unit)
    line("frames a second", f"{1 / whole:.0f}", 1 / whole, 145 * 0.98e-3 / statistics.median(unit))


def nodes_in_order(nodes, first, truth):
    """Return nodes in the direction in which the first frame, `first`, agrees with the truth."""
    turned = np.hypot(*(first - truth).T).mean() > np.hypot(*(first[::-1] - truth).T).mean()
    return nodes[:, ::-1] if turned else nodes


def hidden_cables(count, first_seed):
    """Errors of the hidden 40 % of hanging cables during 2 s, and the speed of the tracker."""
    factors = {"right": 1.0, "bending stiffness 30 % lower": 0.7, "bending stiffness 30 % higher": 1.3, "none": None}
    errors, worst, seconds = {}, {}, []
    for seed in range(first_seed, first_seed + count):
        film = hanging_film(seed)
        frames = slice(*film.hidden_frames)
        masks = list(film.masks())[: frames.stop]
        truth = film.lines[: frames.stop, 0, :: (TRUE_NODES - 1) // (NODES - 1)]
        hidden = np.zeros(NODES, bool)
        hidden[(film.hidden[0] + 3) // 4 : film.hidden[1] // 4 + 1] = True
        trackers = {}
        for name, factor in factors.items():
            (rod,) = film.rods
            rod = rod if factor is None else replace(rod, bend_stiffness=factor * rod.bend_stiffness)
            tracker = Tracker(camera(), None if factor is None else rod, frame_rate=RATE)
            trackers[f"rod {name}"] = lambda mask, tracker=tracker: tracker.update(mask=mask)[0].nodes
        traced, drift = TracedFrames(), CoherentPointDrift()
        trackers["trace of each frame"] = lambda mask, traced=traced: traced.update(mask)[0]
        trackers["coherent point drift"] = drift.update
        for name, update in trackers.items():
            started = time.process_time()
            nodes = np.array([update(mask) for mask in masks])
            if name == "rod right":
                seconds.append((time.process_time() - started) / len(masks))
            error = np.linalg.norm(nodes_in_order(nodes, nodes[0], truth[0]) - truth, axis=2)[frames][:, hidden]
            errors.setdefault(name, []).append(error.mean())
            worst.setdefault(name, []).append(error.max())
    print(f"Tracking, {count} hanging cables, 40 % hidden for 2 s, {SHAPE[1]} x {SHAPE[0]}, {NODES} nodes")
    goals = {"rod right": 2, "rod bending stiffness 30 % lower": 8, "rod bending stiffness 30 % higher": 8}
    for name, values in errors.items():
        shown = f"{np.mean(values):.2f} (film {max(values):.2f}, node {max(worst[name]):.1f})"
        if name in goals:
            line(f"{name}: hidden [px]", shown, np.mean(values), goals[name], at_least=False)
        else:
            beside(f"{name}: hidden [px]", shown)
    rate = 1.0 / statistics.median(seconds)
    line("tracking, mask given [frames/s]", f"{rate:.0f}", rate, 60)


def crossing_cables(count, first_seed):
    """Count exchanges of two cables that cross, and lost cables."""
    found = {"Tracker": [0, 0], "trace of each frame": [0, 0]}
    for seed in range(first_seed, first_seed + count):
        film = crossing_film(seed)
        truth = film.lines[:, :, :: (TRUE_NODES - 1) // (NODES - 1)]
        tracker, traced = Tracker(), TracedFrames()
        updates = {
            "Tracker": lambda mask, tracker=tracker: [cable.nodes for cable in tracker.update(mask=mask)],
            "trace of each frame": lambda mask, traced=traced: list(traced.update(mask)),
        }
        nodes = {name: [] for name in updates}
        for mask in film.masks():
            for name, update in updates.items():
                nodes[name].append(update(mask))
        for name, frames in nodes.items():
            begin, end = np.array(frames[0]), np.array(frames[-1])
            swapped = lost = False
            for first, last in zip(begin, end, strict=True):
                options = [(c, w) for c in (0, 1) for w in (1, -1)]
                c, w = min(options, key=lambda o: np.hypot(*(first - truth[0, o[0], :: o[1]]).T).mean())
                right = np.hypot(*(last - truth[-1, c, ::w]).T).mean()
                other = min(np.hypot(*(last - truth[-1, 1 - c, ::v]).T).mean() for v in (1, -1))
                swapped |= bool(other < right)
                lost |= bool(right > 10.0)
            found[name][0] += swapped
            found[name][1] += lost
    print(f"Tracking, {count} films of two cables that cross")
    for name, (swapped, lost) in found.items():
        shown = f"{swapped} of {count} ({lost} more than 10 px off)"
        if name == "Tracker":
            line("exchanged names", shown, swapped, 0, at_least=False)
            line("more than 10 px off at the end", f"{lost} of {count}", lost, 0, at_least=False)
        else:
            beside(f"exchanged names, {name}", shown)


def thinning_is_exact(folder):
    """Compare thinning pixel by pixel."""
    try:
        from skimage.morphology import skeletonize
    except ImportError:
        print("scikit-image is not installed: thinning is not compared")
        return
    equal = [
        np.array_equal(_core.thin((labels > 0).view(np.uint8)) > 0, skeletonize(labels > 0))
        for _, _, _, labels in pictures(folder)
    ]
    line("thinning, bit-equal to scikit-image", f"{sum(equal)} of {len(equal)}", sum(equal), len(equal))


def learned_masks(count, first_seed, folder):
    """Overlaps of the learned mask with the truth, its warnings, its speed, and tracings on wood."""
    grounds, photos = cluttered_masks.unseen(count, first_seed), cluttered_masks.on_photographs(count, first_seed)
    print(f"Learned mask, {count} pictures of each kind that no training saw, 640 x 360")
    for kind, rows in {**grounds, **{f"photograph, {name}": rows for name, rows in photos.items()}}.items():
        learned, ground = (statistics.mean(getattr(row, word) for row in rows) for word in ("learned", "ground"))
        beside(f"{kind}: IoU", f"{learned:.2f} (ground filter {ground:.2f})")
    drawn = [row for rows in grounds.values() for row in rows]
    everything = drawn + [row for rows in photos.values() for row in rows]
    overlaps = [row.learned for row in drawn]
    line("unseen kinds: IoU, mean", f"{np.mean(overlaps):.3f}", float(np.mean(overlaps)), 0.75)
    low = float(np.quantile(overlaps, 0.05))
    line("unseen kinds: IoU, 5 % quantile", f"{low:.3f}", low, 0.40)
    poor = [row.warned for row in everything if row.default < 0.5]
    share = 100 * np.mean(poor) if poor else 100.0
    line("default mask with IoU below 0.5: warns [%]", f"{share:.0f} of {len(poor)}", float(share), 95)
    good = [row.warned for row in everything if row.default >= 0.75]
    beside("default mask with IoU of 0.75 or more: warns", f"{sum(good)} of {len(good)}")
    if folder is not None:
        rows = cluttered_masks.labelled_photographs(folder)
        overlaps, exact, warned = zip(*rows, strict=True)
        line("photographs, learned: exact counts", f"{sum(exact)} of {len(rows)}", sum(exact), 90)
        line("photographs, learned: IoU", f"{np.mean(overlaps):.3f}", float(np.mean(overlaps)), 0.88)
        line("photographs, default: warnings", f"{sum(warned)} of {len(rows)}", sum(warned), 0, at_least=False)
    fastest, middle = cluttered_masks.milliseconds(5 if count < 10 else 20)
    line("learned mask [ms]", f"{fastest:.0f} (median {middle:.0f})", fastest, 40, at_least=False)
    before, after = (cluttered_masks.on_wood(min(count, 12), first_seed, mask) for mask in ("ground", None))
    for cables in before:
        shown = f"{after[cables][0]} of {min(count, 12)} (ground filter {before[cables][0]})"
        beside(f"{cables} colours on wood: right", shown)
        swapped, earlier = after[cables][1], before[cables][1]
        line(f"{cables} colours on wood: exchanged", f"{swapped} (ground filter {earlier})", swapped, 0, at_least=False)


def main():
    """Run all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="ten scenes a case, normal scale only")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="of the synthetic scenes")
    options = parser.parse_args()
    quick, first_seed = options.quick, options.first_seed
    folder = Path(os.environ.get("WITHE_DATA", "")) / "mbest"
    present = bool(os.environ.get("WITHE_DATA")) and folder.is_dir()
    if present:
        speed(folder, 5 if quick else 15)
        thinning_is_exact(folder)
        photographs(folder)
    else:
        print("No labelled images: WITHE_DATA does not name a folder with mbest in it")
    learned_masks(2 if quick else 20, first_seed, folder if present else None)
    metres()
    hidden_cables(2 if quick else 10, first_seed)
    crossing_cables(3 if quick else 100, first_seed)
    order_of_self_crossings(20 if quick else 100, first_seed)
    synthetic(10 if quick else 40, 1.0, first_seed)
    if not quick:
        synthetic(40, 0.5, first_seed)
        synthetic(40, 2.0, first_seed)
    REPORT.write()


if __name__ == "__main__":
    main()
