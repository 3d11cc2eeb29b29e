"""Batches on a Dask scheduler that runs already, whatever it does when a worker dies."""

import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import dask
import pytest
from batch_scans import records, wait_until, write_scans
from dask.utils import parse_timedelta
from distributed import Client, LocalCluster, Scheduler

from volprep.batch import cluster as engines
from volprep.batch.cluster import Remote
from volprep.batch.guard import Limits
from volprep.batch.jobs import Defaults
from volprep.batch.place import Place
from volprep.batch.run import Wishes, find_jobs, run_batch
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.progress import Silent

ONLY_HERE = "127.0.0.1:0"
WISHES = Wishes(validate=False, retry_failed=False, limits=Limits(60.0, None))


class Unwatched:
    def begin(self, jobs: int) -> None:
        pass

    def ended(self, ended: object) -> None:
        pass

    def passed(self, error: object) -> None:
        pass


@pytest.fixture(scope="module")
def scheduler() -> Iterator[LocalCluster]:
    """A scheduler with its own settings, such as three deaths before it gives a task up, and two workers."""
    dask.config.refresh()
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=ONLY_HERE) as cluster:
        yield cluster


def run(source: Path, out: Path, address: str, wishes: Wishes = WISHES) -> ExitStatus:
    place = Place(out)
    return run_batch(
        find_jobs(source, place, Defaults(), Silent()), place, wishes, Remote(address, lambda _link: None), Unwatched()
    )


@pytest.mark.long
def test_the_workers_of_a_scheduler_build_all_scans(scheduler, tmp_path) -> None:
    write_scans(tmp_path / "in", 3)
    assert run(tmp_path / "in", tmp_path / "out", scheduler.scheduler_address) == ExitStatus.OK
    assert [record["outcome"] for record in records(tmp_path / "out")] == ["built"] * 3


@pytest.mark.long
def test_a_scan_that_kills_its_workers_is_recorded_after_two_of_them(scheduler, tmp_path) -> None:
    assert isinstance(scheduler.scheduler, Scheduler)
    assert scheduler.scheduler.allowed_failures > 1
    write_scans(tmp_path / "in", 1, edge=70)
    wishes = Wishes(validate=False, retry_failed=False, limits=Limits(0.1, None))
    status = run(tmp_path / "in", tmp_path / "out", scheduler.scheduler_address, wishes)
    assert status == ExitStatus.SOURCE
    (record,) = records(tmp_path / "out")
    assert record["errors"][0]["code"] == "VP8021"
    assert record["retries"] == 1


def test_a_scheduler_that_does_not_answer_is_named(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(engines, "_WAIT_S", 0.5)
    write_scans(tmp_path / "in", 1)
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{nobody.getsockname()[1]}"
        with pytest.raises(VolprepError, match=f"VP8030 {address}"):
            run(tmp_path / "in", tmp_path / "out", address)
    with pytest.raises(VolprepError, match="VP8030 nonsense"):
        run(tmp_path / "in", tmp_path / "out", "nonsense://")


def test_a_scheduler_without_workers_is_named(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(engines, "_WAIT_S", 0.5)
    write_scans(tmp_path / "in", 1)
    with LocalCluster(n_workers=0, dashboard_address=ONLY_HERE) as empty, pytest.raises(VolprepError, match="VP8032"):
        run(tmp_path / "in", tmp_path / "out", empty.scheduler_address)


def test_workers_of_another_version_are_refused(scheduler, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(engines, "version", lambda _name: "99.0")
    write_scans(tmp_path / "in", 1)
    with pytest.raises(VolprepError, match=r"VP8031 .*and this is 99\.0"):
        run(tmp_path / "in", tmp_path / "out", scheduler.scheduler_address)


@pytest.mark.long
def test_a_batch_that_loses_its_scheduler_says_so(tmp_path) -> None:
    write_scans(tmp_path / "in", 2, edge=70)
    cluster = LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=ONLY_HERE)

    def close() -> None:
        wait_until(lambda: list((tmp_path / "out").glob("gles3/.*.partial")))
        cluster.close()

    closed = threading.Thread(target=close)
    closed.start()
    with pytest.raises(VolprepError, match="VP8030"):
        run(tmp_path / "in", tmp_path / "out", cluster.scheduler_address)
    closed.join()


@pytest.mark.long
def test_a_batch_changes_no_setting_of_a_program_that_uses_dask(scheduler, tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    before = dask.config.get("scheduler", None)
    found = []
    with patch.object(engines, "_run", lambda client, tasks: found.append(dask.config.get("scheduler", None)) or ()):
        run(tmp_path / "in", tmp_path / "out", scheduler.scheduler_address)
    assert found == [before]


@pytest.mark.long
def test_a_killed_worker_that_takes_long_to_start_again_is_not_given_up() -> None:
    def workers_after_a_kill(settings: dict[str, object]) -> int:
        local = {"n_workers": 1, "threads_per_worker": 1, "processes": True, "dashboard_address": ONLY_HERE}
        with (
            dask.config.set(settings),
            LocalCluster(**local) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            (pid,) = client.run(os.getpid).values()
            os.kill(pid, signal.SIGKILL)
            time.sleep(1.0)
            return len(cluster.workers)

    limit = "distributed.deploy.lost-worker-timeout"
    assert workers_after_a_kill({**engines._SETTINGS, limit: "1 ms"}) == 0
    assert workers_after_a_kill(engines._SETTINGS) == 1
    # A start on a busy machine took longer than the 15 s that are Dask's own.
    assert parse_timedelta(engines._SETTINGS[limit]) > 3600
