"""One kind of work, done by us and by others, and set against the machine's memory bandwidth.

All candidates run in turn, round after round, and so do a plain read and a plain copy of the same input: whatever else
the machine does at the time slows them all. Each one's best round counts.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bandwidth import copy_all, read_all

Run = Callable[[], object]


@dataclass(frozen=True)
class Contest:
    """What is measured: one kernel on one input, and who else does the same."""

    work: str
    """What is done."""
    source: NDArray[np.generic]
    """The input, C-contiguous, a multiple of 8 bytes."""
    bytes_written: int
    """Size of the result."""
    ours: Run
    """The kernel, on all threads."""
    peers: Mapping[str, Run]
    """Others by name, each with its own defaults."""


@dataclass(frozen=True)
class Row:
    """A kernel against one peer."""

    work: str
    """What was done."""
    source: str
    """To what: type and shape."""
    ours_ms: float
    """Our best time."""
    input_gb_per_s: float
    """Input bytes over our best time."""
    peer: str
    """Who else does it."""
    peer_ms: float
    """Its best time."""
    ratio: float
    """How many times faster we are."""
    share_of_bandwidth: float
    """Time of the unavoidable memory traffic over ours: as many bytes as the result has are copied, the rest of the
    input is read."""


@dataclass(frozen=True)
class Outcome:
    """The rows of a contest, and the bandwidths measured with them."""

    rows: tuple[Row, ...]
    """One for each peer."""
    read_gb_per_s: float
    """Plain read of the input on all threads."""
    copy_gb_per_s: float
    """Plain copy of the input on all threads; input bytes only."""


def hold(contest: Contest) -> Outcome:
    """Run everybody, and compare."""
    flat = contest.source.reshape(-1)
    words, octets = flat.view(np.uint64), flat.view(np.uint8)
    copied = np.zeros_like(octets)
    read, copy = "plain read", "plain copy"
    best = best_ms(
        {read: lambda: read_all(words), copy: lambda: copy_all(octets, copied), "": contest.ours, **contest.peers}
    )
    ours_ms = best[""]
    written = contest.bytes_written / octets.size
    traffic_ms = written * best[copy] + (1 - written) * best[read]
    rows = tuple(
        Row(
            work=contest.work,
            source=f"{contest.source.dtype} {'×'.join(map(str, contest.source.shape))}",
            ours_ms=ours_ms,
            input_gb_per_s=octets.size / ours_ms / 1e6,
            peer=peer,
            peer_ms=best[peer],
            ratio=best[peer] / ours_ms,
            share_of_bandwidth=traffic_ms / ours_ms,
        )
        for peer in contest.peers
    )
    return Outcome(rows, octets.size / best[read] / 1e6, octets.size / best[copy] / 1e6)


def best_ms(candidates: Mapping[str, Run], rounds: int = 15, patience_ms: float = 1500) -> dict[str, float]:
    """Give each candidate's best time. One whose patience is spent drops out, after at least two rounds."""
    best = dict.fromkeys(candidates, float("inf"))
    spent = dict.fromkeys(candidates, 0.0)
    for turn in range(rounds):
        for name, run in candidates.items():
            if turn < 2 or spent[name] < patience_ms:
                start = time.perf_counter()
                run()
                took = (time.perf_counter() - start) * 1e3
                best[name] = min(best[name], took)
                spent[name] += took
    return best
