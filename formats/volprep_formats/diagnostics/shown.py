"""How fields of messages are shown: foreign text is escaped and cut to a length.

File names, headers and messages of libraries are written by whoever made the file. Unescaped they could steer a
terminal, or look like a line of volprep.
"""

from collections.abc import Iterable
from numbers import Number

_HEAD, _TAIL = 600, 200
"""Characters of a long text that are shown. A path is known by its end, everything else by its beginning."""


_MOST_LINES = 100


class Lines(tuple[str, ...]):
    """A field of several lines. Each is shown below the other, indented and escaped by itself."""

    __slots__ = ()


class Shown(str):
    """Text that has been escaped. Its `!r` puts quotes around it and escapes nothing twice."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the text in quotes."""
        return f"'{self}'"


def shown(value: object) -> object:
    """Return what stands for a field in a message: a number as it is, everything else as text that is safe to print."""
    if isinstance(value, Number):
        return value
    if isinstance(value, Lines):
        more = [f"and {len(value) - _MOST_LINES} more"] if len(value) > _MOST_LINES else []
        return Shown("".join(f"\n  {visible(line)}" for line in (*value[:_MOST_LINES], *more)))
    return visible(str(value))


def visible(text: str) -> Shown:
    r"""Return `text` with a visible escape for each character that is none, such as newlines and directions of writing.

    A byte of a file name that is no UTF-8 becomes \xNN. Backslashes stay, so escaping twice changes nothing.
    """
    if len(text) > _HEAD + _TAIL:
        text = f"{text[:_HEAD]} … {text[-_TAIL:]}"
    return Shown(text if text.isprintable() else "".join(_escaped(text)))


def _escaped(text: Iterable[str]) -> Iterable[str]:
    for character in text:
        code = ord(character)
        if character.isprintable():
            yield character
        elif 0xDC80 <= code <= 0xDCFF:  # a byte, as Python keeps it in names of files
            yield f"\\x{code - 0xDC00:02x}"
        else:
            yield character.encode("unicode_escape").decode("ascii")
