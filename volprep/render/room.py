"""Memory that OpenGL needs below a limit of the address space (ulimit -v): Mesa hangs or fails without a message."""

import mmap
import resource
import sys
from pathlib import Path

from volprep_formats.diagnostics import VolprepError

_NEEDED_BYTES = 2**29
"""Mesa's software driver with LLVM and its threads map 0.3 GB on two cores; with 0.1 GB left it waits for ever."""


def require_room() -> None:
    """Raise VP7004 if the limit of the address space leaves too little for a driver of OpenGL."""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if sys.platform != "linux" or limit == resource.RLIM_INFINITY:
        return
    used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * mmap.PAGESIZE
    if limit - used < _NEEDED_BYTES:
        raise VolprepError("VP7004", limit_mb=limit / 1e6, needed_mb=(used + _NEEDED_BYTES) / 1e6)
