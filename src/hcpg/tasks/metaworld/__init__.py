"""Tasks of Meta-World."""
