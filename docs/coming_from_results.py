"""Run the scenes of the page "Coming from another simulator" and draw docs/static/coming_from/swing.svg.

    python docs/coming_from_results.py

The scenes are the code blocks of the page itself. Needs PyElastica and MuJoCo (`make bench` installs both). Prints the
table of the page.
"""

from __future__ import annotations

import contextlib
import io
import re
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
PICTURE = HERE / "static" / "coming_from" / "swing.svg"
LINE = 14.0  # height of a line of text in the plot [mm of the tip]
GREY = "#808080"  # reads on white and on black
COLORS = {"withe": "#0072b2", "PyElastica": "#d55e00", "MuJoCo": "#009e73"}  # of Okabe and Ito
plt.rcParams |= {"svg.fonttype": "path", "svg.hashsalt": "withe", "font.size": 11}
plt.rcParams |= {f"{part}.color": GREY for part in ("text", "xtick", "ytick")}
plt.rcParams |= {"axes.labelcolor": GREY, "axes.edgecolor": GREY}


def blocks() -> dict[str, list[str]]:
    """Return the code blocks of each tab of the page."""
    page = (HERE / "coming_from.md").read_text()
    tabs = re.findall(r":::\{tab-item\} (\w+)\n(.*?)\n:::\n", page, re.DOTALL)
    return {name: re.findall(r"^```[^\n]*\n(.*?)^```", text, re.DOTALL | re.MULTILINE) for name, text in tabs}


def tips(name: str, code: list[str]) -> tuple[float, np.ndarray]:
    """Return the processor time of the blocks of a simulator [s], and the tip every 10 ms, shape (100, 3) [m]."""
    import_module({"withe": "withe", "PyElastica": "elastica", "MuJoCo": "mujoco"}[name])  # not timed
    found: dict[str, Any] = {}
    *before, last = code
    if name == "MuJoCo":
        found["model_text"] = before.pop()
        last = last.replace('from_xml_path("swing.xml")', "from_xml_string(model_text)")
    start = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):  # PyElastica prints the time of each run
        exec(last, found)
    return time.process_time() - start, np.array(found["tips"])[-100:]


def main() -> None:
    """Run all scenes, print their results and draw them."""
    ends: list[tuple[float, str]] = []
    figure, axes = plt.subplots(figsize=(7.0, 3.2))
    for name, code in blocks().items():
        seconds, motion = tips(name, code)
        x, _, z = 1e3 * motion[-1]
        lowest = 1e3 * motion[:, 2].min()
        print(f"| {name} | {lowest:.1f} mm | {x:.1f} mm, {z:.1f} mm | {seconds:.2g} s |")
        axes.plot(0.01 * np.arange(1, 101), 1e3 * motion[:, 2], color=COLORS[name], lw=1.8)
        ends.append((1e3 * motion[-1, 2], name))
    lowest = -np.inf
    for height, name in sorted(ends):
        lowest = max(height, lowest + LINE)
        axes.text(1.01, lowest, name, color=COLORS[name], va="center")
    axes.set(xlabel="time [s]", ylabel="height of the tip [mm]", xlim=(0.0, 1.0))
    axes.spines[["top", "right"]].set_visible(False)
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE, transparent=True, bbox_inches="tight", metadata={"Date": None, "Creator": None})
    print(f"Wrote {PICTURE}.")


if __name__ == "__main__":
    main()
