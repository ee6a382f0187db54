"""Characters to words: comments out, blanks out, upper case, and where each word stood.

A word is a letter and a number: ``X-.5``, ``G01``, ``x 1 2 . 5``. Numbers are an ASCII pattern. The quick
way knows no columns; only when something is wrong is the line looked at again, character by character.
"""

from __future__ import annotations

import re

NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
WORD = re.compile(f"([A-Z])({NUMBER})")
WORDS = re.compile(f"(?:[A-Z]{NUMBER})*")

_FOREIGN = re.compile(r"[^\x00-\x7f]")
_COMMENT = re.compile(r"\([^()]*\)")
_NOT_YET = {
    "[": ("expressions in brackets are not built yet", "write the number"),
    "]": ("expressions in brackets are not built yet", "write the number"),
    "#": ("parameters (#) are not built yet", "write the number"),
    "=": ("assignments to parameters are not built yet", "write the numbers"),
    "@": ("polar coordinates (@ and ^) are not built yet", "write X and Y"),
    "^": ("polar coordinates (@ and ^) are not built yet", "write X and Y"),
}


class BlockError(Exception):
    """Something is wrong with a line; `column` is known, or follows from the place of a word.

    Parameters
    ----------
    reason, hint
        As in `ProgramError`.
    letter
        The word to point at: its letter, or its full text such as ``G81``.
    column
        1-based column, where it is known.
    """

    def __init__(
        self, reason: str, *, hint: str | None = None, letter: str = "", column: int | None = None
    ) -> None:
        super().__init__(reason)
        self.reason = reason
        self.hint = hint
        self.letter = letter
        self.column = column


def compact(text: str) -> str:
    """Return the line without comments and blanks, in upper case.

    Raises
    ------
    BlockError
        For an unclosed or a nested comment.
    """
    if "(" in text or ";" in text:
        text = strip_comments(text)
    if not text.isascii():
        text = _FOREIGN.sub("\x7f", text)  # some letters have an ASCII capital: they shall not pass as words
    return text.replace(" ", "").replace("\t", "").upper()


def strip_comments(text: str) -> str:
    """Blank the comments out; columns stay what they are."""
    parts: list[str] = []
    at = 0
    while True:
        opening, semicolon = text.find("(", at), text.find(";", at)
        if opening < 0 and semicolon < 0:
            parts.append(text[at:])
            return "".join(parts)
        if opening < 0 or 0 <= semicolon < opening:
            parts.append(text[at:semicolon])
            return "".join(parts)
        comment = _COMMENT.match(text, opening)
        if comment is None:
            closing, nested = text.find(")", opening), text.find("(", opening + 1)
            if closing < 0:
                raise BlockError("the comment is not closed", hint="close it with )", column=opening + 1)
            raise BlockError("comments cannot be nested", hint="take the inner ( away", column=nested + 1)
        parts.append(text[at:opening] + " " * (comment.end() - opening))
        at = comment.end()


def split_words(text: str) -> list[tuple[str, str]]:
    """Split a compacted line into letters and numbers; refuse it if it is not all words."""
    if WORDS.fullmatch(text) is None:
        raise BlockError("not all words")
    return WORD.findall(text)


def diagnose(line: str) -> BlockError:
    """Say what is wrong with a line that `split_words` refused.

    `line` is the text as it stands in the file, comments included.
    """
    text = strip_comments(line)
    upper = _FOREIGN.sub("\x7f", text).upper()
    kept = [(column, char) for column, char in enumerate(upper, 1) if char not in " \t"]
    packed = "".join(char for _, char in kept)
    if re.match(r"BEGINPGM|[0-9]*BEGINPGM", packed):
        return BlockError(
            "Heidenhain conversational text (BEGIN PGM) is not G-code",
            hint="post the program in ISO G-code",
            column=kept[0][0],
        )
    o_word = re.match(r"/?(?:N[0-9.]+)?O(?![0-9]+$)", packed)
    if o_word:
        return BlockError(
            "O-words (subroutines and loops) are not built yet",
            hint="unroll the program",
            column=kept[o_word.end() - 1][0],
        )
    at = 0
    while match := WORD.match(packed, at):
        at = match.end()
    if at >= len(packed):
        return BlockError("the line cannot be read")
    column, char = kept[at]
    if char in _NOT_YET:
        reason, hint = _NOT_YET[char]
        return BlockError(reason, hint=hint, column=column)
    if "A" <= char <= "Z":
        return _word_without_number(kept, packed, at)
    if char == "." or char.isdecimal():
        return BlockError(
            f"a number goes wrong at {char!a}", hint="a number has one decimal point", column=column
        )
    return BlockError(
        f"bad character {text[column - 1]!a}", hint="only words such as X1.5 may stand here", column=column
    )


def _word_without_number(kept: list[tuple[int, str]], packed: str, at: int) -> BlockError:
    column, letter = kept[at]
    following = packed[at + 1 :].lstrip("+-")
    if following and following[0] in _NOT_YET:
        reason, hint = _NOT_YET[following[0]]
        place = packed.index(following[0], at + 1)
        return BlockError(reason, hint=hint, column=kept[place][0])
    return BlockError(f"{letter} has no number", hint=f"write it as {letter}1.5", column=column)


def column_of(line: str, word: str) -> int | None:
    """Return the 1-based column of a word's last occurrence in a line: ``X``, or in full such as ``G81``.

    A full word is found as it is written or with leading zeros.
    """
    text = _FOREIGN.sub("\x7f", strip_comments(line)).upper()
    if not word:
        return None
    if len(word) == 1:
        pattern = word
    else:
        whole, point, fraction = word[1:].partition(".")
        pattern = rf"{word[0]}[ \t]*0*{whole}" + (rf"\.{fraction}" if point else "") + r"(?![0-9])"
    found = [match.start() + 1 for match in re.finditer(pattern, text)]
    return found[-1] if found else None
