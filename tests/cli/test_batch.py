"""volprep batch as a person runs it: what it prints, its status, its pages, and what it never tells."""

import json
import re
import shutil
from pathlib import Path

import pytest
from batch_scans import records, write_scans
from command_line import volprep
from dicom_files import save_all, stack
from phantom_scene import write_phantom_scene

from volprep.batch.page import page
from volprep.batch.records import JobRecord

CANARY = "CANARY^JANE"
ALONE = ("--shard", "1/1")


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder whose names and texts are canaries: a good series, a damaged file of DICOM, a damaged NIfTI file."""
    folder = tmp_path_factory.mktemp("place")
    series = stack(6, shape_yx=(12, 13))
    for image in series:
        image.PatientName = image.SeriesDescription = CANARY
        image.PatientID = CANARY
    save_all(series, folder / "in" / CANARY)
    gaps = stack(6, shape_yx=(12, 13))
    for image in gaps:
        image.SeriesInstanceUID = "1.2.3.777"
        image.PatientName = CANARY
        image.Modality = "CANARY_JANE"
    save_all(gaps[:2] + gaps[3:], folder / "in" / f"{CANARY} with a gap")
    (folder / "in" / f"{CANARY}.dcm").write_bytes((folder / "in" / CANARY / "I000").read_bytes()[:300])
    (file,) = write_scans(folder / "in", 1)
    file.rename(folder / "in" / f"{CANARY}.nii")
    (folder / "in" / f"{CANARY} cut.nii").write_bytes((folder / "in" / f"{CANARY}.nii").read_bytes()[:600])
    (folder / "in" / "letter.txt").write_text(CANARY, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def done(place):
    return volprep("batch", "in", "-o", "out", *ALONE, cwd=place)


def test_damaged_scans_stop_no_other_and_give_the_status(place, done) -> None:
    assert done.returncode == 3
    found = records(place / "out")
    assert sorted(record["outcome"] for record in found) == ["built", "built", "failed", "failed", "failed"]
    codes = {error["code"] for record in found for error in record["errors"]}
    assert len(codes) == 3
    assert len(done.stdout.splitlines()) == 7
    assert done.stdout.splitlines()[-2] == "1 file is no scan and is left out: 1 .txt"
    assert done.stdout.splitlines()[-1].startswith("2 built, 0 unchanged, 3 failed; ")
    for record in found:
        assert re.search(f"^{record['name']} gles3: (built|failed: VP).* \\([1-5] of 5\\)$", done.stdout, re.MULTILINE)


def test_failures_of_an_earlier_run_are_told_with_what_to_do(place, done) -> None:
    assert "--explain" in done.stderr
    assert "--retry-failed" not in done.stderr
    again = volprep("batch", "in", "-o", "out", *ALONE, cwd=place)
    assert again.stdout.splitlines()[-1].startswith("0 built, 2 unchanged, 3 failed; ")
    assert "note: 3 that failed before were not tried again; --retry-failed tries them" in again.stderr
    assert "--explain" in again.stderr


def test_nothing_of_a_person_is_in_names_ledger_pages_packages_or_what_is_printed(place, done) -> None:
    words = re.compile("canary|jane|1\\.2\\.826|1\\.2\\.3\\.777", re.IGNORECASE)
    assert not words.search(done.stdout + done.stderr)
    # The origin beside a package says where the scan is, as the map of names does: neither is passed on.
    own = (".origin.json", ".batch/names.jsonl")
    files = [file for file in (place / "out").rglob("*") if not str(file).endswith(own)]
    assert {file.name for file in files} >= {"ledger.jsonl", "index.html", "index.json", "manifest.json"}
    for file in files:
        assert not words.search(str(file.relative_to(place)))
        if file.is_file():
            assert not words.search(file.read_bytes().decode("latin-1"))


@pytest.mark.long
def test_unchanged_scans_are_left_out_and_changed_ones_are_built_again(place, done, tmp_path) -> None:
    folder = tmp_path / "copy"
    folder.mkdir()
    files = write_scans(folder / "in", 2)
    assert volprep("batch", "in", "-o", "out", *ALONE, cwd=folder).returncode == 0
    first = (folder / "out" / "ledger.jsonl").read_bytes()
    again = volprep("batch", "in", "-o", "out", cwd=folder)
    assert again.stdout.startswith("0 built, 2 unchanged, 0 failed; ")
    assert (folder / "out" / "ledger.jsonl").read_bytes() == first

    content = bytearray(files[0].read_bytes())
    content[-1] ^= 1
    files[0].write_bytes(content)
    changed = volprep("batch", "in", "-o", "out", *ALONE, cwd=folder)
    assert "1 built, 1 unchanged, 0 failed" in changed.stdout
    shutil.rmtree(next((folder / "out").glob("gles3/*.volpkg")))
    lost = volprep("batch", "in", "-o", "out", *ALONE, cwd=folder)
    assert "1 built, 1 unchanged, 0 failed" in lost.stdout
    assert len(records(folder / "out")) == 2


@pytest.mark.long
def test_a_dry_run_lists_jobs_with_their_places_and_builds_nothing(place, tmp_path) -> None:
    listed = volprep("batch", "in", "-o", tmp_path / "dry", "--dry-run", cwd=place)
    assert listed.returncode == 0
    assert listed.stdout.count(CANARY) == 5
    assert "(series without a number, 6 files)" in listed.stdout
    as_json = volprep("batch", "in", "-o", tmp_path / "dry", "--dry-run", "--json", cwd=place)
    jobs = json.loads(as_json.stdout)["jobs"]
    assert {job["name"] for job in jobs} == set(re.findall("scan-[0-9a-f]{16}", listed.stdout))
    assert not (tmp_path / "dry" / "ledger.jsonl").exists()


def test_json_lines_hold_each_record_and_a_summary(place, done) -> None:
    said = volprep("batch", "in", "-o", "out", "--json", cwd=place)
    assert said.returncode == 3
    *jobs, last = (json.loads(line) for line in said.stdout.splitlines())
    assert [job["record"] for job in jobs if job["new"]] == []
    assert sorted(job["record"]["name"] for job in jobs) == sorted(record["name"] for record in records(place / "out"))
    assert last["summary"] | {"seconds": 0} == {
        "built": 0,
        "unchanged": 2,
        "failed": 3,
        "elsewhere": 0,
        "seconds": 0,
        "status": 3,
        "no_scans": {"files": 1, "endings": {".txt": 1}},
    }


@pytest.mark.long
def test_a_validated_batch_links_reports_and_tells_what_is_beyond_its_tolerance(tmp_path) -> None:
    write_phantom_scene(tmp_path)
    text = (tmp_path / "phantom.toml").read_text(encoding="utf-8")
    text = text.replace("[pyramid]", "[render]\npicture_size = 16\n[pyramid]")
    strict = "[tolerance]\nrmse = 0.0\nmaximum = 0.0\n"
    (tmp_path / "good.toml").write_text(
        f"{text}\n[tolerance]\nrmse = 1.0\nmaximum = 1.0\nflip = 1.0\n", encoding="utf-8"
    )
    (tmp_path / "strict.toml").write_text(f"{text}\n{strict}", encoding="utf-8")
    (tmp_path / "jobs.csv").write_text("scene,name\ngood.toml,good\nstrict.toml,strict\n", encoding="utf-8")
    assert volprep("batch", "jobs.csv", "-o", "out", *ALONE, cwd=tmp_path).returncode == 0
    made = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("gles3/*.volpkg/manifest.json")}
    said = volprep("batch", "jobs.csv", "-o", "out", "--validate", *ALONE, cwd=tmp_path)
    assert said.returncode == 1
    # Only what was missing has been done.
    assert {path: path.stat().st_mtime_ns for path in made} == made
    assert {record["name"]: record["verdict"] for record in records(tmp_path / "out")} == {
        "good": "within",
        "strict": "beyond",
    }
    shown = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    for link in re.findall('(?:href|src)="([^"#][^"]*)"', shown):
        assert link.startswith("data:") or (tmp_path / "out" / link).is_file()
    assert shown.count("/index.html") == 2
    assert "http" not in shown.replace("http-equiv", "")


def test_text_in_a_page_is_escaped() -> None:
    digest = "0" * 64
    fields = {"source_stamp": digest, "scene_sha256": digest, "version": "1", "ended": "now", "profile": "<b>&"}
    error = {"code": "VP1003", "summary": "<script>alert(1)</script>", "remedy": "<i>"}
    failed = JobRecord.model_validate({"name": "<a>", "outcome": "failed", "errors": [error], **fields})
    made = {"outcome": "built", "shape_zyx": [1, 2, 3], "preview": '"><script>', **fields}
    text = page([failed, JobRecord.model_validate({"name": "<a>", **made})])
    before, ours, after = re.split(r"<script>|</script>", text)
    assert ours.startswith("// Filters and sorts")
    assert "<a>" not in ours
    assert not re.search("<script|<a>|<i>|<b>&", before + after)
    assert "&lt;script&gt;alert(1)" in text


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("nowhere", "-o", "out"), 3, "VP1001"),
        (("in", "-o", "out", "--shard", "0/3"), 2, "--shard is 0/3"),
        (("in", "-o", "out", "--shard", "4/3"), 2, "--shard is 4/3"),
        (("in", "-o", "out", "--workers", "2", "--scheduler", "tcp://a:1"), 2, "give one of them"),
        (("in", "-o", "out", "--profile", "toaster"), 4, "VP3010"),
        (("in", "-o", "out", "--scene", "nowhere.toml"), 4, "VP3001"),
        (("in", "-o", "in/letter.txt"), 6, "VP4020"),
    ],
)
def test_a_wrong_command_builds_nothing(place, arguments, status, said) -> None:
    result = volprep("batch", *arguments, cwd=place)
    assert result.returncode == status
    assert said in result.stderr
    assert "Traceback" not in result.stderr


def test_a_folder_that_disappears_ends_the_batch_with_a_code(tmp_path) -> None:
    write_scans(tmp_path / "in", 1)
    (tmp_path / "out" / ".batch").mkdir(parents=True)
    (tmp_path / "out" / "ledger.jsonl").mkdir()
    result = volprep("batch", "in", "-o", "out", *ALONE, cwd=tmp_path)
    assert result.returncode == 6
    assert "VP4020" in result.stderr


@pytest.mark.long
def test_parts_of_a_job_array_build_all_scans_once(tmp_path) -> None:
    write_scans(tmp_path / "in", 4)
    for part in ("1/2", "2/2"):
        assert volprep("batch", "in", "-o", "out", "--shard", part, cwd=tmp_path).returncode == 0
    assert len(records(tmp_path / "out")) == 4
    assert len(json.loads((tmp_path / "out" / "index.json").read_text(encoding="ascii"))["jobs"]) == 4
    left = {path.name for path in (tmp_path / "out" / ".batch").iterdir()}
    assert left == {"key", "ledger.lock", "names.jsonl"}
