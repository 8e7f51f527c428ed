"""HCPG-Flow: flow policies for robot manipulation, guided by contact progress."""

__version__ = "0.1.0"
