"""The three standard streams as the verbs need them, whatever the shell gave."""

import codecs
import os
import sys
from io import BufferedWriter, FileIO, TextIOWrapper
from typing import IO, TYPE_CHECKING, Any, cast

from volprep_formats.shown import escaped

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_PLAIN = {"×": "x", "–": "-", "…": "...", "°": " deg", "·": "*", "µ": "u", "²": "^2", "³": "^3"}
"""ASCII replacements of the non-ASCII characters in volprep's texts, for ASCII-only terminals."""


def prepare_streams() -> bool:
    """Open closed standard streams, and make writing to them never fail because of an encoding or a full disk.

    Return whether standard output was open. Whatever is written to them, by libraries too, is escaped: only `unescaped`
    can steer a terminal.
    """
    # Otherwise the next opened file would become standard output, and receive printed text.
    was_open = True
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            _open_nothing(descriptor)
            was_open &= descriptor != 1
    if sys.stdout is None:
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - as long as the process
    codecs.register_error("volprep", _in_other_letters)
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout is sys.__stdout__:
        named = BufferedWriter(_Named(1, "w", closefd=False))
        sys.stdout = _Escaping(named, sys.stdout.encoding, "volprep", line_buffering=sys.stdout.line_buffering)
    elif isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="volprep")
    # Tests put streams of their own here.
    if sys.stderr is sys.__stderr__:
        encoding = getattr(sys.stderr, "encoding", "utf-8")
        raw = BufferedWriter(_Lossy(2, "w", closefd=False))
        sys.stderr = _Escaping(raw, encoding, "volprep", line_buffering=True)
    return was_open


def unescaped(stream: IO[str]) -> IO[str]:
    """Return a standard stream as one for colours and bars; foreign text for it must have been escaped."""
    return cast("IO[str]", _Unescaped(stream)) if isinstance(stream, _Escaping) else stream


class _Escaping(TextIOWrapper):
    """A text stream whose lines hold printable characters only."""

    def write(self, text: str, /) -> int:
        super().write("\n".join(map(escaped, text.split("\n"))))
        return len(text)


class _Unescaped:
    """The stream below an escaping one."""

    def __init__(self, stream: TextIOWrapper) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        return TextIOWrapper.write(self._stream, text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class _Named(FileIO):
    """Standard output, whose errors name it: others without a name are of working files."""

    def write(self, data: "ReadableBuffer", /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise OSError(error.errno, error.strerror, "standard output") from error


class _Lossy(FileIO):
    """A text file that ignores write errors: unreadable progress is no reason to stop a build."""

    def write(self, data: "ReadableBuffer", /) -> int:
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


def _open_nothing(descriptor: int) -> None:
    opened = os.open(os.devnull, os.O_RDWR)
    if opened != descriptor:
        os.dup2(opened, descriptor)
        os.close(opened)


def _in_other_letters(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that the stream cannot encode, and bytes of file names that are not UTF-8."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    return "".join(_PLAIN.get(word) or word.encode("unicode_escape").decode("ascii") for word in text), error.end
