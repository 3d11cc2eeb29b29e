"""Threads of OpenMP that sleep while they wait for others.

By default OpenMP lets them spin, and where other programs want the cores that takes time from the threads they wait
for: in the pyramid of a head of 384 slices, on two such cores, 7.5 s of processor time and 15 s on the clock; asleep,
2.8 s and 8 s. `volprep validate` of that head took 48 s of processor time with the threads of FLIP spinning, 39 s with
them asleep.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

_POLICY = "OMP_WAIT_POLICY"


@contextmanager
def asleep() -> Iterator[None]:
    """Let modules that are loaded in this block have threads that sleep, unless the environment says otherwise.

    OpenMP reads the environment once, when it is loaded. The environment of other programs and libraries stays as it
    was.
    """
    chosen = _POLICY in os.environ
    os.environ.setdefault(_POLICY, "passive")
    try:
        yield
    finally:
        if not chosen:
            del os.environ[_POLICY]
