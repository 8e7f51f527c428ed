"""What every arm is held to, whoever drives it; runs with NumPy alone."""
