"""Detect a changed scan without reading it: names, sizes and times of its files.

The time of the last change of status counts, too: it reveals a file that was written in place and whose time of writing
was set back. A file that was only copied again counts as changed, which costs a build and mixes up nothing.
"""

import hashlib
import hmac
import json
import os
from collections.abc import Iterator
from pathlib import Path

from volprep.batch.jobs import Job
from volprep.batch.storage import mark_of

_WITH_OTHERS = {".mhd", ".nhdr", ".hdr"}
"""Headers whose voxels are in other files of their folder."""


def stamp_of(job: Job, key: bytes) -> str:
    """Return a digest that changes when the scan of `job` does; keyed for the batch, so that it reveals nothing."""
    source = job.request.scene.source.model_dump(mode="json")
    digest = hmac.new(key, json.dumps(source, sort_keys=True).encode(), hashlib.sha256)
    for path in job.files:
        for file in _files(path):
            digest.update(_line(file))
    if job.url is not None:
        digest.update((mark_of(job.url, key) or "unreachable").encode())
    return digest.hexdigest()


def _files(path: Path) -> Iterator[str]:
    if path.suffix.lower() in _WITH_OTHERS:
        yield from sorted(entry.path for entry in os.scandir(path.parent) if entry.is_file())
    elif path.is_dir():
        for place, folders, files in os.walk(path):
            folders.sort()
            yield from (os.path.join(place, name) for name in sorted(files))  # noqa: PTH118 - a Path for each is slow
    else:
        yield os.fspath(path)


def _line(file: str) -> bytes:
    try:
        found = os.stat(file)  # noqa: PTH116 - as above
    except OSError:
        return os.fsencode(file) + b"\0missing\0"
    return os.fsencode(file) + f"\0{found.st_size} {found.st_mtime_ns} {found.st_ctime_ns}\0".encode()
