"""Workers that are killed, hang or take too much lose their scan only; batches that are killed go on."""

import json
import os
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from batch_scans import builders, files_of, records, start, wait_until, write_scans
from small_previews import FULL, small_previews

from volprep.pipeline.build import build
from volprep.scene.request import request_for_source
from volprep_formats.progress import Silent

ENGINES = {"alone": ["--shard", "1/1"], "workers": ["--workers", "2"]}


def names(folder: Path) -> list[object]:
    return sorted(record["name"] for record in records(folder))


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    out, err = process.communicate(timeout=120)
    assert "Traceback" not in out + err
    return process.returncode, out


def large_scan(folder: Path) -> Path:
    """A scan whose build takes long enough to be met."""
    (file,) = write_scans(folder, 1, edge=70)
    return file


@pytest.mark.long
@pytest.mark.parametrize("engine", ENGINES)
def test_a_killed_worker_loses_its_scan_only_which_is_tried_once_more(tmp_path, engine) -> None:
    large_scan(tmp_path / "in" / "large")
    write_scans(tmp_path / "in" / "small", 2)
    out = tmp_path / "out"
    process = start(tmp_path / "in", "-o", out, *ENGINES[engine])
    wait_until(lambda: list(out.glob("gles3/.*.partial/work/*")) and builders(process, out))
    builders(process, out)[0].kill()
    status, _ = ended(process)
    assert status == 0
    found = records(out)
    assert len(found) == 3
    assert sum(record["retries"] for record in found) == 1
    assert all(record["outcome"] == "built" for record in found)


@pytest.mark.long
def test_a_scan_whose_process_dies_each_time_is_recorded_with_a_code_and_others_go_on(tmp_path) -> None:
    large_scan(tmp_path / "in" / "large")
    write_scans(tmp_path / "in" / "small", 1)
    out = tmp_path / "out"
    process = start(tmp_path / "in", "-o", out, "--shard", "1/1")
    killed: set[int] = set()
    while len(killed) < 2:
        wait_until(lambda: list(out.glob("gles3/.*.partial/work/*")) and builders(process, out))
        for worker in builders(process, out):
            worker.kill()
            killed.add(worker.pid)
        wait_until(lambda: not killed & {worker.pid for worker in builders(process, out)})
    status, _ = ended(process)
    assert status == 3
    (failed,) = (record for record in records(out) if record["outcome"] == "failed")
    assert failed["errors"][0]["code"] == "VP8020"
    assert failed["retries"] == 1
    assert len(records(out)) == 2
    # What failed stays, until it is wished to try it again.
    assert ended(start(tmp_path / "in", "-o", out, "--shard", "1/1"))[0] == 3
    assert ended(start(tmp_path / "in", "-o", out, "--shard", "1/1", "--retry-failed"))[0] == 0
    assert [record["outcome"] for record in records(out)] == ["built", "built"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("engine", "limit", "code"),
    [
        ("alone", ("--time-limit", "0.1"), "VP8021"),
        ("alone", ("--memory-limit", "20"), "VP8022"),
        ("workers", ("--time-limit", "0.1"), "VP8021"),
    ],
)
def test_a_scan_that_passes_a_limit_is_stopped_tried_again_and_recorded(tmp_path, engine, limit, code) -> None:
    large_scan(tmp_path / "in")
    out = tmp_path / "out"
    status, _ = ended(start(tmp_path / "in", "-o", out, *ENGINES[engine], *limit))
    assert status == 3
    (record,) = records(out)
    assert record["errors"][0]["code"] == code
    assert record["retries"] == 1


@pytest.mark.long
def test_a_killed_batch_goes_on_with_one_record_each_and_the_bytes_of_serial_builds(tmp_path) -> None:
    files = write_scans(tmp_path / "in", 4)
    out = tmp_path / "out"
    process = start(tmp_path / "in", "-o", out, "--workers", "2")
    wait_until(lambda: records(out))
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert 1 <= len(records(out)) < 4
    assert ended(start(tmp_path / "in", "-o", out, "--shard", "1/1"))[0] == 0
    found = records(out)
    assert len(set(names(out))) == len(found) == 4

    by_size = {record["shape_zyx"][0]: record for record in found}
    for number, file in enumerate(files):
        record = by_size[12 + number]
        request = request_for_source(file)
        request = replace(request, scene=request.scene.model_copy(update={"name": record["name"]}))
        alone = tmp_path / "alone" / f"{record['name']}.volpkg"
        with small_previews(FULL):  # as processes of a batch draw them
            build(request, alone, Silent())
        assert files_of(out / record["package"]) == files_of(alone)


@pytest.mark.long
def test_a_batch_whose_parent_alone_is_killed_leaves_no_process(tmp_path) -> None:
    write_scans(tmp_path / "in", 4)
    out = tmp_path / "out"
    process = start(tmp_path / "in", "-o", out, "--workers", "2")
    wait_until(lambda: records(out))
    children = psutil.Process(process.pid).children(recursive=True)
    process.kill()
    process.communicate()
    assert children
    assert psutil.wait_procs(children, timeout=30)[1] == []


@pytest.mark.long
@pytest.mark.parametrize("engine", ENGINES)
def test_an_interrupt_ends_a_batch_with_its_ledger_and_its_pages(tmp_path, engine) -> None:
    write_scans(tmp_path / "in", 5)
    out = tmp_path / "out"
    process = start(tmp_path / "in", "-o", out, *ENGINES[engine])
    wait_until(lambda: records(out))
    children = psutil.Process(process.pid).children(recursive=True)
    os.killpg(process.pid, signal.SIGINT)
    began = time.monotonic()
    status, _ = ended(process)
    assert status == -signal.SIGINT
    assert time.monotonic() - began < 20
    assert psutil.wait_procs(children, timeout=10)[1] == []
    found = records(out)
    assert 1 <= len(found) < 5
    assert json.loads((out / "index.json").read_text(encoding="ascii"))["jobs"] == found
    assert (out / "index.html").is_file()


@pytest.mark.long
def test_two_batches_at_one_folder_build_each_scan_once(tmp_path) -> None:
    write_scans(tmp_path / "in", 4)
    out = tmp_path / "out"
    both = [start(tmp_path / "in", "-o", out, "--shard", "1/1", "--json") for _ in range(2)]
    said = "".join(ended(process)[1] for process in both)
    assert said.count('"new": true') == 4
    assert len(set(names(out))) == len(records(out)) == 4
