"""A draft: what a stage adds, what a stage that runs again drops, and how it says no."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.manifest import Heading, StageRecord
from volprep_formats.package.manifest_json import decode_manifest, encode_manifest, read_manifest
from volprep_formats.package.storage.draft import Draft

KEY = "0" * 64


def stage(name: str) -> StageRecord:
    return StageRecord(name=name, key=KEY)


def content(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_what_is_written_counts_from_the_commit_on(new_draft: Draft) -> None:
    new_draft.write("work/a.raw", "work", b"abc")
    assert content(new_draft.folder) - {".stage/lock"} == {"manifest.json", ".stage/files/work/a.raw"}
    assert new_draft.manifest.files == ()
    assert new_draft.read_bytes("work/a.raw") == b"abc"
    new_draft.commit(stage("import"))
    assert content(new_draft.folder) == {"manifest.json", "work/a.raw"}
    again = Draft.open(new_draft.folder)
    assert again.manifest == new_draft.manifest
    assert [(record.path, record.size_bytes) for record in again.manifest.files] == [("work/a.raw", 3)]
    assert again.manifest.stages == (StageRecord(name="import", key=KEY, files=("work/a.raw",)),)


def test_a_file_may_come_in_pieces(new_draft: Draft) -> None:
    numbers = np.arange(6, dtype="<u2")
    new_draft.write("work/a.raw", "work", (piece for piece in (b"ab", memoryview(numbers), b"")))
    new_draft.commit(stage("import"))
    assert new_draft.read_bytes("work/a.raw") == b"ab" + numbers.tobytes()
    assert [finding.code for finding in check(new_draft.folder)] == ["VP4005"]
    assert new_draft.manifest.files[0].size_bytes == 14


def test_what_was_not_committed_is_gone_when_the_draft_is_opened_again(draft: Draft) -> None:
    before = content(draft.folder)
    draft.write("shaders/a.frag", "shader", b"void main() {}")
    assert content(Draft.open(draft.folder).folder) == before
    with pytest.raises(VolprepError, match="VP4012"):
        draft.commit(stage("shaders"))


def test_a_stage_that_runs_again_drops_its_files_and_those_of_the_stages_that_read_it(draft: Draft) -> None:
    draft.write("shaders/a.frag", "shader", b"")
    draft.commit(stage("shaders"))
    draft.write("work/other.raw", "work", b"other")
    draft.commit(stage("import"), draft.manifest.model_copy(update={"name": "again"}), {"shaders", "texture"})
    assert [record.name for record in draft.manifest.stages] == ["import"]
    assert [record.path for record in draft.manifest.files] == ["work/other.raw"]
    assert draft.manifest.textures == ()
    assert draft.manifest.name == "again"
    assert content(draft.folder) == {"manifest.json", "work/other.raw"}
    assert not (draft.folder / "textures").exists()


def test_a_stage_that_runs_again_keeps_what_earlier_stages_did(draft: Draft) -> None:
    draft.write("textures/b.ktx2", "texture", b"")
    draft.commit(stage("texture"))
    assert [record.name for record in draft.manifest.stages] == ["import", "texture"]
    assert content(draft.folder) == {"manifest.json", "work/level0-scan.raw", "textures/b.ktx2"}


def test_a_file_may_take_the_place_of_a_folder(new_draft: Draft) -> None:
    new_draft.write("work/a/b", "work", b"1")
    new_draft.commit(stage("import"))
    new_draft.write("work/a", "work", b"2")
    new_draft.commit(stage("import"))
    assert content(new_draft.folder) == {"manifest.json", "work/a"}


def test_sealing_drops_working_data_and_stage_records(sealed: Path) -> None:
    assert check(sealed) == []
    assert not (sealed / "work").exists()
    with pytest.raises(VolprepError, match="VP4006"):
        Draft.open(sealed)


def test_the_same_stages_write_the_same_bytes(tmp_path: Path, build_package) -> None:
    first, second = build_package(tmp_path / "a"), build_package(tmp_path / "b")
    assert content(first) == content(second)
    for name in content(first):
        assert (first / name).read_bytes() == (second / name).read_bytes()


def test_a_manifest_has_sorted_keys_two_spaces_and_a_newline_and_reads_back_as_itself(sealed: Path) -> None:
    manifest = read_manifest(sealed)
    data = encode_manifest(manifest)
    assert data == (sealed / "manifest.json").read_bytes()
    assert data.startswith(b'{\n  "channels": [\n    {\n      "levels": [\n        {\n          "factors_zyx": [\n')
    assert data.endswith(b"\n}\n")
    assert decode_manifest(data, sealed) == manifest
    assert b"0.7," in data  # a float has the fewest digits that give it back
    assert b"null" not in data


def test_the_manifest_of_a_draft_is_one_line_and_reads_back_as_itself(draft: Draft) -> None:
    data = encode_manifest(draft.manifest)
    assert data == (draft.folder / "manifest.json").read_bytes()
    assert data.index(b"\n") == len(data) - 1
    assert decode_manifest(data, draft.folder) == draft.manifest


@pytest.mark.parametrize("name", ["../a", "/a", "a/../b", "a//b", ".a", "a/.b", "A", "a\\b", "", "a/", "a\n", "a b"])
def test_a_name_that_could_leave_the_package_is_not_written(new_draft: Draft, name: str) -> None:
    with pytest.raises(ValidationError):
        new_draft.write(name, "work", b"")
    assert content(new_draft.folder) == {"manifest.json"}


def test_a_new_draft_takes_no_folder_with_something_in_it(tmp_path: Path, manifest: Heading) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(VolprepError, match="VP4023"):
        Draft.create(tmp_path, manifest)
    assert content(tmp_path) == {"notes.txt"}


def test_opening_says_what_is_wrong_with_a_folder(tmp_path: Path) -> None:
    with pytest.raises(VolprepError, match="VP4001"):
        Draft.open(tmp_path / "none")
    (tmp_path / ".stage").mkdir()
    (tmp_path / ".stage" / "mine").write_text("")
    with pytest.raises(VolprepError, match="VP4002"):
        Draft.open(tmp_path)
    assert content(tmp_path) == {".stage/mine"}


def test_a_draft_cannot_be_made_where_nothing_can_be_written(tmp_path: Path, manifest: Heading) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(VolprepError, match="VP4020") as caught:
        Draft.create(tmp_path / "file" / "draft", manifest)
    assert caught.value.status is ExitStatus.OUTPUT


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_told_and_leaves_the_draft_as_it_was(new_draft: Draft) -> None:
    target = new_draft._new_file("work/a.raw")
    target.symlink_to("/dev/full")
    with pytest.raises(VolprepError, match=r"VP4020 .*work/a.raw: cannot write: No space left on device"):
        new_draft.write("work/a.raw", "work", bytes(100_000))
    assert Draft.open(new_draft.folder).manifest == new_draft.manifest


def test_a_stage_does_not_write_through_a_link(tmp_path: Path, draft: Draft) -> None:
    outside = tmp_path / "outside"
    (draft.folder / "work").rename(outside)
    (draft.folder / "work").symlink_to(outside)
    before = content(outside)
    draft.write("work/new.raw", "work", b"")
    with pytest.raises(VolprepError, match=r"VP4007 .*work/.*: a symbolic link"):
        draft.commit(stage("other"))
    assert content(outside) == before


OTHER_PROCESS = """
import sys
from pathlib import Path
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.storage.draft import Draft
try:
    Draft.open(Path(sys.argv[1]))
except VolprepError as error:
    print(error.code)
"""


@pytest.mark.long
def test_two_processes_cannot_work_on_one_draft(draft: Draft) -> None:
    command = [sys.executable, "-c", OTHER_PROCESS, str(draft.folder)]
    draft.write("work/a.raw", "work", b"")
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() == ["VP4012"]
    draft.commit(stage("other"))
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() == []
