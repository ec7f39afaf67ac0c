"""Trackers to compare with: tracing of each frame by itself, and coherent point drift."""

import numpy as np

from withe.perception import trace_mask
from withe.perception.chain import resample


class TracedFrames:
    """A trace of each frame; the nearest trace of about the same length continues a cable."""

    def __init__(self, nodes=41, length_off=0.15):
        self.nodes, self.length_off = nodes, length_off
        self.cables = []
        self.lengths = []

    def update(self, mask):
        """Move the cables to the next frame; a cable without a trace stays."""
        lines = [resample(line, self.nodes) for line in trace_mask(mask).centrelines]
        sizes = [np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines]
        if not self.cables:
            order = np.argsort([-size for size in sizes], kind="stable")
            self.cables = [lines[i] for i in order if sizes[i] > 40.0]
            self.lengths = [sizes[i] for i in order if sizes[i] > 40.0]
            return self.cables
        costs = []
        for cable, (old, length) in enumerate(zip(self.cables, self.lengths, strict=True)):
            for line, size in zip(lines, sizes, strict=True):
                if abs(size / length - 1.0) > self.length_off:
                    continue
                for way in (line, line[::-1]):
                    costs.append((np.hypot(*(way - old).T).mean(), cable, way))
        done = set()
        for _, cable, way in sorted(costs, key=lambda cost: cost[0]):
            if cable not in done:
                done.add(cable)
                self.cables[cable] = way
        return self.cables


class CoherentPointDrift:
    """Non-rigid registration of nodes to pixels of the mask [Myronenko and Song 2010], for one cable.

    As in TrackDLO [Xiang et al. 2023], the kernel of motion depends on distances along the cable. Nodes far from all
    pixels have a small membership, so that visible nodes carry hidden nodes. This is a version of our own, without the
    published step that restores distances between nodes.
    """

    def __init__(self, nodes=41, beta=0.25, stiffness=1.0, outliers=0.1, iterations=20, points=1500):
        self.nodes, self.beta, self.stiffness = nodes, beta, stiffness
        self.outliers, self.iterations, self.points = outliers, iterations, points
        self.y = None

    def update(self, mask):
        """Move the cable to the next frame."""
        if self.y is None:
            lines = trace_mask(mask).centrelines
            longest = max(lines, key=lambda line: np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
            self.y = resample(longest, self.nodes)
            self.arc = np.linspace(0.0, 1.0, self.nodes)
            apart = self.arc[:, None] - self.arc[None]
            self.kernel = np.exp(-0.5 * (apart / self.beta) ** 2)
            return self.y
        rows, columns = np.nonzero(mask)
        keep = np.linspace(0, len(rows) - 1, min(self.points, len(rows))).astype(int)
        x = np.column_stack([columns[keep], rows[keep]]).astype(float)
        start, variance = self.y, 40.0
        near = ((start[:, None] - x[None]) ** 2).sum(axis=2).min(axis=1)
        member = np.exp(-near / 200.0)
        member /= member.sum()
        for _ in range(self.iterations):
            squares = ((self.y[:, None] - x[None]) ** 2).sum(axis=2)
            weights = member[:, None] * np.exp(-0.5 * squares / variance)
            noise = self.outliers / (1.0 - self.outliers) * 2.0 * np.pi * variance / mask.size
            weights /= weights.sum(axis=0) + noise + 1e-300
            total = weights.sum(axis=1)
            matrix = total[:, None] * self.kernel + self.stiffness * variance * np.eye(self.nodes)
            motion = np.linalg.solve(matrix, weights @ x - total[:, None] * start)
            self.y = start + self.kernel @ motion
            squares = ((self.y[:, None] - x[None]) ** 2).sum(axis=2)
            variance = max(float((weights * squares).sum() / (2.0 * weights.sum() + 1e-300)), 1.0)
        return self.y
