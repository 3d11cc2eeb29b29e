"""Scans and packages in an object store: a real S3 server on this machine, which may be busy half of the time."""

import hashlib
import itertools
import json
import logging
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from batch_scans import files_of, records, write_scans
from dicom_files import save_all, stack

from volprep.batch import storage
from volprep.batch.guard import Limits
from volprep.batch.jobs import Defaults
from volprep.batch.place import Place
from volprep.batch.records import JobRecord
from volprep.batch.run import Wishes, find_jobs, run_batch
from volprep.batch.work import Task, work
from volprep.pipeline.build import build
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.progress import Silent

s3fs = pytest.importorskip("s3fs")
make_server = pytest.importorskip("werkzeug.serving").make_server
server_module = pytest.importorskip("moto.moto_server.werkzeug_app")

TO = "s3://packages/made"


class Store:
    """A server of moto, and what it answers instead."""

    def __init__(self) -> None:
        self.fails: Callable[[dict[str, str]], bool] = lambda _request: False
        self.failed = 0
        self._app = server_module.DomainDispatcherApplication(server_module.create_backend_app)

    def __call__(self, request: dict[str, str], begin: Callable[..., object]) -> object:
        if self.fails(request):
            self.failed += 1
            length = int(request.get("CONTENT_LENGTH") or 0)
            request["wsgi.input"].read(length)
            begin("503 Slow Down", [("Content-Type", "application/xml")])
            return [b"<Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"]
        return self._app(request, begin)


@pytest.fixture(scope="module")
def server() -> Iterator[Store]:
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    app = Store()
    running = make_server("127.0.0.1", 0, app, threaded=True)
    app.url = f"http://127.0.0.1:{running.server_port}"
    threading.Thread(target=running.serve_forever, daemon=True).start()
    yield app
    running.shutdown()


