"""Groups of whole numbers that are united one pair after the other."""

from __future__ import annotations

__all__ = ["UnionFind"]


class UnionFind:
    """Groups of whole numbers; the root of a group is its smallest member."""

    def __init__(self, count: int) -> None:
        self._parents = list(range(count))

    def find(self, i: int) -> int:
        """The root of the group of i."""
        while self._parents[i] != i:
            self._parents[i] = self._parents[self._parents[i]]
            i = self._parents[i]
        return i

    def unite(self, i: int, j: int) -> None:
        """Make the groups of i and j one."""
        low, high = sorted((self.find(i), self.find(j)))
        self._parents[high] = low
