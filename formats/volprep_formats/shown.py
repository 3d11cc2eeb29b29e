"""Text from outside, such as names of files and values of headers, made safe to print.

A terminal obeys escape sequences, and a line break in a name makes a line that looks like a message of volprep. Marks
that turn the direction of writing make a name look like another one.
"""

_LONGEST = 400
_ESCAPED_BYTES = range(0xDC80, 0xDD00)
"""What Python makes of bytes that are not UTF-8 in names of files (PEP 383)."""


def shown(text: object, longest: int = _LONGEST) -> str:
    """Return `text` in one line of printable characters: all others become visible escapes, as in a Python string.

    Of what is longer than `longest` characters, beginning and end remain, with … between them. A path keeps its end,
    which says most.
    """
    plain = printable(str(text))
    if len(plain) <= longest:
        return plain
    end = longest // 2
    return f"{plain[: longest - end - 1]}…{plain[-end:]}"


def printable(text: str) -> str:
    r"""Return `text` with a visible escape for each character that is none, such as newlines and directions of writing.

    A byte of a file name that is no UTF-8 becomes \xNN. Backslashes stay, so escaping twice changes nothing.
    """
    return text if text.isprintable() else "".join(each if each.isprintable() else _escape(each) for each in text)


def _escape(character: str) -> str:
    code = ord(character)
    if code in _ESCAPED_BYTES:
        return f"\\x{code - 0xDC00:02x}"
    return character.encode("unicode_escape").decode("ascii")
