"""One job in this process: what is done, what counts as changed, and what is refused."""

import shutil
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pytest
from batch_scans import files_of, write_scans

from volprep.batch import work as module
from volprep.batch.attempts import job_locked
from volprep.batch.guard import Limits
from volprep.batch.jobs import Defaults
from volprep.batch.ledger import Ledger
from volprep.batch.place import Place
from volprep.batch.run import Wishes, find_jobs, run_batch
from volprep.batch.work import Task, give_up, work
from volprep.scene.profiles import load_profile
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent


@pytest.fixture
def task(tmp_path: Path) -> Task:
    """A job that nobody has done."""
    write_scans(tmp_path / "in", 1)
    place = Place(tmp_path / "out")
    (job,) = find_jobs(tmp_path / "in", place, Defaults(), Silent())
    return Task(job, place, "run", validate=False, retry_failed=False, seen=None, limits=Limits(60.0, None))


def test_a_job_is_done_once(task) -> None:
    first, again = work(task), work(task)
    assert (first.is_new, again.is_new) == (True, False)
    assert first.record == again.record
    assert files_of(task.place.package(task.job.name, "gles3"))


@pytest.mark.long
def test_a_job_is_done_again_with_another_scene_profile_or_version(task, monkeypatch) -> None:
    work(task)
    scene = task.job.request.scene
    other = scene.model_copy(update={"tolerance": scene.tolerance.model_copy(update={"rmse": 0.5})})
    assert work(replace(task, job=replace(task.job, request=replace(task.job.request, scene=other)))).is_new
    small = load_profile("gles3", Path()).model_copy(update={"max_texture_size": 512})
    assert work(replace(task, job=replace(task.job, request=replace(task.job.request, profile=small)))).is_new
    assert work(task).is_new
    monkeypatch.setattr(module, "_version", lambda: "99.0")
    assert work(task).is_new
    assert not work(task).is_new


def test_a_job_whose_package_is_missing_or_another_is_done_again(task) -> None:
    work(task)
    package = task.place.package(task.job.name, "gles3")
    shutil.rmtree(package)
    assert work(task).is_new
    (package / "manifest.json").write_bytes((package / "manifest.json").read_bytes() + b" ")
    assert work(task).is_new


def test_a_package_that_is_damaged_behind_the_ledger_is_built_again(task) -> None:
    work(task)
    package = task.place.package(task.job.name, "gles3")
    texture = next(package.glob("textures/*.ktx2"))
    whole = texture.read_bytes()
    texture.write_bytes(whole[:-1])
    assert work(task).is_new
    texture.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert not work(task).is_new, "digests are compared on request"
    assert work(replace(task, digests=True)).is_new
    assert texture.read_bytes() == whole
    (package / "more.txt").write_text("x")
    assert work(task).is_new


def test_a_scan_that_changes_while_it_is_read_leaves_no_package(task, monkeypatch) -> None:
    build = module.build

    def build_and_change(request, target, progress):
        manifest = build(request, target, progress)
        file = task.job.files[0]
        file.write_bytes(file.read_bytes())
        return manifest

    monkeypatch.setattr(module, "build", build_and_change)
    record = work(task).record
    assert record is not None
    assert [error.code for error in record.errors] == ["VP8023"]
    assert not task.place.package(task.job.name, "gles3").exists()


def test_a_defect_is_recorded_without_its_text(task, monkeypatch) -> None:
    def broken(*_: object) -> None:
        msg = "CANARY"
        raise ZeroDivisionError(msg)

    monkeypatch.setattr(module, "build", broken)
    record = work(task).record
    assert record is not None
    assert [error.code for error in record.errors] == ["VP9001"]
    assert "CANARY" not in record.model_dump_json()


def test_a_job_that_another_process_works_on_is_left_to_it(task) -> None:
    with job_locked(task.place.job_lock(task.job.name, "gles3"), "another run") as held:
        assert held is not None
        assert work(task).record is None
        assert give_up(task).record is None
    assert Ledger(task.place).records() == {}
    assert work(task).is_new


def test_the_lock_of_a_process_that_was_killed_after_its_record_is_removed_by_the_next_batch(task) -> None:
    work(task)
    lock = task.place.job_lock(task.job.name, "gles3")

    def again() -> None:
        wishes = Wishes(validate=False, retry_failed=False, limits=task.limits)
        # Every job is done: there is nothing for an engine.
        run_batch([task.job], task.place, wishes, Mock(run=Mock(side_effect=AssertionError)), Mock())

    lock.touch()
    again()
    assert not lock.exists()
    with job_locked(lock, "another batch that builds this job"):
        again()
        assert lock.exists()


def test_attempts_of_another_batch_do_not_count_as_this_one_s(task) -> None:
    for run, times in (("another", 5), ("run", 1)):
        for _ in range(times):
            with job_locked(task.place.job_lock(task.job.name, "gles3"), run) as attempts:
                assert attempts is not None
                attempts.begin()
    record = work(task).record
    assert record is not None
    assert (record.outcome, record.retries) == ("built", 1)


def test_what_failed_is_tried_again_only_if_that_is_wished_and_only_once(task, tmp_path) -> None:
    task.job.files[0].write_bytes(task.job.files[0].read_bytes()[:500])
    failed = work(task).record
    assert failed is not None
    assert failed.outcome == "failed"
    assert not work(task).is_new
    wished = replace(task, retry_failed=True, seen=failed.ended)
    assert work(wished).is_new
    # The other batch that began at the same time finds it tried.
    assert not work(wished).is_new


def test_a_process_that_does_not_see_the_folder_builds_nothing(task) -> None:
    shutil.rmtree(task.place.folder)
    with pytest.raises(VolprepError, match="VP8011"):
        work(task)
    assert not task.place.folder.exists()
