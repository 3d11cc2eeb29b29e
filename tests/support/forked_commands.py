"""Commands in processes that do not start from nothing: each is a copy of one process that has loaded all modules.

To load them takes half a second of processor time, more than most small commands need for their work. A copy has its
own arguments, working directory and streams, and ends as any process does. It shares with the other copies what a
process takes in when it starts: the environment, and the seed of its hashes.
"""

import array
import atexit
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import traceback
from pathlib import Path
from tempfile import TemporaryFile

_MODULES = (
    "volprep.doctor",
    "volprep.pipeline.import_draft",
    "volprep.pipeline.build",
    "volprep.pipeline.drafts",
    "volprep.render.renderer",
    "volprep.lab.stress.study",
    "volprep.report.validate",
    "volprep.view.export",
    "volprep.view.server",
)
"""What verbs load when they run; the verbs load the rest."""
_CHANGING = {"PYTEST_CURRENT_TEST", "DASK_SCHEDULER_ADDRESS", "__DASK_PARENT_PID"}
"""Set for each test, and by each scheduler in this process."""


class Forked:
    """The process that all are copies of."""

    def __init__(self) -> None:
        """Start it in the environment that this process has now."""
        import volprep.render.bindings  # noqa: F401 - sets the variables that OpenGL reads, here as in the copies

        self._environment = _lasting(dict(os.environ))
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        path = os.pathsep.join([str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])])
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"import forked_commands; forked_commands.serve({theirs.fileno()})"],
            env={**self._environment, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
        )
        theirs.close()
        atexit.register(self._close)

    def _close(self) -> None:
        self._socket.close()
        self._process.wait()

    def serves(self, environment: dict[str, str]) -> bool:
        """Return whether a command in this environment may be a copy."""
        return self._process.poll() is None and _lasting(environment) == self._environment

    def run(self, arguments: list[str], cwd: Path | None, timeout_s: float) -> subprocess.CompletedProcess[str]:
        """Run the command line."""
        with TemporaryFile("w+") as out, TemporaryFile("w+") as err:
            request = json.dumps([arguments, str(cwd or Path.cwd())]).encode()
            streams = array.array("i", [out.fileno(), err.fileno()])
            self._socket.settimeout(timeout_s)
            self._socket.sendmsg([request], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, streams)])
            process = json.loads(self._socket.recv(100))
            try:
                status = json.loads(self._socket.recv(100))
            except TimeoutError:
                os.kill(process, signal.SIGKILL)
                self._process.kill()
                raise
            out.seek(0)
            err.seek(0)
            return subprocess.CompletedProcess(arguments, status, out.read(), err.read())


def _lasting(environment: dict[str, str]) -> dict[str, str]:
    """Return an environment without the variables that tests change and no command reads."""
    return {name: value for name, value in environment.items() if name not in _CHANGING}


def serve(descriptor: int) -> None:
    """Load all modules, and run one command after another until nobody holds the other end."""
    import gc
    from contextlib import ExitStack
    from importlib import import_module

    from remembered_stages import FOLDER, remember
    from small_previews import small_previews

    from volprep_cli.main import command_line

    command_line(())
    for module in _MODULES:
        import_module(module)
    gc.freeze()
    with ExitStack() as lasting, socket.socket(fileno=descriptor) as connection:
        lasting.enter_context(small_previews())
        if FOLDER in os.environ:
            lasting.enter_context(remember(Path(os.environ[FOLDER])))
        while True:
            message, streams, _, _ = socket.recv_fds(connection, 1_000_000, 2)
            if not message:
                return
            process = os.fork()
            if process == 0:
                connection.close()
                _run(*json.loads(message), *streams)
            for stream in streams:
                os.close(stream)
            connection.send(json.dumps(process).encode())
            connection.send(json.dumps(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])).encode())


def _run(arguments: list[str], cwd: str, out: int, err: int) -> None:
    """Be a process of volprep, to the end."""
    for stream, descriptor in ((out, 1), (err, 2)):
        os.dup2(stream, descriptor)
        os.close(stream)
    os.chdir(cwd)
    sys.argv = ["-c", *arguments]
    status = 1
    try:
        from volprep_cli.main import main

        main()
        status = 0
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:  # noqa: BLE001 - as the interpreter does
        traceback.print_exc()
    finally:
        threading._shutdown()  # type: ignore[attr-defined]
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
