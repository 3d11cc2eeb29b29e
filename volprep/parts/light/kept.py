"""Samples of light that a killed build has left: the next build goes on with them.

Samples take most of the time of a field of light, and follow from the arguments of the native kernel alone. So each
batch is kept under a digest of these.
"""

import hashlib
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.installation import generator
from volprep_formats.output import output_errors

Arrays = dict[str, Any]
"""Arrays by the names of the arguments of the native kernel."""


class KeptSamples:
    """Batches of samples of one volume, in files of a folder: 8 MB for each batch of 262,144."""

    def __init__(self, folder: Path, volume: NDArray[np.generic]) -> None:
        """Make the folder if it is missing. Raises VP4020."""
        self._folder = folder
        self._volume = _digest({"volume": volume, "generator": generator()})
        with output_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)

    def find(self, arguments: Mapping[str, Any], made: Arrays) -> bool:
        """Fill the arrays `made` with the samples of the kernel's `arguments`; False if none, or others, are kept."""
        try:
            with np.load(self._path(arguments)) as held:
                found = {name: held[name] for name in made}
        except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):
            return False
        if any(found[name].shape != array.shape for name, array in made.items()):
            return False
        for name, array in made.items():
            array[...] = found[name]
        return True

    def keep(self, arguments: Mapping[str, Any], made: Arrays) -> None:
        """Keep the samples of the kernel's `arguments`. Raises VP4020."""
        path = self._path(arguments)
        new = path.with_suffix(".new")
        with output_errors(path):
            with new.open("wb") as file:
                np.savez(file, **made)
            new.replace(path)

    def _path(self, arguments: Mapping[str, Any]) -> Path:
        others = {name: value for name, value in arguments.items() if name != "volume"}
        return self._folder / f"{_digest({**others, 'of': self._volume})}.npz"


def _digest(parts: Mapping[str, Any]) -> str:
    digest = hashlib.sha256()
    for name, value in sorted(parts.items()):
        if isinstance(value, np.ndarray):
            digest.update(f"{name}: {value.dtype} {value.shape} ".encode())
            digest.update(np.ascontiguousarray(value).data)
        else:
            digest.update(f"{name}: {value!r} ".encode())
    return digest.hexdigest()
