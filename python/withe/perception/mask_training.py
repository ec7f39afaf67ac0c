"""Training of the network behind the learned mask, on made pictures of cables on cluttered ground."""

from __future__ import annotations

import math
import os
import threading
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from withe.common import validation
from withe.common.extras import require
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.io import written_beside
from withe.learning.network_training import own_torch
from withe.perception.cluttered_pictures import make_picture
from withe.perception.mask_network import as_written, make_module, to_onnx

__all__ = ["STEPS", "MaskTraining", "train_mask"]

STEPS = 70_000
_SIZE = 256  # height and width of the pictures [px]
_BATCH = 4
_FRESH = 1  # new pictures per step; the others of a batch were used before
_WINDOW = 960  # latest pictures from which a batch is drawn
_RATE, _DECAY = 2.5e-3, 1e-4  # of AdamW
_WARM_UP = 150  # steps in which the rate increases
_CONSTANT = 0.75  # share of the steps after which the rate decreases
_SAVE_EVERY = 250  # [steps]
_FORMAT = "withe mask training, 1"
_AGREEMENT = 1e-4  # greatest difference of OpenCV's probabilities from those of torch

Sample = tuple[NDArray[np.uint8], NDArray[np.bool_]]


@dataclass
class MaskTraining:
    """Record of a training.

    Attributes
    ----------
    path : Path
        The ONNX file.
    steps : int
    seed : int
    losses : list of float [-]
        Loss of each step, those before an interruption included.
    seconds : float [s]
        Duration, without interruptions.
    """

    path: Path
    steps: int
    seed: int
    losses: list[float] = field(default_factory=list)
    seconds: float = 0.0


@keyword_hints
def train_mask(
    path: str | os.PathLike[str],
    seed: int = 0,
    *,
    steps: int = STEPS,
    threads: int = 1,
    workers: int = 1,
    progress: bool = True,
) -> MaskTraining:
    """Train the network of the learned mask, and write it as an ONNX file.

    The training resumes where it was interrupted if the folder has its checkpoint, a file NAME.checkpoint.pt. The
    checkpoint is written every 250 steps, and removed at the end. A resumed training may have another number of steps,
    if the rate of learning did not decrease yet; the result is that of an uninterrupted training of so many steps.

    Parameters
    ----------
    path : str or Path
        The ONNX file to write.
    seed : int
        Seed of the pictures, of the weights and of the order. Equal seeds give equal networks with the same versions
        of NumPy, OpenCV and torch, the same number of threads and the same kind of processor.
    steps : int
        Number of steps, with four pictures of 256 x 256 px each.
    threads : int
        Number of threads of torch.
    workers : int
        Number of processes that draw pictures. 0 draws them in this process. The number does not change the result.
    progress : bool
        True to show a progress bar on a terminal.

    Returns
    -------
    MaskTraining

    Raises
    ------
    ValueError
        A path that does not end in .onnx, numbers out of range, or a checkpoint of another training.
    ImportError
        torch or OpenCV is not installed.
    RuntimeError
        OpenCV computes other values from the file than torch does.
    OSError
        The file or the checkpoint cannot be written.

    Examples
    --------
    >>> train_mask("mask.onnx", seed=0)  # doctest: +SKIP
    """
    record = MaskTraining(
        Path(path), validation.integer(steps, "steps", 1, 10_000_000), validation.integer(seed, "seed", 0, 2**31 - 1)
    )
    if record.path.suffix != ".onnx":
        raise ValueError(f"path must end in .onnx, got {record.path.name!r}")
    validation.integer(threads, "threads", 1, 1024)
    validation.integer(workers, "workers", 0, 1024)
    require("cv2", "vision")
    torch = require("torch", "learn")
    with own_torch(threads, seed), ExitStack() as stack:
        module = make_module().to(memory_format=torch.channels_last)
        optimizer = torch.optim.AdamW(module.parameters(), lr=_RATE, weight_decay=_DECAY)
        checkpoint = record.path.with_suffix(".checkpoint.pt")
        if checkpoint.exists():
            _resume(checkpoint, record, module, optimizer)
        first = len(record.losses)
        bar = stack.enter_context(progress_bar(steps, "training", progress, unit="steps"))
        module.train()
        half = _multiplies_half()
        window: deque[Sample] = deque(maxlen=_WINDOW)
        oldest = max(0, _FRESH * (first + 1) + _BATCH - _WINDOW)
        samples = stack.enter_context(_Samples(seed, oldest, workers))
        started = time.perf_counter() - record.seconds
        for step in range(first, steps):
            while samples.drawn < _FRESH * (step + 1) + _BATCH:
                window.append(next(samples))
            for group in optimizer.param_groups:
                group["lr"] = _RATE * _schedule(step, steps)
            pictures, masks = _batch(window, np.random.default_rng([seed, 1, step]))
            optimizer.zero_grad()
            with torch.autocast("cpu", torch.bfloat16, enabled=half):
                scores = module(pictures)
            loss = _loss(scores.float(), masks)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(module.parameters(), 1.0)
            optimizer.step()
            record.losses.append(float(loss.detach()))
            record.seconds = time.perf_counter() - started
            bar.update(step + 1)
            if (step + 1) % _SAVE_EVERY == 0 and step + 1 < steps:
                _save(checkpoint, record, module, optimizer)
        _finish(record, module)
        checkpoint.unlink(missing_ok=True)
    return record


