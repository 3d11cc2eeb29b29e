"""Shaders in the 16-bit floats of phones: after each operation of the text stands a rounding to 11 bits.

A device may compute what a shader declares mediump with 16-bit floats; other drivers take 32 bits whatever is declared,
and show nothing of it. So the rounding is written out. The shaders that ship are highp throughout: this text is for
measuring what less would cost.

The text is read as the grammar of GLSL ES has it, as far as the parts in glsl/ use it: statements in functions, and in
them expressions, by precedence. Declarations, conditions of loops, and constants stay as they are. Rounded are the
results of + - * /, and of the functions that compute something new.
"""

import re
from collections.abc import Iterable

_TOKEN = re.compile(
    r"(?P<space>\s+|//[^\n]*|^\#[^\n]*)"
    r"|(?P<number>\d+\.\d*(?:[eE][-+]?\d+)?|\d+(?:[eE][-+]?\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<sign>\+\+|--|[-+*/]=|[<>=!]=|&&|\|\||[^\w\s])",
    re.MULTILINE,
)
_LEVELS: tuple[tuple[str, ...], ...] = (("||",), ("&&",), ("==", "!="), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/"))
_ROUNDED = frozenset(("+", "-", "*", "/"))
_FUNCTIONS = frozenset(
    ("exp", "exp2", "log", "log2", "pow", "sqrt", "inversesqrt", "dot", "length", "normalize", "mix", "reflect")
)
_FETCHES = frozenset(("texture", "textureLod", "texture2D"))
_TYPES = frozenset(("float", "vec2", "vec3", "vec4"))
_WHOLE = ("int", "ivec2", "ivec3", "ivec4")
"""Types whose values are not rounded; all others are, because the reader does not know types."""
_ASSIGNMENTS = frozenset(("=", "+=", "-=", "*=", "/="))
_HEAD = "precision highp float;\n"
_HALF = "half_float"


def in_half_floats(text: str) -> str:
    """Return a shader that rounds after each operation."""
    return _with_rounding(text, _Reader(text, everything=True).text())


def with_half_coordinates(text: str) -> str:
    """Return a shader in which only the coordinates of textures are rounded."""
    return _with_rounding(text, _Reader(text, everything=False).text())


def _with_rounding(before: str, after: str) -> str:
    functions = "".join(_rounding(value) for value in sorted(_TYPES))
    functions += "".join(f"{kind} {_HALF}({kind} x) {{ return x; }}\n" for kind in _WHOLE)
    if _HEAD not in before:
        msg = "a fragment shader without precision highp float"
        raise ValueError(msg)
    return after.replace(_HEAD, _HEAD + functions, 1)


def _rounding(kind: str) -> str:
    """Return the function that rounds: to 11 bits, above 65504 to infinity, below 2^-14 to whole 2^-24."""
    return (
        f"{kind} {_HALF}({kind} x) {{\n"
        f"  {kind} unit = exp2(floor(log2(clamp(abs(x), 6.103515625e-5, 65504.0))) - 10.0);\n"
        f"  {kind} rounded = floor(x / unit + 0.5) * unit;\n"
        f"  return rounded * (1.0 + 3.0e38 * step(65505.0, abs(rounded)));\n"
        "}\n"
    )


class _Reader:
    """Reads the tokens of a shader and writes them again, with roundings."""

    def __init__(self, text: str, *, everything: bool) -> None:
        self._tokens = [match[0] for match in _TOKEN.finditer(text)]
        self._at = 0
        self._everything = everything

    def text(self) -> str:
        """Return the whole shader."""
        written = []
        while self._at < len(self._tokens):
            word = self._take()
            written.append(word)
            # At the top level, a brace after a parenthesis begins a function.
            if word == "{":
                written.append(self._block())
        return "".join(written)

    def _block(self) -> str:
        """Read statements up to the brace that ends the block."""
        written = []
        while (word := self._peek()) != "}":
            written.append(self._statement(word))
        return "".join(written) + self._take()

    def _statement(self, word: str) -> str:
        if word in {"if", "while"}:
            return self._take() + self._space() + self._take() + self._expression() + self._space()
        if word in {"const", "break", "continue", "discard"}:
            return self._until(";")
        if word.isspace() or word.startswith(("//", "#")) or word in {";", "{", "for", "return", "else", ")"}:
            follows = {"{": self._block, "for": self._parenthesised, "return": self._expression}.get(word, str)
            return self._take() + follows()
        return self._assigned()

    def _assigned(self) -> str:
        """Read a declaration, an assignment, or an expression by itself."""
        kind = self._take() + self._space() if self._peek() in {*_TYPES, "int", "bool", "mat4"} else ""
        place = ""
        while self._peek() not in _ASSIGNMENTS and self._peek() not in {";", "++", "--"}:
            place += self._take()
        sign = self._take() if self._peek() != ";" else ""
        if sign not in _ASSIGNMENTS:
            return kind + place + sign
        value = self._expression()
        if sign != "=" and self._everything:
            return f"{kind}{place}= {_HALF}({place}{sign[0]} ({value.strip()}))"
        return kind + place + sign + value

    def _expression(self, level: int = -1) -> str:
        """Read an expression whose operators bind more tightly than `level`."""
        if level == -1:
            value = self._expression(0)
            if self._peek_beyond() == "?":
                value += self._space() + self._take() + self._expression()
                value += self._space() + self._take() + self._expression()
            return value
        if level == len(_LEVELS):
            return self._unary()
        value = self._expression(level + 1)
        while self._peek_beyond() in _LEVELS[level]:
            before, sign = self._space(), self._take()
            other = self._expression(level + 1)
            value = f"{value}{before}{sign}{other}"
            if sign in _ROUNDED and self._everything:
                lead = value[: len(value) - len(value.lstrip())]
                value = f"{lead}{_HALF}({value.strip()})"
        return value

    def _unary(self) -> str:
        lead = self._space()
        if self._peek() in {"-", "!", "+"}:
            return lead + self._take() + self._unary()
        if self._peek() == "(":
            return self._postfixed(lead + self._take() + self._expression() + self._space() + self._take())
        name = self._take()
        if self._peek() != "(":
            return self._postfixed(lead + name)
        arguments = [*self._arguments()]
        if name in _FETCHES:
            arguments[1] = f" {_HALF}({arguments[1].strip()})"
        call = f"{name}({','.join(arguments)})"
        rounds = self._everything and (name in _FUNCTIONS or name in _FETCHES)
        return self._postfixed(f"{lead}{_HALF}({call})" if rounds else lead + call)

    def _arguments(self) -> Iterable[str]:
        self._take()
        while self._peek_beyond() != ")":
            yield self._expression() + self._space()
            if self._peek() == ",":
                self._take()
        self._space()
        self._take()

    def _postfixed(self, value: str) -> str:
        while self._peek() in {".", "["}:
            if self._take() == ".":
                value += f".{self._take()}"
            else:
                value += f"[{self._expression()}{self._space()}{self._take()}"
        return value

    def _parenthesised(self) -> str:
        """Copy the contents of parentheses unchanged."""
        written, depth = self._space(), 0
        while True:
            word = self._take()
            written += word
            depth += {"(": 1, ")": -1}.get(word, 0)
            if depth == 0:
                return written

    def _until(self, end: str) -> str:
        written = ""
        while self._peek() != end:
            written += self._take()
        return written

    def _space(self) -> str:
        written = ""
        while self._at < len(self._tokens) and (self._peek().isspace() or self._peek().startswith(("//", "#"))):
            written += self._take()
        return written

    def _peek(self) -> str:
        return self._tokens[self._at]

    def _peek_beyond(self) -> str:
        at = self._at
        while self._tokens[at].isspace() or self._tokens[at].startswith("//"):
            at += 1
        return self._tokens[at]

    def _take(self) -> str:
        self._at += 1
        return self._tokens[self._at - 1]
