"""The code of README.md runs as it stands there."""

import re
from pathlib import Path

import numpy as np

README = Path(__file__).resolve().parent.parent.parent / "README.md"


def test_the_robot_of_the_readme_curls_its_fingers():
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    assert len(blocks) >= 2
    names = {}
    for block in blocks:
        exec(compile(block.replace("record.plot()", "pass"), str(README), "exec"), names)
    tips = np.array([names["record"].positions(finger)[:, -1, :2] for finger in names["simulation"].rods[1:]])
    first, last = (np.linalg.norm(tips[:, frame], axis=-1) for frame in (0, -1))
    np.testing.assert_allclose(first, 0.06, rtol=1e-3)
    assert np.all(last < 0.5 * first)
