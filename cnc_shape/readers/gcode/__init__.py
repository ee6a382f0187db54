"""G-code of milling machines, lathes, grbl and 3D printers: text to `Program`.

=================  ==========================================================
`dialects`         which dialect, which axes: a first look over the text
`lexer`            characters to words
`blocks`           the words of a line, checked against each other
`modal`            what has been set so far
`settings`         feed, units, offsets, tool: what a block sets
`motion`, `arcs`   what a block moves
`plain`            the compiled way for straight moves
`printer`          what only 3D printers write
`rows`             moves to columns
`interpreter`      the fold over the lines
=================  ==========================================================
"""

from cnc_shape.readers.gcode.dialects import Dialect, Survey, survey
from cnc_shape.readers.gcode.interpreter import GcodeOptions, interpret

__all__ = ["Dialect", "GcodeOptions", "Survey", "interpret", "survey"]
