"""Shaders from parts: the files in glsl/ are put together and specialised for one package, nothing is switched off.

A part is a file without its ending, "skip/look"; or a section of a file, "light/headlight:start", which begins at the
line `//#section start` and ends at the next one or with the file. A line `//#part slot` in a part gives way to the part
that the slot names, indented as the line is, or to nothing where the slot names none; or to several instances of parts,
one after the other. `$WORD` gives way to a constant or to a keyword of the dialect, in an instance first to its own
words. The lines between `//#each WORD` and `//#end` are repeated for each of the words that the constant WORD lists,
with $WORD for it. Lines that begin with `//:` document a part's inputs and outputs for developers; they do not ship.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from string import Template
from types import MappingProxyType
from typing import Literal

import numpy as np

from volprep_formats.diagnostics import VolprepError

Dialect = Literal["es100", "es300", "es310"]
"""Languages of shaders. Compute shaders alone have the last one."""

_FOLDER = Path(__file__).parent / "glsl"
_HEAD = re.compile(r"^ *//:.*\n", re.MULTILINE)
_SECTION = re.compile(r"^//#section (\w+)\n", re.MULTILINE)
_EACH = re.compile(r"^ *//#each (\w+)\n(.*?)^ *//#end\n", re.MULTILINE | re.DOTALL)
_SLOT = re.compile(r"^( *)//#part (\w+)\n", re.MULTILINE)
_HEADS: dict[Dialect, str] = {"es100": "#version 100\n", "es300": "#version 300 es\n", "es310": "#version 310 es\n"}
_ES300 = {"ATTRIBUTE": "in", "VARYING_IN": "in", "VARYING_OUT": "out", "TEXTURE_2D": "texture", "PICTURE": "picture"}
_KEYWORDS: dict[Dialect, dict[str, str]] = {
    "es100": {
        "ATTRIBUTE": "attribute",
        "VARYING_IN": "varying",
        "VARYING_OUT": "varying",
        "TEXTURE_2D": "texture2D",
        "PICTURE": "gl_FragColor",
    },
    "es300": _ES300,
    "es310": _ES300,
}


@dataclass(frozen=True)
class Instance:
    """A part that a shader may contain more than once, each time with its own words and slots."""

    part: str
    """The part."""
    words: Mapping[str, str] = field(default_factory=dict)
    """Constants of this instance alone."""
    slots: "Mapping[str, Slot]" = field(default_factory=dict)
    """Slots of this instance alone."""


Slot = str | None | tuple[Instance, ...]
"""Content of a slot: a part, nothing, or instances."""


def compose(
    parts: str | tuple[Instance, ...],
    dialect: Dialect,
    slots: Mapping[str, Slot],
    constants: Mapping[str, str],
    offered: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return the text of a shader: a part, or several instances; their slots filled, their words replaced.

    Words of `constants` must be used, words of `offered` may be. Raises VP9001 for an unused constant.
    """
    text = _filled(parts, slots, between="\n")
    _require_used(constants, _words(text))
    template = Template(_HEADS[dialect] + _each(text, constants))
    composed = template.substitute({**_KEYWORDS[dialect], **offered, **constants})
    return re.sub(r"\n{3,}", "\n\n", composed)


def literal(*values: float) -> str:
    """GLSL literal of a float, vec2 or vec3: the shortest digits that give the same float32."""
    numbers = [str(np.float32(value)) for value in values]
    return numbers[0] if len(numbers) == 1 else f"vec{len(numbers)}({', '.join(numbers)})"


def part_text(part: str) -> str:
    """Return the text of a part as it lies in its file, without the lines that do not ship."""
    name, _, section = part.partition(":")
    body, *sections = _SECTION.split((_FOLDER / f"{name}.glsl").read_text(encoding="utf-8"))
    return _HEAD.sub("", dict(zip(sections[::2], sections[1::2], strict=True))[section] if section else body)


def _filled(parts: str | tuple[Instance, ...], slots: Mapping[str, Slot], between: str) -> str:
    if not isinstance(parts, str):
        return between.join(_instance(part, slots) for part in parts)

    def fill(match: re.Match[str]) -> str:
        indent, held = match[1], slots[match[2]]
        if held is None:
            return ""
        # Declarations are easier to read with a blank line between them.
        text = _filled(held, slots, between="" if indent else "\n")
        return "".join(f"{indent}{line}" if line.strip() else line for line in text.splitlines(keepends=True))

    return _SLOT.sub(fill, part_text(parts))


def _instance(instance: Instance, slots: Mapping[str, Slot]) -> str:
    text = _filled(instance.part, {**slots, **instance.slots}, between="")
    _require_used(instance.words, _words(text))
    return Template(_each(text, instance.words)).safe_substitute(instance.words)


def _each(text: str, constants: Mapping[str, str]) -> str:
    """Repeat the lines for each of the words of a list, of those lists that `constants` has."""

    def repeat(match: re.Match[str]) -> str:
        word, lines = match[1], match[2]
        if word not in constants:
            return match[0]
        return "".join(Template(lines).safe_substitute({**constants, word: value}) for value in constants[word].split())

    return _EACH.sub(repeat, text)


def _words(text: str) -> list[str]:
    return [*Template(text).get_identifiers(), *(match[1] for match in _EACH.finditer(text))]


def _require_used(constants: Mapping[str, str], words: Sequence[str]) -> None:
    unused = constants.keys() - set(words)
    if unused:
        raise VolprepError("VP9001", error=f"shader constants that no part uses: {sorted(unused)}")
