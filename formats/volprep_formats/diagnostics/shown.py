"""How fields of messages are shown: foreign text is escaped and cut to a length.

File names, headers and messages of libraries are written by whoever made the file. Unescaped they could steer a
terminal, or look like a line of volprep.
"""

from numbers import Number

from volprep_formats.shown import printable

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
    """Return `text` cut to a length, and safe to print."""
    if len(text) > _HEAD + _TAIL:
        text = f"{text[:_HEAD]} … {text[-_TAIL:]}"
    return Shown(printable(text))
