"""What to execute out of K proposals, from geometry alone; runs with NumPy alone."""
