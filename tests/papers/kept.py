"""What a run has measured so far, so that the next one goes on where it ended: papers, packages and truths.

It lies in a folder whose name has a digest of the driver, the place of the scans and all code that measures. What has
changed is measured anew.
"""

import hashlib
import os
import pickle
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).parents[2]
_CODE = ("volprep", "formats/volprep_formats", "formats/js", "tests/papers", "tests/benchmarks")
_KINDS = {".py", ".so", ".glsl", ".toml", ".js", ".j2"}


class Kept:
    """The folder of one form of a run, full or quick."""

    def __init__(self, output: Path, form: str, driver: str) -> None:
        """Open the folder below that of the pages, and remove those of other code or another driver."""
        parent = output / "kept"
        self.folder = parent / f"{form}-{_digest(driver)}"
        for other in parent.glob(f"{form}-*"):
            if other != self.folder:
                shutil.rmtree(other)
        self._results.mkdir(parents=True, exist_ok=True)

    def forget(self) -> None:
        """Remove everything that an earlier run has left."""
        shutil.rmtree(self.folder)
        self._results.mkdir(parents=True)

    def close(self, done: Sequence[str]) -> None:
        """Forget the results of a run that has come to its end, and all the rest if no other run has results here."""
        for name in done:
            self._path(name).unlink()
        if not any(self._results.iterdir()):
            shutil.rmtree(self.folder)

    def result(self, name: str) -> Any:
        """Return what was kept under a name, None if nothing was."""
        path = self._path(name)
        return pickle.loads(path.read_bytes()) if path.exists() else None  # noqa: S301 - our own, of the same code

    def keep(self, name: str, result: object) -> None:
        """Keep the result of a name, whole or not at all."""
        path = self._path(name)
        part = path.with_suffix(".part")
        part.write_bytes(pickle.dumps(result))
        part.rename(path)

    @property
    def _results(self) -> Path:
        return self.folder / "results"

    def _path(self, name: str) -> Path:
        return self._results / f"{name}.pickle"


def _digest(driver: str) -> str:
    files = sorted(path for part in _CODE for path in (_ROOT / part).rglob("*") if path.suffix in _KINDS)
    digest = hashlib.sha256(f"{driver}\0{os.environ.get('VOLPREP_TEST_DATA')}\0".encode())
    for path in files:
        digest.update(f"{path.relative_to(_ROOT)}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
