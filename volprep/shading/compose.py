"""Shaders from parts: the files in shaders/ are put together and specialised for one package, nothing is switched off.

A line `//#part slot` in a part gives way to the file that the slot names, indented as the line is, or to nothing where
the slot names none; or to several instances of parts, one after the other. `$WORD` gives way to a constant or to a
keyword of the dialect, in an instance first to its own words. The lines between `//#each WORD` and `//#end` stand once
for each of the words that the constant WORD lists, with $WORD for it. Lines that begin with `//:` tell who works on the
parts what goes in and out; they do not ship.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Literal

import numpy as np

from volprep_formats.diagnostics import VolprepError

Dialect = Literal["es100", "es300"]

_FOLDER = Path(__file__).parent / "glsl"
_HEAD = re.compile(r"^//:.*\n", re.MULTILINE)
_EACH = re.compile(r"^ *//#each (\w+)\n(.*?)^ *//#end\n", re.MULTILINE | re.DOTALL)
_SLOT = re.compile(r"^( *)//#part (\w+)\n", re.MULTILINE)
_HEADS: dict[Dialect, str] = {"es100": "#version 100\n", "es300": "#version 300 es\n"}
_KEYWORDS: dict[Dialect, dict[str, str]] = {
    "es100": {
        "ATTRIBUTE": "attribute",
        "VARYING_IN": "varying",
        "VARYING_OUT": "varying",
        "TEXTURE_2D": "texture2D",
        "PICTURE": "gl_FragColor",
    },
    "es300": {
        "ATTRIBUTE": "in",
        "VARYING_IN": "in",
        "VARYING_OUT": "out",
        "TEXTURE_2D": "texture",
        "PICTURE": "picture",
    },
}


@dataclass(frozen=True)
class Instance:
    """A part that may stand in a shader more than once, each time with words of its own."""

    part: str
    """The file."""
    words: Mapping[str, str]
    """Constants of this instance alone."""


Slot = str | None | tuple[Instance, ...]
"""What fills a slot: a part, nothing, or instances."""


def compose(part: str, dialect: Dialect, slots: Mapping[str, Slot], constants: Mapping[str, str]) -> str:
    """Return the text of a shader: the file `part`, its slots filled, its words replaced.

    Raises VP9001 for a constant that no part uses: it would be dead.
    """
    text = _HEADS[dialect] + _filled(part, slots)
    template = Template(_EACH.sub(lambda match: _repeated(match, constants), text))
    _require_used(constants, [*template.get_identifiers(), *_each_words(text)])
    composed = template.substitute({**_KEYWORDS[dialect], **constants})
    return re.sub(r"\n{3,}", "\n\n", composed)


def literal(*values: float) -> str:
    """GLSL literal of a float, vec2 or vec3: the shortest digits that give the same float32."""
    numbers = [str(np.float32(value)) for value in values]
    return numbers[0] if len(numbers) == 1 else f"vec{len(numbers)}({', '.join(numbers)})"


def _each_words(text: str) -> list[str]:
    return [match[1] for match in _EACH.finditer(text)]


def _repeated(match: re.Match[str], constants: Mapping[str, str]) -> str:
    word, lines = match[1], match[2]
    return "".join(Template(lines).safe_substitute({word: each}) for each in constants[word].split())


def _filled(part: str, slots: Mapping[str, Slot]) -> str:
    text = _HEAD.sub("", (_FOLDER / f"{part}.glsl").read_text(encoding="utf-8"))

    def fill(match: re.Match[str]) -> str:
        held = slots[match[2]]
        if held is None:
            return ""
        text = _filled(held, slots) if isinstance(held, str) else "".join(_instance(each, slots) for each in held)
        return "".join(f"{match[1]}{line}" if line.strip() else line for line in text.splitlines(keepends=True))

    return _SLOT.sub(fill, text)


def _instance(instance: Instance, slots: Mapping[str, Slot]) -> str:
    template = Template(_filled(instance.part, slots))
    _require_used(instance.words, template.get_identifiers())
    return template.safe_substitute(instance.words)


def _require_used(constants: Mapping[str, str], words: Sequence[str]) -> None:
    unused = constants.keys() - set(words)
    if unused:
        raise VolprepError("VP9001", error=f"shader constants that no part uses: {sorted(unused)}")
