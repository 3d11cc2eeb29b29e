"""Formatting of message fields: untrusted text is escaped and truncated.

The creator of a file controls its name, its headers and the messages that libraries make of them. Unescaped they could
control a terminal, or imitate a line of volprep.
"""

from numbers import Number

from volprep_formats.shown import printable

_HEAD, _TAIL = 600, 200
"""Characters of a long text that are shown. A path is known by its end, everything else by its beginning."""


_MOST_LINES = 100


class Lines(tuple[str, ...]):
    """A field of several lines. Each is shown below the other, indented and escaped by itself."""

    __slots__ = ()


class EscapedText(str):
    """Text that has been escaped. Its `!r` puts quotes around it and escapes nothing twice."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the text in quotes."""
        return f"'{self}'"


def shown(value: object) -> object:
    """Return a field as shown in a message: numbers unchanged, everything else as text that is safe to print."""
    if isinstance(value, Number):
        return value
    if isinstance(value, Lines):
        more = [f"and {len(value) - _MOST_LINES} more"] if len(value) > _MOST_LINES else []
        return EscapedText("".join(f"\n  {visible(line)}" for line in (*value[:_MOST_LINES], *more)))
    return visible(str(value))


def visible(text: str) -> EscapedText:
    """Return `text` cut to a length, and safe to print."""
    if len(text) > _HEAD + _TAIL:
        text = f"{text[:_HEAD]} … {text[-_TAIL:]}"
    return EscapedText(printable(text))


class SafeText(str):
    """Text of volprep's own words, without anything from a file: a batch may repeat it where names must not be seen."""

    __slots__ = ()
