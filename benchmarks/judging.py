"""Shared parts of the stress tests: cases judged one by one, and tables of the results.

A case has a `number`; so has a verdict, with `reason`, empty where the case was accepted, and `detail`.
"""

from __future__ import annotations

import argparse
import collections
import concurrent.futures
import faulthandler
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from typing import Any

from reporting import Report, arguments, bar

HANG = 180.0  # [s], on the wall
CRASH = "crash or hang"


def case_options(doc: str, count: int, *extra: tuple[str, dict]) -> argparse.Namespace:
    """Which cases to judge: `cases`, `first`, `case`; and options of the benchmark's own."""
    return arguments(
        doc,
        *extra,
        ("--cases", {"type": int, "default": count, "help": "how many (default: %(default)s)"}),
        ("--first", {"type": int, "default": 0, "help": "number of the first"}),
        ("--case", {"type": int, "help": "only this one, and everything about it"}),
    )


def judge_one(judge: Callable[[int], Any], draw_case: Callable[[int], Any], number: int) -> None:
    """Judge a case, print everything about it, and leave."""
    verdict = judge(number)
    for name, value in {**asdict(draw_case(number)), **asdict(verdict)}.items():
        print(f"  {name:16s} {value}")
    sys.exit(bool(verdict.reason))


def _watched(judge: Callable[[int], Any], number: int) -> Any:
    faulthandler.dump_traceback_later(HANG, exit=True)
    try:
        return judge(number)
    finally:
        faulthandler.cancel_dump_traceback_later()


def judge_all(
    judge: Callable[[int], Any], verdict: Callable[..., Any], numbers: list[int], title: str, workers: int | None = None
) -> list[Any]:
    """Verdicts on all cases, on all processors; a crash or a hang costs one case, whose `verdict` is made here."""

    def alone(number: int) -> Any:
        """A case in a process of its own, after one in company took the process down."""
        with concurrent.futures.ProcessPoolExecutor(1) as pool:
            try:
                return pool.submit(_watched, judge, number).result()
            except BrokenProcessPool:
                return verdict(number, CRASH, f"the process ended, or ran longer than {HANG:g} s")

    verdicts: dict[int, Any] = {}
    with bar(len(numbers), title, "cases") as shown:
        while len(verdicts) < len(numbers):
            waiting = [number for number in numbers if number not in verdicts]
            with concurrent.futures.ProcessPoolExecutor(workers) as pool:
                futures = {pool.submit(_watched, judge, number): number for number in waiting}
                broken = []
                for future in concurrent.futures.as_completed(futures):
                    try:
                        verdicts[futures[future]] = future.result()
                        shown.advance(1)
                    except BrokenProcessPool:
                        broken.append(futures[future])
            # Runs that were active when the process ended are listed first among the failed ones.
            for number in sorted(broken, key=waiting.index)[:4]:
                verdicts[number] = alone(number)
                shown.advance(1)
    return [verdicts[number] for number in numbers]


def report_verdicts(
    report: Report,
    cases: Sequence[Any],
    verdicts: Sequence[Any],
    by: dict[str, tuple[str, Iterable[str]]],
    columns: dict[str, Callable[[Any], object]],
    name: str = "",
) -> collections.Counter[str]:
    """Tables of what was accepted, by attributes of the cases (title: attribute, values), and of all that was not.

    `name` is that of a set of cases. Returns how often each reason was given.
    """
    of_set = f": {name}" if name else ""
    for title, (attribute, values) in by.items():
        rows = []
        for value in values:
            chosen = [v for v, case in zip(verdicts, cases, strict=True) if getattr(case, attribute) == value]
            rows.append((value, f"{sum(not v.reason for v in chosen)} of {len(chosen)}"))
        report.table(f"Accepted, by {title}{of_set}", (title, "accepted"), rows)
    reasons = collections.Counter(verdict.reason for verdict in verdicts if verdict.reason)
    report.table(f"Not accepted{of_set}", ("reason", "cases"), reasons.most_common())
    report.table(
        f"Case by case (run one with --case NUMBER){of_set}",
        ("case", *columns, "reason"),
        [
            (case.number, *(show(case) for show in columns.values()), f"{verdict.reason}: {verdict.detail}")
            for case, verdict in zip(cases, verdicts, strict=True)
            if verdict.reason
        ],
    )
    report.figures[f"verdicts_{name}" if name else "verdicts"] = [asdict(verdict) for verdict in verdicts]
    return reasons
