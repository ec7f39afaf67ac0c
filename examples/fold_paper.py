"""Plan how a gripper folds a sheet of A4 in half, and draw it: least force without a moment at the jaw, and no slide.

    python examples/fold_paper.py

Writes out/fold_paper.png, and both plans as CSV for a robot.
"""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

import withe
from withe.folding import Paper, plan

OUT = Path("out")

paper = Paper.a4()
plans = {
    "moment-free grasp, least force ratio": plan(paper, method="ucs"),
    "free moment at the jaw": plan(paper, method="slip", grasp="free"),
}

OUT.mkdir(exist_ok=True)
figure, axes = plt.subplots(2, 2, figsize=(11, 6.6), width_ratios=(2, 1), layout="constrained")
for (name, folded), (side, course) in zip(plans.items(), axes, strict=True):
    folded.plot(side)
    side.set_title(f"{name}: slides {1e3 * folded.slide[-1]:.1f} mm", loc="left")
    course.plot(folded.times, folded.slip_ratio, color="tab:blue")
    course.axhline(paper.friction, color="0.4", linewidth=0.8, linestyle="--")
    course.text(folded.times[-1], paper.friction, " friction", va="center", color="0.4")
    course.set(xlabel="time [s]", ylabel="friction that is needed", xlim=(0, folded.times[-1]), ylim=(-0.01, 0.62))
    course.spines[["top", "right"]].set_visible(False)
    file = folded.save(OUT / f"fold_{folded.method}.csv")
    print(f"{name}: {folded!r}\n  {file}")
figure.savefig(OUT / "fold_paper.png", dpi=130)
print(OUT / "fold_paper.png", "by withe", withe.__version__)
