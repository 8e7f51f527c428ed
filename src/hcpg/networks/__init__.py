"""Equinox modules, one idea a file."""
