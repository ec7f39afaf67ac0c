"""Robots in files of other programs: URDF and MJCF, read by MuJoCo, and USD, read by usd-core."""

from withe.robots.description import RobotBody, RobotDescription, RobotJoint
from withe.robots.reading import read_robot

__all__ = ["RobotBody", "RobotDescription", "RobotJoint", "read_robot"]