def _schedule(step: int, steps: int) -> float:
    """Return the rate of learning over its greatest value: it increases, is constant, and decreases linearly to zero.

    The first steps do not depend on the number of steps, so that a training may be shortened or extended.
    """
    constant_until = _constant_until(steps)
    return min((step + 1) / _WARM_UP, 1.0, (steps - step) / (steps - constant_until))


def _constant_until(steps: int) -> int:
    return math.floor(_CONSTANT * steps)


def _multiplies_half() -> bool:
    """Return True if the processor multiplies matrices of 16 bits, in which a step takes half as long."""
    ask = getattr(require("torch", "learn").cpu, "get_capabilities", None)  # of newer versions
    return ask is not None and bool(ask().get("amx_bf16", False))


def _draw(seed: int, index: int) -> Sample:
    require("cv2", "vision").setNumThreads(1)
    picture = make_picture([seed, 0, index], (_SIZE, _SIZE))
    return picture.image, picture.mask


def _end_with_parent() -> None:
    """End this process when the training is killed, which otherwise leaves its processes waiting for pictures."""
    parent = parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


class _Samples:
    """Pictures in the order of their numbers, drawn ahead by other processes."""

    def __init__(self, seed: int, first: int, workers: int) -> None:
        self.drawn = first
        self._seed, self._asked = seed, first
        self._pool = ProcessPoolExecutor(workers, get_context("spawn"), _end_with_parent) if workers else None
        self._pending: deque[Future[Sample]] = deque()

    def __enter__(self) -> _Samples:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def __iter__(self) -> Iterator[Sample]:
        return self

    def __next__(self) -> Sample:
        self.drawn += 1
        if self._pool is None:
            return _draw(self._seed, self.drawn - 1)
        while len(self._pending) < 16:
            self._pending.append(self._pool.submit(_draw, self._seed, self._asked))
            self._asked += 1
        return self._pending.popleft().result()


