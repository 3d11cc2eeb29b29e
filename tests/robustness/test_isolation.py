"""Decoders that crash, hang, flood the memory or print: each costs one coded message, and leaves nothing behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import decoders
import numpy as np
import pytest
from command_line import ended

from volprep_formats import isolation
from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import WorkerRequest, workers

SHARED_MEMORY = Path("/dev/shm")  # noqa: S108


def request(function, argument=None, *, result_bytes=1000, memory_bytes=2**28, seconds=30.0) -> WorkerRequest:
    return WorkerRequest(function, argument, Path("scan.dcm"), result_bytes, memory_bytes, seconds)


def run(*requests: WorkerRequest) -> list[np.ndarray]:
    results = {}
    with workers() as pool:
        pool.run(requests, lambda index, array: results.update({index: array.copy()}))
    return [results[i] for i in range(len(requests))]


def refusal(*requests: WorkerRequest) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        run(*requests)
    return error.value


def children() -> set[int]:
    """Processes that this one has started, zombies too."""
    return {int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()}


def is_running(pid: int) -> bool:
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.fixture(autouse=True)
def nothing_left():
    before, names = children(), set(SHARED_MEMORY.iterdir())
    yield
    assert children() <= before, "a worker, or its zombie, is left"
    assert not [path for path in set(SHARED_MEMORY.iterdir()) - names if "volprep" in path.name or "psm" in path.name]


def test_each_result_comes_with_the_index_of_its_request() -> None:
    counts = [30, 1, 17, 0, 5, 100, 2]
    results = run(*(request(decoders.squares, count) for count in counts))
    for count, result in zip(counts, results, strict=True):
        assert np.array_equal(result, np.arange(count, dtype=np.int32)[None] ** 2)


def test_type_order_of_bytes_and_order_of_axes_survive() -> None:
    big_endian, floats = run(request(decoders.chatter), request(decoders.transposed))
    assert (big_endian.dtype.str, big_endian.shape) == (">u2", (2, 3))
    assert floats.tolist() == [[0, 3], [1, 4], [2, 5]]


def test_what_a_decoder_prints_is_not_seen(capfd) -> None:
    run(request(decoders.chatter))
    assert capfd.readouterr() == ("", "")


def test_no_process_starts_before_it_is_needed_and_one_is_enough_for_one_request() -> None:
    before = children()
    with workers() as pool:
        assert children() == before
        pool.run([request(decoders.process_id)], lambda _index, _array: None)
        assert len(children() - before) == 1


def test_workers_are_used_again_until_their_last_user_leaves() -> None:
    found = []
    with workers() as outer:
        for _ in range(3):
            with workers() as inner:
                assert inner is outer
                inner.run([request(decoders.process_id)], lambda _index, array: found.append(int(array[0])))
        assert len(set(found)) == 1
        assert found[0] != os.getpid()
        assert is_running(found[0])
    assert not is_running(found[0])


def test_an_error_of_the_decoder_comes_through_whole() -> None:
    error = refusal(request(decoders.refuse, 7))
    assert str(error) == str(VolprepError("VP1090", count=3, z=7))


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("bad", "code", "said"),
    [
        (request(decoders.crash), "VP1270", "SIGSEGV"),
        (request(decoders.leave, 3), "VP1270", "exit status 3"),
        (request(decoders.leave, 0), "VP1270", "exit status 0"),
        (request(decoders.hang, seconds=0.3), "VP1271", "0 s of processor time"),
        (request(decoders.devour, 2**30), "VP1272", "268 MB"),
        (request(decoders.too_large, 1001), "VP1270", "1001 bytes"),
        (request(int, "x"), "VP1270", "ValueError"),
    ],
)
def test_a_bad_decoder_costs_one_message_and_the_next_request_works(bad, code, said) -> None:
    with workers():
        run(request(decoders.squares, 1))  # so that the time for starting does not count
        error = refusal(bad)
        assert error.code == code
        assert "scan.dcm" in str(error)
        assert said in str(error)
        assert run(request(decoders.squares, 3))[0].tolist() == [[0, 1, 4]]


def test_a_sound_decoder_that_has_to_wait_for_a_processor_is_not_stopped() -> None:
    assert run(request(decoders.doze, 0.5, seconds=0.2))[0].tolist() == [0.5]


def test_a_decoder_that_waits_for_ever_is_stopped(monkeypatch) -> None:
    monkeypatch.setattr(isolation, "_WAITING", 1)
    error = refusal(request(decoders.doze, 100.0, seconds=0.2))
    assert error.code == "VP1271"
    assert "0 s of waiting" in str(error)


def test_processor_time_of_earlier_requests_does_not_count() -> None:
    with workers():
        for _ in range(3):
            run(request(decoders.work, 0.3, seconds=0.5))


def test_memory_within_the_limit_may_be_used() -> None:
    assert run(request(decoders.devour, 2**27))[0].tolist() == [1]


def test_threads_of_a_decoder_take_none_of_its_memory(tmp_path) -> None:
    # Each would take a stack of 8 MB and 64 MB of the allocator: 16 of them more than a decoder may have.
    import OpenImageIO

    picture = tmp_path / "p.tif"
    pixels = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(64, 64, 1, "uint16"))
    assert pixels.write(str(picture))
    (added_mb,) = run(request(decoders.room_for_a_picture, str(picture)))
    assert added_mb < 40


def test_a_limit_is_that_of_its_request() -> None:
    with workers():
        assert refusal(request(decoders.devour, 2**26, memory_bytes=2**25)).code == "VP1272"
        assert run(request(decoders.devour, 2**26))[0].tolist() == [1]


@pytest.mark.long
def test_the_error_is_that_of_the_first_bad_request_not_of_the_fastest() -> None:
    slow = request(decoders.hang, seconds=0.5)
    for _ in range(3):
        assert refusal(request(decoders.squares, 2), slow, *[request(decoders.refuse, z) for z in range(9)]).code == (
            "VP1271"
        )


def test_requests_after_a_bad_one_are_left_out() -> None:
    taken = []
    requests = [request(decoders.refuse, 0), *[request(decoders.squares, 1)] * 50]
    with workers() as pool, pytest.raises(VolprepError):
        pool.run(requests, lambda index, _array: taken.append(index))
    # The other workers go on until the one with the bad request has started, and said so.
    assert len(taken) < 50


def test_a_worker_at_a_request_after_a_bad_one_is_not_waited_for() -> None:
    with workers():
        run(*[request(decoders.squares, 1)] * 2)
        began = time.monotonic()
        assert refusal(request(decoders.refuse, 0), request(decoders.hang, seconds=100.0)).code == "VP1090"
        assert run(*[request(decoders.squares, 3)] * 3)[2].tolist() == [[0, 1, 4]]
        assert time.monotonic() - began < 50


def test_a_worker_killed_while_idle_is_replaced() -> None:
    with workers():
        (pid,) = run(request(decoders.process_id))[0]
        os.kill(pid, signal.SIGKILL)
        while is_running(pid):
            time.sleep(0.001)
        assert run(request(decoders.squares, 2))[0].tolist() == [[0, 1]]


def test_no_python_to_start_is_a_fault_of_the_machine(monkeypatch) -> None:
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    error = refusal(request(decoders.squares, 1))
    assert (error.code, error.status) == ("VP1273", 8)
    assert "No such file" in str(error)


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
import decoders
from pathlib import Path
from volprep_formats.isolation import WorkerRequest, workers
print("once")
function, argument = getattr(decoders, sys.argv[2]), sys.argv[3]
request = WorkerRequest(function, argument, Path("x"), 100, 2**28, 100.0)
with workers() as pool:
    pool.run([request, request], lambda i, a: print(a.tolist()))
"""


