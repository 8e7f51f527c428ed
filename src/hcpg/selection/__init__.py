"""What to execute out of K proposals, from geometry alone; runs with NumPy alone."""

from hcpg.selection.selecting import Diagnostics, select
from hcpg.selection.selectors import RULES, Selector
from hcpg.types import Scene

__all__ = ["RULES", "Diagnostics", "Scene", "Selector", "select"]
