"""One process at a time works on a draft: a POSIX lock, which the system releases when its process ends."""

import errno
import fcntl
import os
import weakref
from pathlib import Path

from volprep_formats.diagnostics import VolprepError


class Lock:
    """A lock on the file `path`, held until `release()`, the end of this object or the end of the process."""

    def __init__(self, path: Path, draft: Path) -> None:
        """Take the lock, making the file and its folder. Raises VP4012 if another process holds it; OSError."""
        self.release = weakref.finalize(self, os.close, _locked(path, draft))


def _locked(path: Path, draft: Path) -> int:
    while True:
        path.parent.mkdir(exist_ok=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # The process that had the lock may have removed the file between our opening and our locking it.
            if path.exists() and os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor
        except OSError as error:
            os.close(descriptor)
            if error.errno in (errno.EACCES, errno.EAGAIN):
                raise VolprepError("VP4012", path=draft) from error
            raise
        os.close(descriptor)
