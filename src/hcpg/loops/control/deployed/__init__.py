"""A trained policy on the robot's computer: a folder of numbers, run by NumPy and safetensors alone."""

from hcpg.loops.control.deployed.parcel import PolicyFolderError
from hcpg.loops.control.deployed.policy import Policy

__all__ = ["Policy", "PolicyFolderError"]
