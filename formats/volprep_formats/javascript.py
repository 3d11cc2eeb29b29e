"""Minify JavaScript: remove comments and spaces, and shorten the names of private fields.

The meaning of the text does not change. Strings, templates and regular expressions are kept, and so is each line end
after which a statement may end without a semicolon. A slash begins a regular expression exactly where a value may
begin; a text in which only a full parser could decide this is refused.
"""

import re
from collections.abc import Iterator

_PIECE = re.compile(
    r"""
    (?P<comment>//[^\n\u2028\u2029]*|/\*.*?\*/)
    |(?P<text>"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*')
    |(?P<gap>\s+)
    |(?P<word>[#@]?[\w$]+)
    |(?P<mark>=>|\?\.|&&|\|\||\?\?|\+\+|--|[^\w\s"'`/])
    """,
    re.VERBOSE | re.DOTALL,
)
_PATTERN = re.compile(r"/(?![*/])(?:[^\\/\[\n]|\\.|\[(?:[^\]\\\n]|\\.)*\])+/[a-z]*")
_TEMPLATE = re.compile(r"(?:[^`\\$]|\\.|\$(?!\{))*(?:`|\$\{)", re.DOTALL)
"""A part of a template: up to its end, or to a value in it."""
_CHAIN = re.compile(r"\(([\w$]+(?:\.[\w$]+)*)\)")
_BEFORE_A_VALUE = {
    *("await", "case", "delete", "do", "else", "extends", "in", "instanceof"),
    *("new", "of", "return", "throw", "typeof", "void", "yield"),
}
"""Words behind which a slash begins a regular expression; behind any other word it divides."""
_BEFORE_A_BLOCK = {")", "else", "try", "finally"}
_HEADS = {"if", "for", "while", "await"}
_JOINS = {",", ";", ":", "?", "&&", "||", "??", "."}
_NEVER_LAST = {"{", "(", "[", "=", "=>", "&", "|", "^", "<", ">", "*", "%", "!", "~", *_JOINS}
"""Marks behind which no statement ends."""
_NEVER_FIRST = {"}", ")", "]", "?.", *_JOINS}
"""Marks before which a line end says nothing."""


class ScriptError(ValueError):
    """The text is not what this reader of JavaScript understands."""


def stripped(text: str) -> str:
    """Return a script without comments and unneeded characters. Raises ScriptError for unsupported syntax."""
    made: list[str] = []
    gap = ""
    parentheses: list[str] = []
    head = ""
    blocks: list[bool] = []
    is_block = False
    for word in _private(_tokens(text)):
        if word.isspace():
            gap = "\n" if "\n" in gap + word else " "
            continue
        if made and made[-1] == ";" and word[0] == "}" and not (made[-2] == ")" and head in _HEADS):
            # Where a block ends, so does its last statement. Behind the head of a loop a semicolon is all of its body.
            made.pop()
        if word == "(":
            parentheses.append(made[-1] if made else "")
        elif word == ")" and parentheses:
            head = parentheses.pop()
        if word == "function" and made and made[-1] in _NEVER_LAST - {"{", ";"}:
            raise ScriptError("a function without a name of its own")
        if word == "{":
            blocks.append(bool(made) and made[-1] in _BEFORE_A_BLOCK)
        elif made and made[-1] == "}" and gap == "\n" and is_block:
            # Behind a block nothing has to end a statement.
            gap = ""
        if word == "}":
            is_block = blocks.pop() if blocks else False
        if made and gap and (between := _between(made[-1], word, gap)):
            made.append(between)
        # Declare constants with `let` too: one keyword for both compresses better.
        made.append("let" if word == "const" and made[-1:] != ["."] else word)
        gap = ""
    return "".join(made) + "\n"


def _between(before: str, token: str, gap: str) -> str:
    """Return the separator that two tokens need after white space is removed between them."""
    if gap == "\n" and before not in _NEVER_LAST and token not in _NEVER_FIRST:
        return "\n"
    joins = _is_word(before[-1]) and (_is_word(token[0]) or token[0] == "#")
    same = before[-1] == token[0] and token[0] in "+-/"
    number = before[0].isdigit() and token[0] == "."
    return " " if joins or same or number or (before.endswith("/") and token[0] == "*") else ""


def _is_word(character: str) -> bool:
    return character.isalnum() or character in "_$"


def _private(tokens: Iterator[str]) -> Iterator[str]:
    """Give private fields short names: code outside of the text cannot access them."""
    names: dict[str, str] = {}
    for token in tokens:
        is_name = token.startswith("#") and len(token) > 1
        yield names.setdefault(token, f"#{_short(len(names))}") if is_name else token


def _short(number: int) -> str:
    letters = "abcdefghijklmnopqrstuvwxyz"
    return letters[number % 26] + ("" if number < 26 else str(number // 26))


def _tokens(text: str) -> Iterator[str]:
    """Yield the tokens of a text without its comments; white space is a token, and so is each part of a template."""
    at, last = 0, ""
    braces: list[str] = []
    """Kind of each open brace: "`" for a template, or anything else."""
    while at < len(text):
        token, at = _token(text, at, last, in_template=bool(braces) and braces[-1] == "`")
        if token.startswith(("/*", "//")):
            cast = _CHAIN.match(text, at + 1) if token.startswith("/** @type") and text[at : at + 1] == " " else None
            # A cast of a name needs its parentheses only for the comment.
            if cast is not None and not _is_called(last):
                token, at = cast[1], cast.end()
            else:
                token = "\n" if "\n" in token or token.startswith("//") else " "
        yield token
        if token[0] == "}" and braces:
            braces.pop()
        if token[-1] == "{":
            braces.append("`" if len(token) > 1 else "{")
        if not token.isspace():
            last = token
    if braces:
        raise ScriptError("the text ends too soon")


def _is_called(last: str) -> bool:
    return last in {")", "]", "}", "new"} or (_is_word(last[-1:] or " ") and last not in _BEFORE_A_VALUE)


def _token(text: str, at: int, last: str, *, in_template: bool) -> tuple[str, int]:
    """Return the token at a place, and where it ends."""
    if text[at] == "`" or (in_template and text[at] == "}"):
        found = _TEMPLATE.match(text, at + 1)
    elif text[at] == "/" and text[at + 1 : at + 2] not in {"/", "*"}:
        if not _is_value(last):
            found = _PATTERN.match(text, at)
        elif last == "}":
            found = None
        else:
            return "/", at + 1
    else:
        found = _PIECE.match(text, at)
    if found is None:
        raise ScriptError(f"not understood: {text[at : at + 40]!r}")
    return text[at : found.end()], found.end()


def _is_value(last: str) -> bool:
    """Return whether a token ends a value, behind which a slash divides."""
    if not last or _is_word(last[-1]):
        return bool(last) and last not in _BEFORE_A_VALUE
    return last in {")", "]", "}"} or last[-1] in "\"'`/"
