"""The errors of cnc-shape: what went wrong, where, and what to do about it.

::

    CncShapeError                 everything a user can get wrong, or his machine cannot do
    +-- LocatedError              speaks of a file: source, line, column
    |   +-- ProgramError          a G-code program or a CSV path
    |   +-- ConfigError           a machine file
    +-- OptionError               a command-line option or an argument (also a ValueError)
    +-- InfeasibleError           valid input that no motion or loop can satisfy (also a ValueError)
    +-- OutputError               a file that cannot be written

Wrong array shapes are our own bugs and raise plain ``ValueError``.
"""

from __future__ import annotations


class CncShapeError(Exception):
    """Base of all errors that a user sees as one line and a hint.

    Parameters
    ----------
    reason
        What is wrong, in one line, with the number in it.
    hint
        What to do about it.
    source
        Name of the file the error speaks of, or None.
    line, column
        1-based place in `source`, or None.
    argument
        Parameter of the Python function that is wrong, ``max_amplitude``, or None: whoever knows where its
        value came from says so (an option of the command line, a key of the machine file).
    """

    code = "error"

    def __init__(
        self,
        reason: str,
        *,
        hint: str | None = None,
        source: str | None = None,
        line: int | None = None,
        column: int | None = None,
        argument: str | None = None,
    ) -> None:
        super().__init__(reason)
        self.reason = reason
        self.hint = hint
        self.source = source
        self.line = line
        self.column = column
        self.argument = argument

    def __str__(self) -> str:
        place = [str(part) for part in (self.source, self.line, self.column) if part is not None]
        return ":".join([*place, " error: " + self.reason]) if place else "error: " + self.reason


class LocatedError(CncShapeError):
    """An error at a place in a file; prints as ``part.nc:17:9: error: G2 needs R or I/J``."""

    def __init__(
        self, source: str, line: int | None, column: int | None, reason: str, *, hint: str | None = None
    ) -> None:
        super().__init__(reason, hint=hint, source=source, line=line, column=column)


class ProgramError(LocatedError):
    """A program or a path file that cannot be read as what it claims to be."""

    code = "program"


class ConfigError(LocatedError):
    """A machine file that does not describe a machine."""

    code = "machine"


class OptionError(CncShapeError, ValueError):
    """An option or argument outside what it may be."""

    code = "option"


class InfeasibleError(CncShapeError, ValueError):
    """Valid input that no motion, shaper or loop can satisfy."""

    code = "infeasible"


class OutputError(CncShapeError):
    """A result that cannot be written where it was asked for."""

    code = "output"
