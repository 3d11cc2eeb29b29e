"""What compares a package with what follows from the scan: file by file as it is made, and field by field."""

import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import pytest
from tamper_scenes import write_kind
from tampering import Damaged, built, told

from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import begin_draft
from volprep.pipeline.origin import origin_path
from volprep.scene.request import load_request
from volprep.scene.scene import changed
from volprep.validation.exact.draft import ComparingDraft, FileDifference
from volprep.validation.exact.manifests import manifest_differences
from volprep_formats.package.manifest import FileRecord, Manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Silent

MEBI = 2**20


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fitted")
    return built(folder, write_kind(folder, "fitted"))


@pytest.fixture
def draft(package, tmp_path) -> ComparingDraft:
    """A draft that compares with a package of one file of 48 MiB, byte k being k // 2^20."""
    manifest = Package.open(package).manifest
    size = 48 * MEBI
    (tmp_path / "held").mkdir()
    with (tmp_path / "held" / "large.ktx2").open("wb") as file:
        file.writelines(chunks())
    record = FileRecord(path="large.ktx2", role="texture", size_bytes=size, sha256="0" * 64)
    held = Package(tmp_path / "held", manifest.model_copy(update={"files": (record,)}))
    Draft.create(tmp_path / "draft", manifest)
    return ComparingDraft(tmp_path / "draft", Draft.open(tmp_path / "draft").manifest, held)


def chunks(count: int = 48, changed: int | None = None) -> Iterator[bytes]:
    for number in range(count):
        chunk = bytearray([number]) * MEBI
        if number == changed:
            chunk[7] ^= 1
        yield bytes(chunk)


def test_a_large_file_is_compared_without_being_held_or_stored(draft) -> None:
    tracemalloc.start()
    record = draft.write("large.ktx2", "texture", chunks())
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (draft.differences, record.size_bytes) == ({}, 48 * MEBI)
    assert peak < 24 * MEBI, "16 MiB are kept, in case that it is a small file"
    assert sum(path.stat().st_size for path in draft.folder.rglob("*") if path.is_file()) < MEBI


@pytest.mark.parametrize(
    ("made", "difference"),
    [
        (chunks(changed=30), FileDifference(48 * MEBI, 30 * MEBI + 7, 1)),
        (chunks(47), FileDifference(47 * MEBI, 47 * MEBI, MEBI)),
        (chunks(49), FileDifference(49 * MEBI, 48 * MEBI, MEBI)),
        (b"", FileDifference(0, 0, 48 * MEBI)),
    ],
    ids=["one byte", "too long", "too short", "nothing"],
)
def test_the_first_byte_and_the_number_of_bytes_that_differ_are_told(draft, made, difference) -> None:
    draft.write("large.ktx2", "texture", made)
    assert draft.differences == {"large.ktx2": difference}


def test_a_file_that_the_package_does_not_have_is_told(draft) -> None:
    draft.write("other.ktx2", "texture", b"12345")
    assert draft.differences == {"other.ktx2": FileDifference(5, None, 5)}


def test_working_data_is_written_and_compared_with_nothing(draft) -> None:
    draft.write("work/codes.raw", "work", b"12345")
    assert draft.differences == draft.compared == {}
    assert draft.read_bytes("work/codes.raw") == b"12345"


def test_numbers_that_machines_round_otherwise_are_the_same_and_others_are_named(package, tmp_path) -> None:
    derived = Package.open(package).manifest
    damaged = Damaged(package, tmp_path).manifest
    drawing = damaged["pictures"][0]["drawings"][0]
    drawing["step_mm"] *= 1 + 1e-12
    assert manifest_differences(manifest_of(damaged), derived) == []
    drawing["step_mm"] *= 1 + 1e-6
    (told,) = manifest_differences(manifest_of(damaged), derived)
    assert told.startswith("pictures[shell].drawings[0].step_mm is ")


def test_a_missing_entry_of_a_list_is_told(package, tmp_path) -> None:
    damaged = Damaged(package, tmp_path).manifest
    damaged["textures"].pop()
    derived = Package.open(package).manifest
    count = len(derived.textures)
    assert manifest_differences(manifest_of(damaged), derived) == [
        f"textures has {count - 1} entries, {count} follow from the scene"
    ]


@pytest.mark.long
def test_a_draft_that_verbs_have_changed_and_sealed_is_judged_by_what_they_were_told(tmp_path) -> None:
    folder = tmp_path / "tried.volpkg"
    begin_draft(load_request(write_kind(tmp_path, "fitted")), folder, Silent())
    sealed = run_verb(folder, "quantize", lambda scene: changed(scene, "quantize", bits=16), Silent())
    for verb in ("pyramid", "transfer", "texture", "shaders", "seal"):
        sealed = run_verb(folder, verb, lambda scene: scene, Silent())
    assert sealed.manifest.quantization.bits == 16
    assert told(folder) == ""


def manifest_of(record: dict) -> Manifest:
    return Manifest.model_validate(record)


def test_metadata_of_a_fitted_table_is_compared(package, tmp_path) -> None:
    damaged = Damaged(package, tmp_path)
    file = next(each["file"] for each in damaged.manifest["textures"] if each["role"] == "transfer" and "level" in each)
    damaged.put(file, bytes(damaged.data(file)).replace(b"KTXorientation\0rd", b"KTXorientation\0ru"))
    assert file in told(damaged.save())


@pytest.mark.parametrize(
    ("key", "value"), [("max_texture_bytes", 2**40), ("name", "gles2-4096"), ("texture_units", 99), ("square", True)]
)
def test_without_an_origin_the_profile_comes_from_the_scene(package, tmp_path, key, value) -> None:
    damaged = Damaged(package, tmp_path)
    origin_path(damaged.path).unlink()
    damaged.manifest["profile"][key] = value
    scene = package.parent / "tried.toml"
    assert f"profile.{key} is {value}" in told(damaged.save(), scene)
