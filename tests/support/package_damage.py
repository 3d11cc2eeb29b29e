"""Damage to packages, by chance that can be repeated: of the zip, of its JSON, of the bytes of its files.

Most damage leaves what lies before it right (CRC-32, sizes, digests), so that it reaches the rule behind it.
"""

import json
import random
import re
from collections.abc import Callable
from typing import Any

from repack import Files, packed, with_digests
from zip_tricks import SOUND, TRICKS, Entry

from volprep_formats.package.storage.files import MANIFEST

_NUMBERS = (0, 1, -1, 2, 3, 7, 255, 256, 65536, 2**31 - 1, 2**31, 2**53 - 1, 0.5, -0.0, 1.0, 2.0, 1e308, 1e-308)
_WORDS = ("", "none", "volume", "linear", "r", "../x", "ü", "\U0001f600", "A", "manifest.json", "scan", "x" * 100)
_TEXTS = (
    "null", "true", "false", "[]", "{}", '"\\u0041"', '"\\ud83d\\ude00"', '"\\ud800"', '"\\u0000"', "1e400", "-1e400",
    "1.0", "1e0", "10E-1", "-0", "01", "1.", ".5", "+1", "NaN", "Infinity", "9007199254740993", "1" * 300,
    "0." + "1" * 300,
    "[" * 40 + "]" * 40, "'x'", "/**/1", "tru", '"\t"', '"\x7f"', '{"a":1,"a":2}', '{"a":1,"\\u0061":2}', "[1,]", "{,}",
)  # fmt: skip
_TOKENS = re.compile(r'"(?:[^"\\]|\\.)*"|-?[0-9][0-9.eE+-]*|true|false|null')
_JSON = (MANIFEST, "subvolumes/grid.json")


def _place(value: Any, chance: random.Random) -> tuple[Any, Any]:
    """A container of a JSON value, by chance, and one of its keys."""
    while True:
        keys = [*value] if isinstance(value, dict) else [*range(len(value))]
        key = chance.choice(keys)
        inner = value[key]
        if not isinstance(inner, dict | list) or not inner or chance.random() < 0.1:
            return value, key
        value = inner


def _lie(manifest: Any, chance: random.Random) -> None:
    """Change one value of a JSON value: another number, word, truth or entry, none, or one from elsewhere."""
    place, key = _place(manifest, chance)
    value = place[key]
    kind = chance.randrange(6)
    if kind == 0:
        del place[key]
    elif kind == 1:
        other, at = _place(manifest, chance)
        place[key] = json.loads(json.dumps(other[at]))
    elif kind == 2 and isinstance(place, list):
        place.insert(key, json.loads(json.dumps(value)))
    elif kind == 2:
        place[chance.choice(("later", "extras", "name", "level", "role"))] = value
    elif isinstance(value, bool):
        place[key] = not value
    elif isinstance(value, int | float) and kind < 5:
        place[key] = chance.choice((*_NUMBERS, value + 1, value * 2, -value))
    elif isinstance(value, str) and kind < 5:
        place[key] = chance.choice((*_WORDS, f"{value}x", value[:-1], value.upper(), str(_some_word(manifest, chance))))
    else:
        place[key] = chance.choice((None, True, 1, "x", [], {}))


def _some_word(manifest: Any, chance: random.Random) -> Any:
    place, key = _place(manifest, chance)
    return place[key]


def _lies(files: Files, chance: random.Random) -> Files:
    name = chance.choice([name for name in _JSON if name in files] + [MANIFEST])
    value = json.loads(files[name])
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        _lie(value, chance)
    return files | {name: json.dumps(value).encode()}


def _other_text(files: Files, chance: random.Random) -> Files:
    """Put a JSON text, or something like one, in place of a value or a key."""
    name = chance.choice([name for name in _JSON if name in files])
    text = files[name].decode()
    found = chance.choice([*_TOKENS.finditer(text)])
    return files | {name: (text[: found.start()] + chance.choice(_TEXTS) + text[found.end() :]).encode()}


def _damaged(data: bytes, chance: random.Random) -> bytes:
    """The same number of bytes, some of them others."""
    changed = bytearray(data)
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(min(len(changed), chance.choice((64, 400, len(changed)))))
        changed[at] = chance.choice((changed[at] ^ 1 << chance.randrange(8), chance.randrange(256), 0, 255))
    return bytes(changed)


def _other_bytes(files: Files, chance: random.Random) -> Files:
    """Damage a file; most often its size and digest in the manifest are right again."""
    name = chance.choice(sorted(files))
    data = files[name]
    if not data:
        return files
    kind = chance.randrange(4)
    if kind == 0:
        data = data[: chance.randrange(len(data))]
    elif kind == 1:
        data += chance.randbytes(chance.randint(1, 9))
    else:
        data = _damaged(data, chance)
    files = files | {name: data}
    return files if name == MANIFEST or chance.random() < 0.1 else with_digests(files)


def _other_files(files: Files, chance: random.Random) -> Files:
    """Leave a file out, add one, or exchange two."""
    names = sorted(files)
    one, other = chance.choice(names), chance.choice(names)
    kind = chance.randrange(3)
    if kind == 0:
        return {name: data for name, data in files.items() if name != one}
    if kind == 1:
        return files | {chance.choice(("more.txt", "textures/x.ktx2", "A", "a//b", "é")): files[one]}
    return files | {one: files[other], other: files[one]}


def _zip_damage(files: Files, chance: random.Random) -> bytes:
    """Damage the zip itself: a trick, a header, its length."""
    entries = [Entry(name.encode(), data) for name, data in files.items()]
    kind = chance.randrange(3)
    if kind == 0:
        return chance.choice([*TRICKS.values(), *SOUND.values()])(entries)
    data = bytearray(packed(files))
    if kind == 1:
        return bytes(data[: chance.randrange(len(data))])
    heads = [found.start() for found in re.finditer(rb"PK(\x01\x02|\x03\x04|\x05\x06)", bytes(data))]
    for _ in range(chance.randint(1, 2)):
        at = chance.choice(heads) + chance.randrange(46)
        if at < len(data):
            data[at] = chance.choice((data[at] ^ 1 << chance.randrange(8), chance.randrange(256), 0, 255))
    return bytes(data)


_KINDS: tuple[Callable[[Files, random.Random], Files], ...] = (
    _lies,
    _lies,
    _lies,
    _other_text,
    _other_bytes,
    _other_files,
)


def damaged(files: Files, seed: str) -> bytes:
    """One damaged package; the same seed gives the same bytes."""
    chance = random.Random(seed)  # noqa: S311 - chance that can be repeated
    if chance.random() < 0.15:
        return _zip_damage(files, chance)
    changed = chance.choice(_KINDS)(files, chance)
    if any(name in changed and changed[name] != files.get(name) for name in _JSON[1:]):
        changed = with_digests(changed)
    return packed(changed)
