"""Main program of a worker process: runs requests under limits until the parent closes the connection.

`isolation` starts it as a file, so that it neither repeats the parent's main program nor depends on where the package
is installed; it imports only the standard library until it receives the import path. Requests are pickled. Answers are
lines of JSON, because a compromised decoder must not make its parent unpickle anything. An empty line comes first, when
all imports are done and the request's time begins.
"""

import contextlib
import json
import math
import mmap
import pickle
import resource
import signal
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from volprep_formats.isolation import WorkerRequest


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
                signal.setitimer(signal.ITIMER_PROF, 0)


def _answer(request: "WorkerRequest", result_file: int) -> dict[str, object]:
    import numpy as np  # noqa: PLC0415 - found by the parent's path

    from volprep_formats.diagnostics import VolprepError  # noqa: PLC0415

    left = math.inf
    try:
        left = _limit(request)
        result = request.function(request.argument)
        if result.nbytes > request.result_bytes:
            return {"failed": f"its result has {result.nbytes} bytes, not {request.result_bytes}"}
        with mmap.mmap(result_file, max(request.result_bytes, 1)) as shared:
            np.copyto(np.ndarray(result.shape, result.dtype, shared), result)
    except VolprepError as error:
        fields = {k: v if isinstance(v, (int, float, str)) else str(v) for k, v in error.fields.items()}
        return {"code": error.code, "fields": fields}
    except MemoryError:
        return {"memory": left}
    except UnlimitedError as error:
        return {"unlimited": str(error)}
    except Exception as error:  # noqa: BLE001 - whatever it is, the parent shall know
        return {"failed": f"{type(error).__name__}: {error}"}
    return {"dtype": result.dtype.str, "shape": result.shape}


class UnlimitedError(Exception):
    """The limits of a request cannot be set."""


def _limit(request: "WorkerRequest") -> float:
    """Set the limits of this request: the smaller of the request's limits and this machine's.

    Memory that imports have mapped so far is not counted. Returns the memory in bytes that is left for the request.
    Raises UnlimitedError if the system refuses to set the limits; untrusted data is then not decoded.
    """
    try:
        left = _limit_memory(request)
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        if hard != resource.RLIM_INFINITY:
            # At the hard limit the system kills without a word; one second before, a signal tells why.
            resource.setrlimit(resource.RLIMIT_CPU, (min(hard, max(1, hard - 1)), hard))
        # Processor time: on a busy machine sound files take long, too. SIGPROF ends the process.
        signal.setitimer(signal.ITIMER_PROF, request.seconds)
    except (OSError, ValueError) as error:
        raise UnlimitedError(str(error)) from error
    return left


def _limit_memory(request: "WorkerRequest") -> float:
    if sys.platform != "linux":
        # Other systems do not limit the address space; the limit of time remains.
        return math.inf
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    held = pages * mmap.PAGESIZE
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = _smaller(held + request.memory_bytes + request.result_bytes, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    return most - held - request.result_bytes


def _smaller(wanted: int, hard: int) -> int:
    return wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)


main()
