"""One learning method a file; they never import each other."""
