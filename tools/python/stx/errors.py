"""The errors of stx, and its notes."""
from __future__ import annotations

import enum
import sys
import warnings


class ErrorCode(enum.IntEnum):
    """Why a call failed; the values are the exit codes of the program stx."""

    usage = 1
    """The call itself makes no sense: an argument of another type, shape or range."""
    io = 2
    """A file cannot be read or written."""
    invalidInput = 3
    """A file or a value breaks its rules."""
    failed = 4
    """The work itself failed or was stopped."""
    unsupported = 5
    """Not available here: no GPU, no module that reads such a file."""
    difference = 7
    """What was asked for differs."""


class Error(Exception):
    """Why a call of stx failed.

    code: an ErrorCode. message: one sentence: what, found, expected. place: file, byte offset, line or view;
    "" where there is none. remedy: the part of the message that says what is expected or what to do: what
    follows its last semicolon; "" where it has none. Sentences may name options of the program stx; keywords
    of the functions here have the same names, with _ for -.
    """

    def __init__(self, code: int, message: str, place: str = "") -> None:
        super().__init__(code, message, place)
        self.code = ErrorCode(code)
        self.message = message
        self.place = place

    @property
    def remedy(self) -> str:
        return self.message.rpartition("; ")[2] if "; " in self.message else ""

    def __str__(self) -> str:
        return f"{self.place}: {self.message}" if self.place else self.message


class Note(UserWarning):
    """What a person should know of a call that worked: something is lossy, or was left out.

    Calls that get a job put their notes there; others give them as warnings of this kind.
    """


def warn(notes: tuple[str, ...]) -> None:
    """Gives notes as warnings about the line that called stx."""
    level, frame = 1, sys._getframe()
    while frame.f_back and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    for note in notes:
        warnings.warn(note, Note, stacklevel=level)
