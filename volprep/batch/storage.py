"""Scans and packages in object stores, by fsspec: s3://, gs://, az://, and https:// for scans.

Requests to a store that does not answer, or is busy, are retried after growing waits. A scan is fetched as a whole
before it is read. A package is stored as one object, NAME.volpkg.zip: object stores show an object only when all of its
bytes have arrived, and replace an older one in one step, so a package is either whole or absent.
"""

import errno
import hashlib
import hmac
import json
import os
import random
import re
import shutil
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, TypeVar

from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from fsspec import AbstractFileSystem

_Found = TypeVar("_Found")

_URL = re.compile(r"([a-z][a-z0-9+.-]+)://", re.IGNORECASE)
_WHOLE_OBJECTS = frozenset(("s3", "s3a", "gs", "gcs", "az", "abfs", "memory"))
"""Stores that show an object only when it is whole."""
_TRIES = 7
_FIRST_WAIT_S = 0.2
"""Doubled with each try: 12.6 s in all, randomly shortened, so that workers do not retry at the same moment."""
_FINAL = (FileNotFoundError, PermissionError, NotADirectoryError, IsADirectoryError, NotImplementedError)
"""Answers that do not change when asked again."""
_OF_THIS_MACHINE = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS))
_MARKS = ("size", "ETag", "etag", "md5Hash", "LastModified", "last_modified", "mtime", "updated", "created")
"""Metadata of an object in a store that change when the object does."""


def is_url(text: str) -> bool:
    """Whether a text is the address of an object, and no path; a file URI is a path."""
    return _URL.match(text) is not None and not text.lower().startswith("file:")


def listed(url: str) -> dict[str, Mapping[str, object]]:
    """Return the store's metadata of each object at or below `url`, by relative path; "" if `url` is one object.

    Raises VP1001 for a missing file, VP8050 if the store does not answer, VP8052 if no module knows the store.
    """
    system, root = _opened(url)

    system.invalidate_cache()
    info: Mapping[str, object] = _retried(partial(system.info, root), url, "VP8050")
    if info["type"] == "file":
        return {"": info}
    below: dict[str, Mapping[str, object]] = _retried(partial(system.find, root, detail=True), url, "VP8050")
    if not below:
        raise VolprepError("VP1001", path=url)
    return {_inside(path, root, url): value for path, value in sorted(below.items())}


def fetch(url: str, folder: Path) -> Path:
    """Copy all objects at or below `url` into `folder`, which others cannot read, and return the scan's path there.

    Raises the errors of `listed`, VP8050 for an object that cannot be fetched, and OSError if the disk is full.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(mode=0o700)
    objects = listed(url)
    system, root = _opened(url)
    scan = folder / (PurePosixPath(root).name or "scan")
    for inside, info in objects.items():
        target = scan / inside if inside else scan
        target.parent.mkdir(parents=True, exist_ok=True)
        _retried(partial(_get, system, _joined(root, inside), target, info.get("size")), url, "VP8050")
    return scan


def store(file: Path, url: str) -> None:
    """Give the object `url` the content of a file, whole or not at all. Raises VP8051, VP8052."""
    system, path = _opened(url)
    size = file.stat().st_size

    def put() -> None:
        system.put_file(str(file), path)
        system.invalidate_cache()
        stored = _retried(partial(system.info, path), url, "VP8051")["size"]
        if stored != size:
            raise OSError(errno.EIO, f"the store has {stored} of {size} bytes")

    _retried(put, url, "VP8051")


def require_target(url: str) -> None:
    """Write an empty object and remove it, before work is done. Raises VP8051, VP8052, VP8053 for a wrong store."""
    protocol = url.partition("://")[0].lower()
    if protocol not in _WHOLE_OBJECTS:
        raise VolprepError("VP8053", path=url, protocol=protocol)
    system, path = _opened(f"{url.rstrip('/')}/.volprep-probe")

    def probe() -> None:
        system.pipe_file(path, b"")
        system.rm_file(path)

    _retried(probe, url, "VP8051")


def mark_of(url: str, key: bytes) -> str | None:
    """Return a digest that changes when an object at or below `url` does, and reveals nothing else; None for none.

    None if the store does not answer; the object is then written again.
    """
    try:
        objects = listed(url)
    except VolprepError:
        return None
    said = [[inside, *(str(info.get(mark)) for mark in _MARKS)] for inside, info in objects.items()]
    return hmac.new(key, json.dumps([url, said]).encode(), hashlib.sha256).hexdigest()


def _opened(url: str) -> "tuple[AbstractFileSystem, str]":
    from fsspec.core import url_to_fs  # noqa: PLC0415 - loads much, and few batches need it

    try:
        system, path = url_to_fs(url)
    except (ImportError, ValueError) as error:
        raise VolprepError("VP8052", path=url, protocol=url.partition("://")[0], error=error) from error
    return system, path.rstrip("/")


def _get(system: "AbstractFileSystem", path: str, target: Path, size: object) -> None:
    system.get_file(path, str(target))
    if isinstance(size, int) and target.stat().st_size != size:
        raise OSError(errno.EIO, f"{target.stat().st_size} of {size} bytes came")


def _inside(path: str, root: str, url: str) -> str:
    inside = path.removeprefix(root).lstrip("/")
    # Keys of objects may be any text: a key that leads out of the target folder does not belong to a scan.
    if ".." in PurePosixPath(inside).parts or "\0" in inside:
        raise VolprepError("VP8050", path=url, error=os.strerror(errno.EACCES), times=1)
    return inside


def _joined(root: str, inside: str) -> str:
    return f"{root}/{inside}" if inside else root


def _retried(action: Callable[[], _Found], url: str, code: str) -> _Found:
    """Call `action` on a store, and retry if it fails. Raises VP1001 for a missing object, and `code`."""
    for attempt in range(_TRIES):
        try:
            return action()
        except FileNotFoundError as error:
            if code == "VP8050":
                raise VolprepError("VP1001", path=url) from error
            raise VolprepError(code, path=url, error=os.strerror(errno.ENOENT), times=attempt + 1) from error
        except _FINAL as error:
            raise VolprepError(code, path=url, error=_text(error), times=attempt + 1) from error
        except VolprepError:
            raise
        except Exception as error:
            # Clients of stores raise many kinds; an error of this machine's own disk is not the store's.
            if isinstance(error, OSError) and error.errno in _OF_THIS_MACHINE:
                raise
            if attempt == _TRIES - 1:
                raise VolprepError(code, path=url, error=_text(error), times=_TRIES) from error
        time.sleep(_FIRST_WAIT_S * 2**attempt * random.uniform(0.5, 1.0))  # noqa: S311 - no secret
    raise AssertionError


def _text(error: Exception) -> str:
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).partition("\n")[0]
