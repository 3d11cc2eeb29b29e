"""A disk that is full, and a folder that disappears, in the middle of a batch."""

import json
import resource
import shutil

import pytest
from batch_scans import records, start, wait_until, write_scans
from command_line import COMMAND, ended


@pytest.mark.long
def test_a_scan_for_which_there_is_no_room_is_recorded_and_others_go_on(tmp_path) -> None:
    write_scans(tmp_path / "in" / "small", 1, edge=8)
    write_scans(tmp_path / "in" / "large", 1, edge=40)
    out = tmp_path / "out"
    # A limit on the size of files is told by the same calls as a full disk, and needs no disk of its own.
    limit = 30_000
    done = ended(
        [*COMMAND, "batch", str(tmp_path / "in"), "-o", str(out), "--shard", "1/1"],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert done.returncode == 6
    assert "Traceback" not in done.stdout + done.stderr
    found = {record["outcome"]: record for record in records(out)}
    assert set(found) == {"built", "failed"}
    assert found["failed"]["errors"][0]["code"] == "VP4020"
    assert "File too large" in found["failed"]["errors"][0]["summary"]
    assert [path.name for path in (out / "gles3").glob("*.volpkg")] == [f"{found['built']['name']}.volpkg"]
    assert not list((out / "gles3").glob(".*.partial"))
    assert json.loads((out / "index.json").read_text())["summary"]["failed"] == 1


@pytest.mark.long
def test_a_folder_that_disappears_ends_the_batch_with_a_code(tmp_path) -> None:
    write_scans(tmp_path / "in", 4)
    out = tmp_path / "out"
    process = start(tmp_path / "in", "-o", out, "--shard", "1/1")
    wait_until(lambda: records(out))
    (tmp_path / "gone").mkdir()
    shutil.move(out, tmp_path / "gone")
    _, said = process.communicate(timeout=120)
    assert process.returncode == 6
    assert "Traceback" not in said
    assert "VP8011" in said or "VP4020" in said