@pytest.fixture
def store(server, monkeypatch) -> Iterator[Store]:
    """An empty store with the buckets scans and packages."""
    named = {"AWS_ENDPOINT_URL": server.url, "AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b"}
    for name, value in {**named, "AWS_DEFAULT_REGION": "us-east-1"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(storage, "_FIRST_WAIT_S", 0.001)
    # What the client tries again by itself would hide what we do.
    monkeypatch.setattr(s3fs.S3FileSystem, "retries", 1)
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    s3fs.S3FileSystem.clear_instance_cache()
    system = s3fs.S3FileSystem()
    for bucket in ("scans", "packages"):
        if system.exists(bucket):
            system.rm(bucket, recursive=True)
        system.mkdir(bucket)
    server.failed = 0
    yield server
    server.fails = lambda _request: False
    s3fs.S3FileSystem.clear_instance_cache()


class Here:
    """An engine of this process."""

    def run(self, tasks):
        yield from map(work, tasks)


WATCHER = SimpleNamespace(begin=lambda _jobs: None, ended=lambda _ended: None)


def run(source: str | Path, out: Path, to: str | None = TO) -> ExitStatus:
    place = Place(out)
    wishes = Wishes(validate=False, retry_failed=False, limits=Limits(60.0, None), to=to)
    return run_batch(find_jobs(source, place, Defaults(), Silent()), place, wishes, Here(), WATCHER)


def upload(folder: Path) -> None:
    s3fs.S3FileSystem().put(f"{folder}/", "scans/in/", recursive=True)


def record_of(out: Path) -> JobRecord:
    (found,) = records(out)
    return JobRecord.model_validate(found)


def unpacked(url: str, folder: Path) -> dict[str, bytes]:
    import zipfile

    folder.mkdir()
    s3fs.S3FileSystem().get_file(url, folder / "a.zip")
    with zipfile.ZipFile(folder / "a.zip") as packed:
        return {name: packed.read(name) for name in packed.namelist()}


def test_scans_of_a_store_become_packages_in_it_with_the_bytes_of_local_builds(store, tmp_path) -> None:
    (file,) = write_scans(tmp_path / "in", 1)
    save_all(stack(5), tmp_path / "in" / "CANARY")
    upload(tmp_path / "in")
    out = tmp_path / "out"
    assert run("s3://scans/in", out) == ExitStatus.OK
    found = [JobRecord.model_validate(each) for each in records(out)]
    assert len(found) == 2
    assert not list(out.rglob("*.volpkg"))
    assert not list((out / ".batch").glob("*.fetched"))
    for text in ("CANARY", "s3:", "scans/"):
        assert text not in (out / "ledger.jsonl").read_text() + (out / "index.html").read_text()
    assert all((out / str(each.preview)).is_file() for each in found)

    (nifti,) = (each for each in found if each.shape_zyx == (12, 11, 13))
    (job,) = find_jobs(file, Place(tmp_path / "other"), Defaults(), Silent())
    scene = job.request.scene.model_copy(update={"name": nifti.name})
    build(replace(job.request, scene=scene), tmp_path / "a.volpkg", Silent())
    assert unpacked(f"{TO}/{nifti.stored}", tmp_path / "zip") == files_of(tmp_path / "a.volpkg")
    assert json.loads((out / "gles3" / f"{nifti.name}.volpkg.origin.json").read_text())["scene"]["source"][
        "path"
    ].startswith("s3://scans/in/")


@pytest.mark.long
def test_what_is_stored_and_unchanged_is_left_out_and_what_changed_or_is_gone_is_made_again(store, tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    upload(tmp_path / "in")
    out, system = tmp_path / "out", s3fs.S3FileSystem()
    run("s3://scans/in", out)
    first = record_of(out)
    run("s3://scans/in", out)
    assert record_of(out) == first
    system.rm(f"{TO}/{first.stored}")
    run("s3://scans/in", out)
    second = record_of(out)
    assert second.ended != first.ended
    system.put_file(str(write_scans(tmp_path / "new", 1, edge=14)[0]), "scans/in/place-0/scan.nii")
    run("s3://scans/in", out)
    assert record_of(out).shape_zyx == (14, 13, 15)


@pytest.mark.long
def test_a_store_that_is_busy_half_of_the_time_gets_all_packages(store, tmp_path) -> None:
    write_scans(tmp_path / "in", 2)
    upload(tmp_path / "in")
    turns = itertools.cycle((True, False, True, True, False, False))
    store.fails = lambda _request: next(turns)
    assert run("s3://scans/in", tmp_path / "out") == ExitStatus.OK
    assert store.failed > 10
    assert [record["outcome"] for record in records(tmp_path / "out")] == ["built"] * 2


@pytest.mark.long
def test_a_store_that_takes_no_package_leaves_none_and_is_named_by_code(store, tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    store.fails = lambda request: ".volpkg.zip" in request["PATH_INFO"]
    assert run(tmp_path / "in", tmp_path / "out") == ExitStatus.OUTPUT
    assert [error.code for error in record_of(tmp_path / "out").errors] == ["VP8051"]
    assert f"{storage._TRIES} times" in record_of(tmp_path / "out").errors[0].summary
    store.fails = lambda _request: False
    assert s3fs.S3FileSystem().find("packages") == []


def test_a_bucket_that_is_not_there_is_refused_before_anything_is_built(store, tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    with pytest.raises(VolprepError, match="VP8051"):
        run(tmp_path / "in", tmp_path / "out", "s3://nobucket/made")
    assert records(tmp_path / "out") == []
    with pytest.raises(VolprepError, match="VP1001"):
        run("s3://nobucket/in", tmp_path / "out")


def test_a_bucket_that_disappears_fails_the_scans_that_are_left(store, tmp_path, monkeypatch) -> None:
    write_scans(tmp_path / "in", 2)
    put = storage.store

    def put_and_remove(file: Path, url: str) -> None:
        put(file, url)
        s3fs.S3FileSystem().rm("packages", recursive=True)

    monkeypatch.setattr("volprep.batch.work.store", put_and_remove)
    assert run(tmp_path / "in", tmp_path / "out") == ExitStatus.OUTPUT
    codes = [[error["code"] for error in record["errors"]] for record in records(tmp_path / "out")]
    assert sorted(codes) == [[], ["VP8051"]]


def test_an_object_that_changes_while_it_is_read_leaves_no_package(store, tmp_path, monkeypatch) -> None:
    (file,) = write_scans(tmp_path / "in", 1)
    upload(tmp_path / "in")

    def build_and_change(*arguments):
        manifest = build(*arguments)
        file.write_bytes(file.read_bytes()[:-1] + b"x")
        upload(tmp_path / "in")
        return manifest

    monkeypatch.setattr("volprep.batch.work.build", build_and_change)
    assert run("s3://scans/in", tmp_path / "out") == ExitStatus.SOURCE
    assert [error.code for error in record_of(tmp_path / "out").errors] == ["VP8023"]
    assert s3fs.S3FileSystem().find("packages") == []


def test_an_object_that_arrives_cut_off_is_fetched_again(store, tmp_path, monkeypatch) -> None:
    (file,) = write_scans(tmp_path / "in", 1)
    upload(tmp_path / "in")
    get, cuts = s3fs.S3FileSystem.get_file, iter((100, 200))

    def cut(self, remote: str, local: str, **options: object) -> None:
        get(self, remote, local, **options)
        size = next(cuts, None)
        if size is not None:
            Path(local).write_bytes(Path(local).read_bytes()[:size])

    monkeypatch.setattr(s3fs.S3FileSystem, "get_file", cut)
    fetched = storage.fetch("s3://scans/in/place-0/scan.nii", tmp_path / "here")
    assert hashlib.sha256(fetched.read_bytes()).digest() == hashlib.sha256(file.read_bytes()).digest()
    assert (tmp_path / "here").stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(("url", "code"), [("https://example.invalid/made", "VP8053"), ("nonsense://made", "VP8053")])
def test_a_target_that_takes_no_whole_objects_is_refused(url, code) -> None:
    with pytest.raises(VolprepError, match=code):
        storage.require_target(url)


def test_an_address_that_no_module_knows_is_named() -> None:
    with pytest.raises(VolprepError, match=r"VP8052 .*nonsense"):
        storage.listed("nonsense://a/b")


def test_a_key_that_leads_out_of_the_folder_is_refused(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(storage, "_opened", lambda _url: (Memory(), "bucket"))
    with pytest.raises(VolprepError, match="VP8050"):
        storage.fetch("memory://bucket", tmp_path / "here")
    assert not (tmp_path / "out").exists()


class Memory:
    def invalidate_cache(self) -> None:
        pass

    def info(self, _path: str) -> dict[str, str]:
        return {"type": "directory"}

    def find(self, path: str, **_: object) -> dict[str, dict[str, int]]:
        return {f"{path}/../../out": {"size": 1}}


def test_a_table_names_scans_of_a_store(tmp_path) -> None:
    (tmp_path / "jobs.csv").write_text("source,name\ns3://scans/in/a.nii,first\n", encoding="utf-8")
    (job,) = find_jobs(tmp_path / "jobs.csv", Place(tmp_path / "out"), Defaults(), Silent())
    assert (job.name, job.url, job.files) == ("first", "s3://scans/in/a.nii", ())
    assert (
        Task(job, Place(tmp_path), "run", validate=False, retry_failed=False, seen=None, limits=Limits(1, None)).to
        is None
    )
