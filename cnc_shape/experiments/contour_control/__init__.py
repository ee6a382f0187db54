"""Paper 004: cross-coupled control of the contour error, on axes and on a parallel machine."""
