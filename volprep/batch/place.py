"""Layout of the folder of a batch.

FOLDER/ledger.jsonl, index.json, index.html; FOLDER/PROFILE/NAME.volpkg with its origin and its report. Internal files
are in FOLDER/.batch: the key of the names, and locks.
"""

import json
import os
import secrets
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from volprep_formats.output import output_errors, write_file

_KEY_BYTES = 32

_STATE = ".batch"


def is_batch(folder: Path) -> bool:
    """Whether a folder is that of a batch."""
    return (folder / _STATE).is_dir()


@dataclass(frozen=True)
class Place:
    """The folder of a batch."""

    folder: Path
    """Absolute."""

    @property
    def ledger(self) -> Path:
        """One final record for each job."""
        return self.folder / "ledger.jsonl"

    @property
    def ledger_lock(self) -> Path:
        """Whoever writes the ledger holds a lock on this file; the ledger itself is replaced from time to time."""
        return self._state / "ledger.lock"

    def job_lock(self, name: str, profile: str) -> Path:
        """Whoever builds this job holds a lock on this file."""
        return self._state / f"{name}.{profile}.lock"

    def package(self, name: str, profile: str) -> Path:
        """The package of a job."""
        return self.folder / profile / f"{name}.volpkg"

    def fetched(self, name: str, profile: str) -> Path:
        """Folder of scans fetched from a store, and of uploads to one, during a build; only the owner can read it."""
        return self._state / f"{name}.{profile}.fetched"

    @property
    def is_there(self) -> bool:
        """Whether this process sees the folder; one on another machine may not."""
        return is_batch(self.folder)

    @property
    def _state(self) -> Path:
        return self.folder / _STATE

    @property
    def _names(self) -> Path:
        return self._state / "names.jsonl"

    def note_names(self, sources: Mapping[str, str]) -> None:
        """Add the location of the scan of each name to the map of this folder, which only its owner can read.

        Raises VP4020 if it cannot be written.
        """
        new = {name: source for name, source in sources.items() if self.sources().get(name) != source}
        if not new:
            return
        with output_errors(self._names):
            descriptor = os.open(self._names, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
            with os.fdopen(descriptor, "a", encoding="ascii") as file:
                # One write, so that lines of shards that run at the same time do not mix.
                file.write("".join(json.dumps([name, source]) + "\n" for name, source in new.items()))

    def sources(self) -> dict[str, str]:
        """Return where the scan of each name is, as far as batches of this folder have noted it."""
        found: dict[str, str] = {}
        with suppress(OSError, ValueError):
            for line in self._names.read_text(encoding="ascii").splitlines():
                with suppress(ValueError):
                    name, source = json.loads(line)
                    found[str(name)] = str(source)
        return found

    def prepare(self) -> None:
        """Make the folder and its key, if they are not there. Raises VP4020 if nothing can be written."""
        with output_errors(self.folder):
            self._state.mkdir(parents=True, exist_ok=True)
            if not self._key.exists():
                self._make_key()

    def key(self) -> bytes:
        """Return the key that names and stamps are made with. Raises VP4020 if it cannot be read."""
        with output_errors(self._key):
            return self._key.read_bytes()

    @property
    def _key(self) -> Path:
        return self._state / "key"

    def _make_key(self) -> None:
        made = self._state / f"key.{secrets.token_hex(4)}"
        write_file(made, secrets.token_bytes(_KEY_BYTES))
        try:
            made.chmod(0o600)
            # Two batches may begin at the same time: the first key stays.
            with suppress(FileExistsError):
                self._key.hardlink_to(made)
        finally:
            made.unlink()
