"""Files of robots for tests, and their motion in MuJoCo."""

from __future__ import annotations

from pathlib import Path

import numpy as np

MJCF = {
    "double_pendulum": """<mujoco model="double pendulum"><compiler angle="radian"/><worldbody>
<body name="upper" pos="0 0 0.5" euler="0 0.4 0.3">
 <joint name="shoulder" type="hinge" axis="0 1 0" ref="0.2" springref="0.7" stiffness="0.4" damping="0.01"/>
 <inertial pos="0.01 0.02 -0.1" mass="0.4" fullinertia="2e-3 3e-3 2e-3 2e-4 -1e-4 3e-4"/>
 <body name="lower" pos="0 0 -0.3"><joint name="elbow" axis="1 1 0" pos="0 0 0.01"/>
  <geom name="bar" type="capsule" fromto="0 0 0 0.1 0 -0.2" size="0.02" mass="0.3"/></body>
</body></worldbody></mujoco>""",
    "scara": """<mujoco model="scara"><default><geom contype="0" conaffinity="0"/></default><worldbody>
<body name="column" pos="0 0 0.1"><geom type="cylinder" size="0.05 0.1" mass="4"/>
 <body name="inner" pos="0 0 0.1"><joint name="first" axis="0 0 1" damping="0.02"/>
  <geom type="box" pos="0.1 0 0" size="0.1 0.02 0.01" mass="0.8"/>
  <body name="outer" pos="0.2 0 0" euler="0 0 40"><joint name="second" axis="0 0 1"/>
   <geom type="box" pos="0.08 0 0" size="0.08 0.02 0.01" mass="0.5"/>
   <body name="quill" pos="0.16 0 0"><joint name="lift" type="slide" axis="0 0 1" stiffness="80" damping="0.5"/>
    <geom type="capsule" size="0.01 0.05" pos="0.01 0 -0.02" mass="0.2"/>
    <site name="tip" pos="0 0 -0.08"/></body></body></body></body>
</worldbody></mujoco>""",
    "tree": """<mujoco model="tree"><default><geom contype="0" conaffinity="0"/></default><worldbody>
<body name="trunk" pos="0 0 1" euler="10 20 0"><freejoint name="floating"/>
 <geom type="box" size="0.1 0.05 0.03" mass="2"/>
 <body name="sensor" pos="0.08 0.03 0.05" euler="0 0 30"><geom type="box" size="0.02 0.01 0.02" mass="0.3"/>
  <body name="mast" pos="0 0 0.1"><geom type="sphere" size="0.02" mass="0.1"/></body></body>
 <body name="left" pos="0 0.06 0"><joint name="left hip" axis="0 1 0" stiffness="1" springref="60"/>
  <geom type="capsule" fromto="0 0 0 0.1 0 -0.1" size="0.01" mass="0.2"/>
  <body name="foot" pos="0.1 0 -0.1"><geom type="sphere" size="0.02" mass="0.1"/></body></body>
 <body name="right" pos="0 -0.06 0"><joint name="right hip" type="slide" axis="1 0 1" stiffness="30"/>
  <geom type="cylinder" size="0.01 0.05" mass="0.2"/></body>
 <body name="tail" pos="-0.1 0 0"><joint name="tail ball" type="ball"/>
  <geom type="capsule" fromto="0 0 0 -0.15 0.03 0.05" size="0.008" mass="0.1"/></body>
</body></worldbody></mujoco>""",
    "several_joints": """<mujoco model="several joints"><compiler angle="radian"/>
<default><geom contype="0" conaffinity="0"/></default><worldbody>
<body name="trunk" pos="0 0 1"><joint name="along" type="slide" axis="1 0 0" stiffness="40" springref="0.1"/>
 <joint name="up" type="slide" axis="0 0 1" stiffness="90" damping="0.3"/>
 <joint name="pitch" axis="0 1 0" pos="0.02 0 0.01" stiffness="4" springref="0.3"/>
 <geom type="box" size="0.15 0.05 0.04" mass="3"/>
 <body name="thigh" pos="0.1 0.05 -0.04" euler="0.2 0 0.1">
  <joint name="hip x" axis="1 0 0" stiffness="2" springref="0.4"/>
  <joint name="hip z" axis="0 0 1" stiffness="1" springref="-0.5" damping="0.01"/>
  <joint name="hip y" axis="0 1 0" stiffness="3" springref="0.6"/>
  <geom type="capsule" fromto="0 0 0 0.03 0 -0.2" size="0.02" mass="0.5"/>
  <body name="shin" pos="0.03 0 -0.2"><joint name="knee" axis="0 1 0" pos="0 0 0.01" stiffness="2"/>
   <joint name="tibia" type="slide" axis="0 0 1" stiffness="300" springref="0.02"/>
   <geom type="capsule" fromto="0 0 0 0 0.01 -0.2" size="0.015" mass="0.3"/></body></body>
 <body name="tail" pos="-0.15 0 0"><joint name="out" type="slide" axis="1 0 0" stiffness="200" springref="-0.03"/>
  <joint name="tail ball" type="ball"/>
  <geom type="capsule" fromto="0 0 0 -0.15 0.03 0.05" size="0.008" mass="0.1"/></body>
</body></worldbody></mujoco>""",
}


