"""A robot arm from an MJCF file carries a soft cable by its gripper.

The file describes a base, a turret, an upper arm, a forearm and a gripper. Springs and dampers of the hinges are
servos: the rest angle of each spring moves to its goal. At rest the torque of each servo must balance the moment of
the weights behind its hinge, which are those of the links and of the cable. The moment is the sum of all weights times
their levers. The example fails if a torque is wrong by more than 0.1 % of the greatest one.

Writes out/arm.xml and out/arm_with_cable.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import withe

ARM = """<mujoco model="arm">
  <default><joint armature="0"/><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="base">
      <geom type="cylinder" size="0.09 0.03" pos="0 0 0.03" mass="6"/>
      <body name="turret" pos="0 0 0.06">
        <joint name="waist" axis="0 0 1" stiffness="300" damping="20"/>
        <geom type="cylinder" size="0.06 0.06" pos="0 0 0.06" mass="2"/>
        <body name="upper arm" pos="0 0 0.14">
          <joint name="shoulder" axis="0 1 0" stiffness="600" damping="30"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.035" mass="1.5"/>
          <body name="forearm" pos="0 0 0.4">
            <joint name="elbow" axis="0 1 0" stiffness="300" damping="15"/>
            <geom type="capsule" fromto="0 0 0 0.35 0 0" size="0.028" mass="0.8"/>
            <body name="hand" pos="0.35 0 0">
              <joint name="wrist" axis="0 1 0" stiffness="80" damping="3"/>
              <geom type="box" size="0.03 0.035 0.02" pos="0.03 0 0" mass="0.25"/>
              <body name="gripper" pos="0.06 0 0">
                <geom type="box" size="0.03 0.006 0.015" pos="0.03 0.018 0" mass="0.05"/>
                <geom type="box" size="0.03 0.006 0.015" pos="0.03 -0.018 0" mass="0.05"/>
                <site name="jaws" pos="0.05 0 0"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
# Mass [kg] and centre in its axes [m] of each link. The hand and the gripper that is fixed to it are one body.
CENTERS = {
    "turret": (2.0, (0.0, 0.0, 0.06)),
    "upper arm": (1.5, (0.0, 0.0, 0.2)),
    "forearm": (0.8, (0.175, 0.0, 0.0)),
    "hand": (0.35, ((0.25 * 0.03 + 0.1 * 0.09) / 0.35, 0.0, 0.0)),
}
GOAL = {"waist": -1.1, "shoulder": 0.45, "elbow": -0.6, "wrist": 0.7}  # [rad]
LENGTH, RADIUS, NODES = 0.45, 7e-3, 41  # of the cable [m]
RISE, UNTIL = 1.5, 4.0  # [s]
TIME_STEP = 5e-3  # [s]
TORQUE_ERROR = 1e-3  # allowed error over the greatest torque


def described(path: Path) -> tuple[withe.Scene, withe.Robot, withe.Rod]:
    """Return the arm of a file with a cable at its jaws."""
    scene = withe.Scene()
    arm = scene.add_robot(path)
    jaws = np.array(arm.points["jaws"].position)
    rubber = withe.Material(youngs_modulus=4e6, density=1200.0, viscosity=4e4)
    along = LENGTH * np.array([0.8, 0.0, -0.6])
    cable = scene.add_rod(start=jaws, end=jaws + along, nodes=NODES, radius=RADIUS, material=rubber, name="cable")
    scene.join(cable.start, arm["gripper"])
    return scene, arm, cable


def torques(simulation: withe.Simulation, arm: withe.Robot, cable: withe.Rod) -> dict[str, tuple[float, float]]:
    """Return the torque of each servo and the moment of the weights behind it about its axis [N m]."""
    gravity = np.array([0.0, 0.0, -9.81])
    places, weights = {}, {}
    for link, (mass, center) in CENTERS.items():
        places[link] = simulation.position(arm[link]) + simulation.rotation(arm[link]) @ center
        weights[link] = mass * gravity
    nodes = simulation.positions(cable)
    edges = 0.5 * (nodes[1:] + nodes[:-1])
    edge_weight = 1200.0 * np.pi * RADIUS**2 * LENGTH / (NODES - 1) * gravity
    found = {}
    for number, (name, link) in enumerate(zip(GOAL, CENTERS, strict=True)):
        joint, axes = arm.joints[name], simulation.rotation(arm[link])
        turn = simulation.joint_angle(joint) - simulation.get(joint, "rest_angle")
        hinge, axis = simulation.position(arm[link]), axes[:, 2 if name == "waist" else 1]
        moment = np.cross(edges - hinge, edge_weight).sum(axis=0)
        for behind in list(CENTERS)[number:]:
            moment += np.cross(places[behind] - hinge, weights[behind])
        found[name] = (-simulation.get(joint, "stiffness") * turn, float(axis @ moment))
    return found


def main() -> None:
    """Write the file, carry the cable, check the torques, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    path = arguments.out / "arm.xml"
    path.write_text(ARM)
    scene, arm, cable = described(path)
    simulation = scene.build(integrator="backward_euler", time_step=TIME_STEP)
    for name, angle in GOAL.items():
        simulation.set(arm.joints[name], rest_angle=angle, over=RISE)
    record = simulation.run(UNTIL, 0.05, progress=False)
    simulation.equilibrium()
    found = torques(simulation, arm, cable)
    greatest = max(abs(torque) for torque, _ in found.values())
    error = max(abs(torque + moment) for torque, moment in found.values()) / greatest
    for name, (torque, moment) in found.items():
        print(f"{name}: torque {torque:.4f} N m, moment of the weights {moment:.4f} N m")
    picture = arguments.out / "arm_with_cable.png"
    record.picture(picture, ghosts=(0, 15), camera=(0.5, -1.0, 0.4), ground=0.0)
    print(f"Wrote {picture}.")
    if error > TORQUE_ERROR:
        sys.exit("The torques of the servos do not balance the weights.")


if __name__ == "__main__":
    main()
