"""The 30 Hz loop around an arm: when to act, whether to act, what was done; runs with NumPy alone."""
