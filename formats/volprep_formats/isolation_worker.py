"""The program of a worker process: calls what it is sent, under limits, until nobody wants more.

Started by `isolation` as a file, so that it neither repeats the main program of whoever uses volprep nor depends on
where the package is found; it imports nothing but the standard library before it is told where to look. Requests are
pickled; answers are lines of JSON, for a decoder that went wrong must not make its parent unpickle anything. An empty
line comes first, when all imports are done and the request's time begins.
"""

import contextlib
import json
import math
import mmap
import pickle
import resource
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from volprep_formats.isolation import WorkerRequest

_SECONDS_BEYOND = 60


def main() -> None:
    """Serve the socket that is file descriptor 1st argument; results go to the file that is the 2nd."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with socket.socket(fileno=int(sys.argv[1])) as parent, parent.makefile("rb") as requests:
        sys.path[:] = pickle.load(requests)  # noqa: S301 - from the parent
        # A parent that is gone is the end: EOF when it is asked for more, a broken pipe when it is answered.
        with contextlib.suppress(EOFError, ConnectionError):
            while True:
                request = pickle.load(requests)  # noqa: S301
                parent.sendall(b"\n")
                parent.sendall(json.dumps(_answer(request, int(sys.argv[2]))).encode() + b"\n")


def _answer(request: "WorkerRequest", result_file: int) -> dict[str, object]:
    import numpy as np  # noqa: PLC0415 - found by the parent's path

    from volprep_formats.diagnostics import VolprepError  # noqa: PLC0415

    try:
        _limit(request)
        result = request.function(request.argument)
        if result.nbytes > request.result_bytes:
            return {"failed": f"its result has {result.nbytes} bytes, not {request.result_bytes}"}
        with mmap.mmap(result_file, max(request.result_bytes, 1)) as shared:
            np.copyto(np.ndarray(result.shape, result.dtype, shared), result)
    except VolprepError as error:
        fields = {k: v if isinstance(v, (int, float, str)) else str(v) for k, v in error.fields.items()}
        return {"code": error.code, "fields": fields}
    except MemoryError:
        return {"memory": True}
    except Exception as error:  # noqa: BLE001 - whatever it is, the parent shall know
        return {"failed": f"{type(error).__name__}: {error}"}
    return {"dtype": result.dtype.str, "shape": result.shape}


def _limit(request: "WorkerRequest") -> None:
    """Set the limits of this request. What imports have mapped so far is not counted."""
    # Not every system lets the address space be limited; the limit of time remains.
    with contextlib.suppress(OSError, ValueError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        most = pages * mmap.PAGESIZE + request.memory_bytes + request.result_bytes
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
    # The parent ends a worker in time. If it is killed itself, no decoder may spin for ever.
    usage = resource.getrusage(resource.RUSAGE_SELF)
    used = usage.ru_utime + usage.ru_stime
    seconds = math.ceil(used + request.seconds) + _SECONDS_BEYOND
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))


main()
