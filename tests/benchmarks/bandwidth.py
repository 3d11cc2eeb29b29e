"""Memory bandwidth of the machine: every byte read, or copied, by NumPy in a thread for each core."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

_THREADS = os.cpu_count() or 1
_POOL = ThreadPoolExecutor(_THREADS)


def read_all(words: np.ndarray) -> int:
    """Return the sum of words, so that none is left out."""
    return sum(int(total) for total in _POOL.map(np.sum, np.array_split(words, _THREADS)))


def copy_all(source: np.ndarray, target: np.ndarray) -> None:
    """Copy bytes."""
    list(_POOL.map(np.copyto, np.array_split(target, _THREADS), np.array_split(source, _THREADS)))
