"""cnc-shape: from a G-code program to its contour error."""

__version__ = "0.1.0"