def _link(name: str, mass: float, at: str, inertia: str, shape: str = "") -> str:
    xx, yy, zz, xy = inertia.split()
    return (
        f'<link name="{name}"><inertial><origin xyz="{at}" rpy="0.1 0.2 -0.3"/><mass value="{mass}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="0" iyz="0"/></inertial>{shape}</link>'
    )


def _joint(name: str, kind: str, parent: str, child: str, at: str, axis: str = "0 0 1", more: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}" rpy="0.1 0 0.2"/><axis xyz="{axis}"/>{more}</joint>'
    )


_DAMPED = '<dynamics damping="0.02"/>'
_BOX = '<visual><origin xyz="0 0 -0.1"/><geometry><box size="0.04 0.04 0.2"/></geometry></visual>'
URDF = {
    "double_pendulum": '<robot name="double pendulum"><link name="base"/>'
    + _link("upper", 0.4, "0.01 0.02 -0.1", "2e-3 3e-3 2e-3 2e-4", _BOX)
    + _link("lower", 0.3, "0 0.03 -0.1", "1e-3 2e-3 1.5e-3 1e-4", _BOX)
    + _joint("shoulder", "continuous", "base", "upper", "0 0 0.5", "0 1 0", _DAMPED)
    + _joint("elbow", "continuous", "upper", "lower", "0 0 -0.3", "1 0.5 0")
    + "</robot>",
    "scara": '<robot name="scara">'
    + _link("base", 4.0, "0 0 0.1", "1e-2 1e-2 1e-2 0", _BOX)
    + _link("inner", 0.8, "0.1 0 0", "1e-3 3e-3 3e-3 0")
    + _link("outer", 0.5, "0.08 0 0", "1e-3 2e-3 2e-3 0")
    + _link("quill", 0.2, "0.01 0 -0.02", "2e-4 2e-4 1e-4 0")
    + _joint("first", "continuous", "base", "inner", "0 0 0.2", more=_DAMPED)
    + _joint("second", "continuous", "inner", "outer", "0.2 0 0")
    + _joint("lift", "prismatic", "outer", "quill", "0.16 0 0", more='<dynamics damping="1.5"/>')
    + "</robot>",
    "tree": '<robot name="tree">'
    + _link("base", 2.0, "0 0 0.01", "1e-2 1e-2 1e-2 0")
    + _link("left", 0.3, "0.05 0 -0.05", "1e-3 1e-3 1e-3 1e-4")
    + _link("foot", 0.1, "0 0.01 0", "1e-4 1e-4 1e-4 0")
    + '<link name="sole"/>'
    + _link("right", 0.2, "0.02 0 -0.1", "1e-3 1e-3 1e-3 1e-4")
    + _link("hand", 0.1, "0.02 0 -0.1", "1e-4 1e-4 1e-4 0")
    + _joint("left hip", "continuous", "base", "left", "0 0.1 0", "0 1 0")
    + _joint("ankle", "fixed", "left", "foot", "0.1 0 -0.1")
    + _joint("ground", "fixed", "foot", "sole", "0 0 -0.02")
    + _joint("right hip", "continuous", "base", "right", "0 -0.1 0", "0 1 0")
    + _joint("wrist", "continuous", "right", "hand", "0 0 0", "1 0 0")
    + "</robot>",
}


def written(folder: Path, name: str, suffix: str) -> Path:
    """Write a robot into a folder and return its path."""
    path = folder / f"{name}{suffix}"
    path.write_text(URDF[name] if suffix == ".urdf" else MJCF[name])
    return path


def motion_in_mujoco(path: Path, duration: float, gravity: np.ndarray, step: float = 2e-5) -> dict[str, tuple]:
    """Return the position and the axes of each body that moves, after a motion from rest by RK4, without contact."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = step
    model.opt.gravity = gravity
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    for _ in range(round(duration / step)):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    moving = [body for body in range(model.nbody) if model.body_weldid[body] == body != 0]
    return {model.body(i).name: (data.xpos[i].copy(), data.xmat[i].reshape(3, 3).copy()) for i in moving}
