"""Text from outside, such as names of files and values of headers, made safe to print.

A terminal obeys escape sequences, and a line break in a name makes a line that looks like a message of volprep. Marks
that turn the direction of writing make a name look like another one.
"""

import re

_LONGEST = 400
# pathlib writes one slash for two.
_SCHEME = r"(?:[A-Za-z][A-Za-z0-9+.-]*://|\b(?:https?|ftps?|sftp|s3|gs|gcs|az|abfs):/)"
_USER = re.compile(rf"({_SCHEME})[^/\s]*@")
_QUERY = re.compile(rf"({_SCHEME}[^\s?#'\"<>]*)[?#][^\s'\"<>]*")
_ADDRESS = re.compile(rf"(?:^|/)({_SCHEME}.*)")
_ESCAPED_BYTES = range(0xDC80, 0xDD00)
"""Surrogates that represent, in Python, bytes of file names that are not UTF-8 (PEP 383)."""


def shown(text: object, longest: int = _LONGEST) -> str:
    """Return `text` in one line of printable characters: all others become visible escapes, as in a Python string.

    If longer than `longest` characters, the middle is replaced by …. A path keeps its end, its most informative part.
    """
    plain = printable(str(text))
    if len(plain) <= longest:
        return plain
    end = longest // 2
    return f"{plain[: longest - end - 1]}…{plain[-end:]}"


def without_secrets(text: str) -> str:
    """Return `text` without the names, passwords, queries and fragments of the addresses in it.

    A password or a presigned query gives access to a store. It belongs neither into a file nor onto a screen.
    """
    if ":/" not in text:
        return text
    return _QUERY.sub(r"\1?***", _USER.sub(r"\1***@", text))


def address_in(path: str) -> str | None:
    """Return the address that was taken for a path, such as http:/host/scan.nii; None if it is an ordinary path."""
    found = _ADDRESS.search(path)
    return re.sub(":/+", "://", found[1], count=1) if found else None


def printable(text: str) -> str:
    r"""Return `text` with every unprintable character escaped, such as newlines and directions of writing.

    Secrets of addresses are left out: see `without_secrets`.

    A byte of a file name that is not UTF-8 becomes \xNN. Backslashes stay, so escaping twice changes nothing.
    """
    return escaped(without_secrets(text))


def escaped(text: str) -> str:
    """Return `text` with every unprintable character escaped."""
    return text if text.isprintable() else "".join(word if word.isprintable() else _escape(word) for word in text)


def _escape(character: str) -> str:
    code = ord(character)
    if code in _ESCAPED_BYTES:
        return f"\\x{code - 0xDC00:02x}"
    return character.encode("unicode_escape").decode("ascii")
