"""Damaged files from sound ones, by chance that can be repeated, and what reading them may end in.

A case is known by the seed and its number alone. Most damage is done near the beginning, where headers are.
"""

import re
import signal
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np
from write_anew import write_anew

from volprep_formats.diagnostics import VolprepError

CASE_SECONDS = 5.0
"""Computing time that one case may take; sound files take milliseconds."""
_HEAD_BYTES = 512
_WORDS = [
    -1,
    0,
    1,
    2,
    127,
    128,
    255,
    256,
    32767,
    32768,
    65535,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**62,
    2**63 - 1,
    2**64 - 1,
]
_NUMBERS = [
    b"-1",
    b"0",
    b"1",
    b"3",
    b"-0",
    b"65536",
    b"2147483648",
    b"4294967297",
    b"9223372036854775808",
    b"1" + b"0" * 30,
]
_NUMBERS += [b"nan", b"inf", b"-inf", b"1e308", b"1e-308", b"0.5", b"1e400", b"", b"x", b"0x10", b"1_0"]
_FLOATS = [float("nan"), float("inf"), -1.0, 0.0, 1e-300, 1e300]

Change = Callable[[bytearray, np.random.Generator], None]


class TooSlow(BaseException):
    """A case took longer than it may. No reader can take it for an error of its own."""


def mutation(whole: bytes, seed: int, case: int) -> bytes:
    """Give damaged version number `case` of a file."""
    chance = np.random.default_rng((seed, case))
    data = bytearray(whole)
    for _ in range(int(chance.choice([1, 1, 1, 2, 3]))):
        _CHANGES[chance.integers(len(_CHANGES))](data, chance)
    return bytes(data)


def assert_survives(
    whole: bytes,
    suffix: str,
    read: Callable[[Path], None],
    folder: Path,
    *,
    count: int = 2000,
    seed: int = 1,
    pack: Callable[[bytes], bytes] = bytes,
) -> Counter[str]:
    """Check that each of `count` damaged files is read, or refused with a code; give how often each happened.

    `read` opens a file, reads all of it, and asserts that what it got agrees with what was said of it. `pack` is what
    becomes of the damaged bytes before they are written, such as compression.
    """
    outcomes: Counter[str] = Counter()
    file = folder / f"damaged{suffix}"
    for case in range(count):
        write_anew(file, pack(mutation(whole, seed, case)))
        outcomes[outcome(file, read, f"case {case} of seed {seed}")] += 1
    print(f"{count} damaged files{suffix and ' ' + suffix}, seed {seed}: {dict(outcomes.most_common())}")
    return outcomes


def outcome(file: Path, read: Callable[[Path], None], name: str) -> str:
    """Read one file: "read", or the code of the error. Anything else fails, under the name of the case."""
    try:
        with _at_most(CASE_SECONDS):
            read(file)
    except VolprepError as error:
        return error.code
    except (Exception, TooSlow) as error:
        # One file is all that is needed to see it again.
        kept = file.with_name(f"{name.replace(' ', '-')}{file.suffix}")
        kept.write_bytes(file.read_bytes())
        msg = f"{name} ended in {type(error).__name__}: {error}; the file is {kept}"
        raise AssertionError(msg) from error
    return "read"


def prefixes(whole: bytes, most: int = 3000) -> Iterator[bytes]:
    """Give every beginning of a file that is shorter than it; of a long one `most`, evenly, with all of its head."""
    step = max(1, len(whole) // most)
    yield from (whole[:size] for size in sorted({*range(min(_HEAD_BYTES, len(whole))), *range(0, len(whole), step)}))


@contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """Raise TooSlow after `seconds` of computing; waiting for other processes does not count."""

    def end(_signal: int, _frame: FrameType | None) -> None:
        raise TooSlow(f"more than {seconds} s")

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def _place(data: bytearray, chance: np.random.Generator) -> int:
    end = len(data) if chance.random() < 0.4 else min(len(data), _HEAD_BYTES)
    return int(chance.integers(max(end, 1)))


def _flip_bits(data: bytearray, chance: np.random.Generator) -> None:
    for _ in range(int(chance.integers(1, 5))):
        if data:
            data[_place(data, chance)] ^= 1 << int(chance.integers(8))


def _set_extreme_bytes(data: bytearray, chance: np.random.Generator) -> None:
    at = _place(data, chance)
    count = int(chance.choice([1, 1, 2, 4, 16]))
    data[at : at + count] = bytes([int(chance.choice([0, 1, 0x7F, 0x80, 0xFF]))]) * len(data[at : at + count])


def _delete(data: bytearray, chance: np.random.Generator) -> None:
    at = _place(data, chance)
    del data[at : at + int(chance.choice([1, 2, 4, 8, 100]))]


def _duplicate(data: bytearray, chance: np.random.Generator) -> None:
    at = _place(data, chance)
    data[at:at] = data[at : at + int(chance.choice([1, 2, 4, 8, 100]))]


def _cut(data: bytearray, chance: np.random.Generator) -> None:
    del data[_place(data, chance) :]


def _move(data: bytearray, chance: np.random.Generator) -> None:
    source, target, count = _place(data, chance), _place(data, chance), int(chance.choice([2, 4, 8, 32]))
    part = data[source : source + count]
    data[target : target + len(part)] = part


def _set_word(data: bytearray, chance: np.random.Generator) -> None:
    size = int(chance.choice([2, 4, 8]))
    order = "little" if chance.random() < 0.5 else "big"
    at = _place(data, chance) & -2
    word = int(chance.choice(len(_WORDS)))
    data[at : at + size] = (_WORDS[word] % 2 ** (8 * size)).to_bytes(size, order)


def _set_float(data: bytearray, chance: np.random.Generator) -> None:
    kind = str(chance.choice(["<f4", ">f4", "<f8", ">f8"]))
    at = _place(data, chance) & -4
    with np.errstate(over="ignore", under="ignore"):
        word = np.array(chance.choice(_FLOATS)).astype(kind).tobytes()
    data[at : at + len(word)] = word


def _set_number(data: bytearray, chance: np.random.Generator) -> None:
    """Write another number where one stands as text."""
    found = list(re.finditer(rb"-?\d[\d.]*", data[: 8 * _HEAD_BYTES]))
    if found:
        number = found[int(chance.integers(len(found)))]
        data[number.start() : number.end()] = _NUMBERS[int(chance.integers(len(_NUMBERS)))]


_CHANGES: list[Change] = [
    _flip_bits,
    _set_extreme_bytes,
    _delete,
    _duplicate,
    _cut,
    _move,
    _set_word,
    _set_word,
    _set_float,
    _set_number,
]
