"""One simulator a file."""
