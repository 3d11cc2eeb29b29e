"""What is built: the scans of a tree or a table, under names that say nothing of a person."""

import os
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import tifffile
from batch_scans import write_scans
from dicom_files import save_all, stack
from phantom_scene import write_phantom_scene

from volprep.batch import endings, store_tree
from volprep.batch.jobs import Defaults, Job, in_shard
from volprep.batch.other_files import OtherFiles
from volprep.batch.place import Place
from volprep.batch.run import find_jobs, find_scans
from volprep.batch.stamp import stamp_of
from volprep.batch.table import scans_in_table
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent


def jobs(path: Path, folder: Path, scene: Path | None = None, profiles: tuple[str, ...] = ()) -> list[Job]:
    return find_jobs(path, Place(folder), Defaults(scene, profiles), Silent())


def table(folder: Path, text: str, name: str = "jobs.csv") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Two series in one folder, a NIfTI file, a damaged DICOM file, and what is no scan."""
    folder = tmp_path / "tree"
    write_scans(folder, 1)
    for number in (1, 2):
        series = stack(5)
        for image in series:
            image.SeriesInstanceUID = f"1.2.3.{number}"
            image.PatientName = "CANARY^JANE"
        save_all(series, folder / f"CANARY {number}")
    (folder / "CANARY.dcm").write_bytes((folder / "CANARY 1" / "I000").read_bytes()[:300])
    (folder / "letter.txt").write_text("CANARY", encoding="utf-8")
    return folder


def test_each_series_and_each_other_scan_of_a_tree_is_a_job(tree, tmp_path) -> None:
    found = {job.shown_source.removeprefix(f"{tree}/"): job for job in jobs(tree, tmp_path / "out")}
    assert set(found) == {"CANARY 1", "CANARY 2", "CANARY.dcm", "place-0/scan.nii"}
    assert found["CANARY 1"].request.scene.source.series == "1.2.3.1"
    assert len(found["CANARY 1"].files) == 5


def test_files_that_are_no_scans_are_counted_and_no_name_is_said(tree) -> None:
    (tree / "a.raw").write_bytes(bytes(60))
    header = "NDims = 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\nElementDataFile = a.raw\n"
    (tree / "a.mhd").write_text(header, encoding="ascii")
    (tree / "gifs").mkdir()
    for name in ("gifs/1.gif", "gifs/2.GIF", "CANARY.JANE", "scans.zip", "lung.gipl", ".hidden"):
        (tree / name).write_bytes(b"GIF89a")
    others: list[OtherFiles] = []
    find_scans(tree, Silent(), has_scene=False, rules=None, facts=False, others=others.append)
    (found,) = others
    assert str(found) == "6 files are no scans and are left out: 2 .gif, 1 .gipl, 1 .txt, 1 .zip, 1 with other endings"
    assert found.count == 6, "CANARY.JANE counts, though its ending may be a name"


# A folder with one picture is a stack, so that its job is the folder.
@pytest.mark.parametrize("ending", sorted({*endings.ALONE, *endings.NOT_READ} - {".ome.tif", ".ome.tiff"}))
def test_a_name_of_a_scan_is_a_job_in_a_tree_and_in_a_store(ending: str, tmp_path, monkeypatch) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / f"empty{ending}").touch()
    (job,) = jobs(tmp_path / "in", tmp_path / "out")
    assert job.shown_source.endswith(f"empty{ending}")
    monkeypatch.setattr(store_tree, "listed", lambda _url: {f"a/empty{ending}": {}, "a/letter.txt": {}})
    assert [scan.url for scan in store_tree.scans_in_store("s3://bucket")] == [f"s3://bucket/a/empty{ending}"]


BROKEN = {
    "empty.nii.gz": b"",
    "cut.nii": b"\x5c\x01\0\0" + bytes(100),
    "random.nii": b"no header at all" * 30,
    "magic.nii": b"\x5c\x01\0\0" + bytes(340) + b"xx1\0" + bytes(90),
    "garbage.nrrd": b"\xff\xfe" * 99,
    "empty.mha": b"",
    "empty.dcm": b"",
}


def test_what_has_the_name_of_a_scan_is_a_job_also_if_it_is_broken(tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    for name, data in BROKEN.items():
        (tmp_path / "in" / name).write_bytes(data)
    (tmp_path / "in" / "store.zarr").mkdir()
    (tmp_path / "in" / "letter.txt").write_text("no scan", encoding="utf-8")
    found = {job.shown_source.removeprefix(f"{tmp_path}/in/") for job in jobs(tmp_path / "in", tmp_path / "out")}
    assert found == {"place-0/scan.nii", "store.zarr", *BROKEN}


def test_a_header_and_its_voxels_are_one_job(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    nib.save(nib.Nifti1Pair(np.zeros((3, 4, 5), np.int16), np.eye(4)), tmp_path / "in/a.img")
    assert [job.shown_source for job in jobs(tmp_path / "in", tmp_path / "out")] == [str(tmp_path / "in/a.hdr")]


def test_a_stack_that_begins_with_a_link_to_a_missing_picture_is_a_job(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    for name in ("1.tif", "2.tif"):
        tifffile.imwrite(tmp_path / "in" / name, np.zeros((3, 4), np.uint8))
    (tmp_path / "in/0.tif").symlink_to(tmp_path / "gone")
    assert len(jobs(tmp_path / "in", tmp_path / "out")) == 1


def test_linked_folders_are_followed_once_and_loops_end(tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    write_scans(tmp_path / "elsewhere", 1)
    save_all(stack(5), tmp_path / "elsewhere" / "series")
    (tmp_path / "in" / "subject").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "in" / "again").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere" / "loop").symlink_to(tmp_path / "in")
    (tmp_path / "in" / "nowhere").symlink_to(tmp_path / "missing")
    found = {job.shown_source.removeprefix(f"{tmp_path}/in/") for job in jobs(tmp_path / "in", tmp_path / "out")}
    assert found == {"place-0/scan.nii", "again/place-0/scan.nii", "again/series"}


def test_pages_make_a_volume_of_a_picture_and_pictures_a_volume_of_a_folder(tmp_path) -> None:
    pages = np.zeros((4, 6, 5), np.uint8)
    for folder, stacked in (("stack", False), ("volumes", True), ("beside", True)):
        (tmp_path / "in" / folder).mkdir(parents=True)
        for number in range(2):
            data = pages if stacked else pages[0]
            tifffile.imwrite(tmp_path / "in" / folder / f"{number}.tif", data, photometric="minisblack")
    tifffile.imwrite(tmp_path / "in" / "beside" / "photograph.tif", pages[0], photometric="minisblack")
    (tmp_path / "in" / "beside" / "letter.txt").write_text("no scan", encoding="utf-8")
    found = {job.shown_source.removeprefix(f"{tmp_path}/in/") for job in jobs(tmp_path / "in", tmp_path / "out")}
    assert found == {"stack", "volumes/0.tif", "volumes/1.tif", "beside/0.tif", "beside/1.tif"}


def test_names_of_a_tree_are_the_same_in_each_run_and_others_in_another_folder(tree, tmp_path) -> None:
    first, again, other = ([job.name for job in jobs(tree, tmp_path / to)] for to in ("a", "a", "b"))
    assert first == again
    assert not set(first) & set(other)
    assert not any("canary" in name.lower() for name in first)
    assert (tmp_path / "a" / ".batch" / "key").stat().st_mode & 0o077 == 0


def test_a_scan_keeps_its_name_when_others_come_and_go(tree, tmp_path) -> None:
    before = {job.shown_source: job.name for job in jobs(tree, tmp_path / "out")}
    (tree / "CANARY.dcm").unlink()
    write_scans(tree / "more", 2)
    after = {job.shown_source: job.name for job in jobs(tree, tmp_path / "out")}
    kept = set(before) & set(after)
    assert len(kept) == 3
    assert {path: before[path] for path in kept} == {path: after[path] for path in kept}


def test_the_packages_of_a_batch_inside_its_own_tree_are_no_scans(tree) -> None:
    first = {job.name for job in jobs(tree, tree / "out")}
    package = tree / "out" / "gles3" / "a.volpkg"
    package.mkdir(parents=True)
    (package / "manifest.json").write_text("{}", encoding="ascii")
    (tree / "out" / "scan.nii").write_bytes((tree / "place-0" / "scan.nii").read_bytes())
    assert {job.name for job in jobs(tree, tree / "out")} == first


def test_a_tree_without_a_scan_is_refused(tmp_path) -> None:
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters" / "a.txt").write_text("a", encoding="utf-8")
    with pytest.raises(VolprepError, match=r"VP8006 .*1 files"):
        jobs(tmp_path / "letters", tmp_path / "out")
    with pytest.raises(VolprepError, match="VP1001"):
        jobs(tmp_path / "nowhere", tmp_path / "out")


@pytest.mark.parametrize("name", ["jobs.csv", "jobs.jsonl"])
def test_a_pipe_is_no_table_and_is_not_waited_for(tmp_path, name) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(VolprepError, match="pipe") as refused:
        scans_in_table(tmp_path / name, has_scene=True)
    assert refused.value.code == "VP8001"


def test_a_table_says_source_scene_profiles_and_name_of_each_scan(tmp_path) -> None:
    write_scans(tmp_path / "in", 2)
    write_phantom_scene(tmp_path)
    text = (
        "source,scene,profiles,name\n"
        "in/place-0/scan.nii,,gles3 gles2-2048,first\n"
        ",phantom.toml,,second\n"
        "in/place-1/scan.nii,,,\n"
    )
    found = jobs(table(tmp_path, text), tmp_path / "out")
    assert [(job.name, job.profile) for job in found[:3]] == [
        ("first", "gles3"),
        ("first", "gles2-2048"),
        ("second", "gles3"),
    ]
    assert found[2].request.scene.transfer[0].name == "shell"
    assert found[2].files == (tmp_path / "phantom.raw",)
    assert found[3].name.startswith("scan-")
    assert [job.request.scene.name for job in found] == [job.name for job in found]


def test_a_profile_whose_name_leads_elsewhere_is_refused(tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    profile = files("volprep.scene") / "profiles" / "gles3.toml"
    text = profile.read_text(encoding="utf-8").replace('"gles3"', '"../../elsewhere"', 1)
    (tmp_path / "far.toml").write_text(text, encoding="utf-8")
    with pytest.raises(VolprepError, match="VP8007"):
        jobs(tmp_path / "in", tmp_path / "out", profiles=(str(tmp_path / "far.toml"),))


def test_json_lines_say_the_same_as_csv(tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    line = '{"source": "in/place-0/scan.nii", "profiles": ["gles3", "gles2-2048"], "name": "first", "volume": 1}\n'
    found = jobs(table(tmp_path, f"\n{line}", "jobs.jsonl"), tmp_path / "out")
    assert [(job.name, job.profile) for job in found] == [("first", "gles3"), ("first", "gles2-2048")]
    assert found[0].request.scene.source.volume == 1


SCAN = "in/place-0/scan.nii"


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("jobs.csv", f"source,colour\n{SCAN},red\n", "VP8002 .*line 2: unknown column colour"),
        ("jobs.csv", f"source,name\n{SCAN},a,b\n", "VP8002 .*line 2: unknown column cells without a heading"),
        ("jobs.csv", f"source,name\n{SCAN},a\nnowhere.nii,b\n", "VP8004 .*line 3: .*nowhere.nii does not exist"),
        ("jobs.csv", f"source,scene\n{SCAN},no.toml\n", "VP8004 .*line 2: .*no.toml does not exist"),
        ("jobs.csv", f"source,name\n{SCAN},a\n{SCAN},b\n{SCAN},a\n", "VP8005 .*line 2 and line 4 .*name a "),
        ("jobs.csv", f"source\n{SCAN}\n{SCAN}\n", "VP8005 .*line 2 and line 3"),
        ("jobs.csv", f"source,name\n{SCAN},../../etc\n", "VP8003 .*line 2: name"),
        ("jobs.csv", f"source,volume\n{SCAN},0\n", "VP8003 .*line 2: volume"),
        ("jobs.csv", "source,name\n,a\n", "VP8003 .*line 2: neither source nor scene"),
        ("jobs.csv", "source,name\n", "VP8001 .*no lines"),
        ("jobs.csv", f"source,name\n{SCAN},a\0\n", "VP800[13] "),
        ("jobs.jsonl", '{"source": 1}\n', "VP8003 .*line 1: source"),
        ("jobs.jsonl", "[]\n", "VP8003 .*line 1: not a JSON object"),
        ("jobs.jsonl", "\n{\n", "VP8003 .*line 2: not JSON"),
    ],
)
def test_a_wrong_table_is_refused_with_the_line(tmp_path, name, text, said) -> None:
    write_scans(tmp_path / "in", 1)
    with pytest.raises(VolprepError, match=said):
        jobs(table(tmp_path, text, name), tmp_path / "out")


def test_a_table_that_is_not_there_or_no_text_is_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP8001"):
        jobs(tmp_path / "nowhere.csv", tmp_path / "out")
    (tmp_path / "bytes.csv").write_bytes(b"source\n\xff\xfe\n")
    with pytest.raises(VolprepError, match="VP8001"):
        jobs(tmp_path / "bytes.csv", tmp_path / "out")


def test_parts_of_a_job_array_are_all_jobs_and_no_job_twice() -> None:
    names = [f"scan-{number}" for number in range(200)]
    parts = [{name for name in names if in_shard(name, number, 7)} for number in range(1, 8)]
    assert sum(len(part) for part in parts) == 200
    assert set().union(*parts) == set(names)
    assert all(15 <= len(part) <= 45 for part in parts)


def test_a_scan_that_is_written_in_place_counts_as_changed_though_its_time_is_set_back(tmp_path) -> None:
    (file,) = write_scans(tmp_path / "in", 1)
    (job,) = jobs(file, tmp_path / "out")
    before, times = stamp_of(job, b"key"), file.stat()
    assert stamp_of(job, b"key") == before
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert file.stat().st_mtime_ns == times.st_mtime_ns
    assert stamp_of(job, b"key") != before


def test_voxels_beside_their_header_count_as_the_scan(tmp_path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "a.raw").write_bytes(bytes(60))
    header = "NDims = 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\nElementDataFile = a.raw\n"
    (folder / "a.mhd").write_text(header, encoding="ascii")
    (job,) = jobs(folder, tmp_path / "out")
    before = stamp_of(job, b"key")
    (folder / "a.raw").write_bytes(bytes(59) + b"1")
    assert stamp_of(job, b"key") != before


def test_another_series_of_the_same_folder_is_another_scan(tree, tmp_path) -> None:
    job = next(each for each in jobs(tree, tmp_path / "out") if each.request.scene.source.series)
    other = replace(job, request=job.request.with_source(series="1.2.3.9"))
    assert stamp_of(job, b"key") != stamp_of(other, b"key")