def program(folder: Path, function: str, argument: str) -> list[str]:
    """A command that decodes two things with one of `decoders`."""
    file = folder / "program.py"
    file.write_text(PROGRAM)
    return [sys.executable, str(file), str(Path(decoders.__file__).parent), function, argument]


def test_a_program_that_does_not_guard_its_main_part_is_not_run_again(tmp_path) -> None:
    done = subprocess.run(program(tmp_path, "transposed", ""), capture_output=True, text=True, check=True)
    assert (done.stdout.splitlines(), done.stderr) == (["once", *["[[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]]"] * 2], "")


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGKILL])
def test_workers_end_with_their_parent(tmp_path, signal_number) -> None:
    mark = tmp_path / "began"
    with subprocess.Popen(program(tmp_path, "sleep_and_mark", str(mark)), stderr=subprocess.DEVNULL) as parent:
        while not mark.exists() or not mark.read_text().endswith("\n"):
            time.sleep(0.01)
        os.kill(parent.pid, signal_number)
        parent.wait(20)
    workers_left = [int(pid) for pid in mark.read_text().split()]
    if signal_number == signal.SIGINT:
        assert not any(is_running(pid) for pid in workers_left)
    else:  # one that sleeps in its decoder, and is not told, wakes up first
        deadline = time.monotonic() + 20
        while any(is_running(pid) for pid in workers_left) and time.monotonic() < deadline:
            time.sleep(0.01)
        assert not any(is_running(pid) for pid in workers_left)


