"""Tasks of the built-in point suite."""
