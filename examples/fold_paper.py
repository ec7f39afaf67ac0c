"""Plan how a gripper folds a sheet of A4 in half, and draw it: least force without a moment at the jaw, and no slide.

    python examples/fold_paper.py

Writes out/fold_paper.png, and both plans as CSV for a robot.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import withe
from withe.folding import Paper, plan
from withe.view import style

OUT = Path("out")

paper = Paper.a4()
plans = {
    "moment-free grasp, least force ratio": plan(paper, method="ucs"),
    "free moment at the jaw": plan(paper, method="slip", grasp="free"),
}

print("Takes about 4 s.", flush=True)
OUT.mkdir(exist_ok=True)
colors = style.use()
figure, axes = plt.subplots(2, 2, figsize=(11, 6.6), width_ratios=(2, 1))
for (name, folded), (side, course) in zip(plans.items(), axes, strict=True):
    folded.plot(side)
    side.set_title(f"{name}: slides {1e3 * folded.slide[-1]:.1f} mm", loc="left")
    course.plot(folded.times, folded.slip_ratio, color=colors.blue)
    course.axhline(paper.friction, color=colors.grey, linewidth=0.8, linestyle="--")
    course.text(0.0, paper.friction, "friction of the table", va="bottom", color=colors.grey)
    course.set(title="coefficient of friction that is needed", xlim=(0, folded.times[-1]), ylim=(-0.01, 0.62))
    style.label(course, x=("time", "s"), y="coefficient of friction")
    file = folded.save(OUT / f"fold_{folded.method}.csv")
    print(f"{name}: {folded!r}\n  {file}")
figure.savefig(OUT / "fold_paper.png")
print(OUT / "fold_paper.png", "by withe", withe.__version__)