UNDER_LIMITS = """
import resource, sys
from pathlib import Path
sys.path[:0] = {path!r}
import decoders
from volprep_formats import isolation
from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import WorkerRequest, workers

what, hard, function, argument = sys.argv[1:]
if what != "none":
    limit = getattr(resource, what)
    resource.setrlimit(limit, (int(hard), int(hard)))
request = WorkerRequest(getattr(decoders, function), int(argument), Path("scan.dcm"), 1000, 2**30, 30.0)
try:
    with workers() as pool:
        pool.run([request], lambda index, array: print("done"))
except VolprepError as error:
    print(error)
"""


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("what", "hard", "function", "argument", "said"),
    [
        ("RLIMIT_CPU", 40, "squares", 3, "done"),
        ("RLIMIT_CPU", 2, "hang", 0, "VP7071 scan.dcm: its decoder reached this machine's limit of processor time"),
        ("RLIMIT_AS", 2**31, "squares", 3, "done"),
        ("RLIMIT_AS", 2**30, "devour", 2**31, "VP7071 scan.dcm: its decoder reached this machine's limit of memory"),
        ("RLIMIT_AS", 3 * 2**31, "devour", 2**31, "VP1272 scan.dcm: its decoder asked for more than the 1074 MB"),
    ],
)
def test_limits_hold_below_the_limits_of_a_scheduler(what, hard, function, argument, said) -> None:
    script = UNDER_LIMITS.format(path=sys.path)
    command = [sys.executable, "-c", script, what, str(hard), function, str(argument)]
    done = ended(command, env=os.environ | {"MALLOC_ARENA_MAX": "1"})
    assert done.stdout.startswith(said), done.stdout + done.stderr


def test_a_worker_that_cannot_be_limited_does_not_run(monkeypatch, tmp_path) -> None:
    worker = tmp_path / "worker.py"
    refusing = "def _refuse(*_):\n    raise OSError(1, 'no')\n\n\nresource.setrlimit = _refuse\nmain()\n"
    text = isolation._WORKER.read_text()
    # The limit of core files comes first, in main.
    worker.write_text(
        text.replace("    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))\n", "").replace("\nmain()\n", refusing)
    )
    monkeypatch.setattr(isolation, "_WORKER", worker)
    mark = tmp_path / "mark"
    error = refusal(request(decoders.leave_a_mark, str(mark)))
    assert error.code == "VP7070"
    assert not mark.exists()