def _batch(window: deque[Sample], rng: np.random.Generator) -> tuple[Any, Any]:
    """Return pictures and masks as tensors: the latest ones and earlier ones, turned, mirrored and recoloured."""
    torch = require("torch", "learn")
    latest = range(len(window) - min(_FRESH, len(window)), len(window))
    chosen = [*latest, *rng.integers(0, len(window), _BATCH - len(latest))]
    pictures, masks = np.empty((_BATCH, _SIZE, _SIZE, 3), np.float32), np.empty((_BATCH, _SIZE, _SIZE), np.float32)
    for row, index in enumerate(chosen):
        image, mask = window[index]
        if rng.random() < 0.5:
            image, mask = image.transpose(1, 0, 2), mask.T
        turn = (slice(None, None, rng.choice([-1, 1])), slice(None, None, rng.choice([-1, 1])))
        picture = image[turn].astype(np.float32) / 255
        if rng.random() < 0.3:
            picture = picture[..., rng.permutation(3)]
        pictures[row] = np.clip(picture * rng.uniform(0.8, 1.2) + rng.uniform(-0.06, 0.06), 0, 1)
        masks[row] = mask[turn]
    tensor = torch.from_numpy(pictures).permute(0, 3, 1, 2)  # a view in the layout "channels last"
    return tensor, torch.from_numpy(masks)[:, None]


def _loss(scores: Any, masks: Any) -> Any:
    """Return the cross entropy plus one minus the Dice coefficient of the batch."""
    functional = require("torch", "learn").nn.functional
    entropy = functional.binary_cross_entropy_with_logits(scores, masks)
    shares = scores.sigmoid()
    overlap = 2 * (shares * masks).sum() + 1
    return 2 * entropy + 1 - overlap / (shares.sum() + masks.sum() + 1)


def _save(path: Path, record: MaskTraining, module: Any, optimizer: Any) -> None:
    torch = require("torch", "learn")
    state = {"module": module.state_dict(), "optimizer": optimizer.state_dict()}
    kept = {"format": _FORMAT, "seed": record.seed, "steps": record.steps}
    with written_beside(path) as part:
        torch.save({**kept, **state, "losses": record.losses, "seconds": record.seconds}, part)


def _resume(path: Path, record: MaskTraining, module: Any, optimizer: Any) -> None:
    torch = require("torch", "learn")
    try:
        kept = torch.load(path, weights_only=True)
        found = kept["format"], kept["seed"], kept["steps"]
    except Exception as error:
        raise ValueError(f"{path} must be a checkpoint of train_mask, got: {error}. Delete the file") from error
    if found[:2] != (_FORMAT, record.seed):
        raise ValueError(
            f"{path} must be a checkpoint of the seed {record.seed}, got {found}. Give this seed, or delete it"
        )
    done, latest = len(kept["losses"]), min(_constant_until(steps) for steps in (found[2], record.steps))
    if found[2] != record.steps and done > latest:
        raise ValueError(
            f"steps must be {found[2]}, as in {path}, whose {done} steps exceed {latest}, got {record.steps}. Delete "
            "the file to start from the first step"
        )
    module.load_state_dict(kept["module"])
    optimizer.load_state_dict(kept["optimizer"])
    record.losses, record.seconds = list(kept["losses"]), kept["seconds"]


def _finish(record: MaskTraining, module: Any) -> None:
    """Write the network, and compare OpenCV's result with that of torch."""
    cv2, torch = require("cv2", "vision"), require("torch", "learn")
    note = {"seed": str(record.seed), "steps": str(record.steps), "seconds": f"{record.seconds:.0f}"}
    weights = {name: values.numpy() for name, values in module.state_dict().items()}
    content = to_onnx(weights, note)
    module.load_state_dict({name: torch.from_numpy(values) for name, values in as_written(weights).items()})
    module.eval()
    network = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
    picture = make_picture([record.seed, 2], (_SIZE, _SIZE + 64)).image
    blob = np.ascontiguousarray(picture.transpose(2, 0, 1)[None], np.float32) / np.float32(255)
    network.setInput(blob)
    with torch.no_grad():
        expected = torch.nn.functional.pixel_unshuffle(module(torch.from_numpy(blob)).sigmoid(), 2).numpy()
    apart = float(np.abs(network.forward() - expected).max())
    if not apart < _AGREEMENT:
        raise RuntimeError(f"OpenCV and torch must agree to {_AGREEMENT}, got a difference of {apart}")
    record.path.parent.mkdir(parents=True, exist_ok=True)
    with written_beside(record.path) as part:
        Path(part).write_bytes(content)
