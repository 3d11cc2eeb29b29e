"""Packages of a later minor version: readers ignore what they do not know, and refuse only what they cannot draw."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from command_line import volprep
from repack import Files, files_of, packed, with_digests, with_manifest
from three_readers import READ, Readers

from volprep_formats.package.check import check, data_of_others
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST

Manifest = dict[str, Any]


def with_unknown_keys(value: object) -> object:
    """The same JSON value, with a key that nobody knows in each object."""
    if isinstance(value, dict):
        return {"later": {"than": [1, "this"]}} | {key: with_unknown_keys(inner) for key, inner in value.items()}
    return [with_unknown_keys(inner) for inner in value] if isinstance(value, list) else value


def later(files: Files) -> Files:
    """A package as version 1.7 may write it: new keys, new words in open fields, a new kind of texture and of file."""
    manifest = json.loads(files[MANIFEST])
    manifest["version"] = "1.7"
    manifest["generator"] = "volprep 4.2"
    manifest["extensions_used"] = ["EXT_later"]
    manifest["profile"]["texture_formats"].append("BC7")
    for channel in manifest["channels"]:
        channel["source"]["info"] |= {"format": "later", "unit": "furlong", "repairs": [{"kind": "later", "grade": 3}]}
        for level in channel["levels"]:
            level["filter"] = "later-filter"
    for texture in manifest["textures"]:
        if "normals" in texture:
            texture["normals"]["kernel"] = "later-kernel"
    for mesh in manifest.get("proxy", {}).get("meshes", []):
        mesh["form"] = "later-form"
    manifest["compression"].append(
        {"format": "BC7", "channel": manifest["channels"][0]["name"], "kept": False, "level": 0, "size_bytes": 9}
        | {"basis": "later-basis", "pictures": 1, "psnr_db": 1.0, "rmse": 0.0, "maximum": 0.0}
    )
    texture = next(each for each in manifest["textures"] if each["role"] in {"volume", "slices"})
    manifest["textures"].append(
        texture | {"name": "later", "role": "occlusion", "file": "later/o.ktx3", "format": "rgba64later"}
    )
    manifest["files"] += [{"path": path, "role": role} for path, role in (("later/o.ktx3", "texture"), ("z", "notes"))]
    manifest["files"].sort(key=lambda record: record["path"])
    files = files | {"later/o.ktx3": b"of a later version", "z": b"notes", MANIFEST: json.dumps(manifest).encode()}
    return {
        name: json.dumps(with_unknown_keys(json.loads(data))).encode() if name.endswith(".json") else data
        for name, data in with_digests(files).items()
    }


@pytest.fixture(scope="module")
def written(kinds, tmp_path_factory) -> dict[str, Path]:
    """The package of each kind as a later version."""
    folder = tmp_path_factory.mktemp("later")
    for kind, path in kinds.items():
        (folder / kind).write_bytes(packed(with_digests(later(files_of(path)))))
    return {kind: folder / kind for kind in kinds}


def test_all_readers_open_a_package_of_a_later_minor_version(readers: Readers, written):
    assert readers.all([*written.values()]) == [({READ}, READ, READ)] * len(written)


def test_validate_names_the_later_version_that_it_cannot_prove(written):
    assert [finding.code for finding in check(written["house"])] == ["VP4071"]


def extension(manifest: Manifest) -> None:
    manifest |= {"extensions_required": ["EXT_later"], "programs": "a later form"}


def major(manifest: Manifest) -> None:
    manifest |= {"version": "2.0", "programs": "a later form"}


def closed_word(manifest: Manifest) -> None:
    manifest["programs"][0]["sampling"] = "later-sampling"


@pytest.mark.parametrize(("change", "code"), [(extension, "VP4070"), (major, "VP4003"), (closed_word, "VP4004")])
def test_all_readers_refuse_what_they_cannot_draw_with_one_code(
    readers: Readers, kinds, tmp_path: Path, change: Callable[[Manifest], object], code: str
):
    path = tmp_path / "p.zip"
    path.write_bytes(packed(with_manifest(files_of(kinds["bricks"]), change)))
    assert readers.all([path]) == [({code}, code, code)]


def test_readers_ignore_an_unknown_key_that_validate_reports(readers: Readers, kinds, tmp_path: Path):
    path = tmp_path / "p.zip"
    path.write_bytes(packed(with_manifest(files_of(kinds["bricks"]), lambda manifest: manifest.update(later=1))))
    assert readers.all([path]) == [({READ}, READ, READ)]
    assert [(finding.code, "later" in finding.summary) for finding in check(path)] == [("VP4004", True)]


def test_extras_and_extensions_are_allowed_in_every_object(readers: Readers, kinds, tmp_path: Path):
    def others(value: object) -> object:
        if isinstance(value, dict):
            own = {"extras": [None, {"": 1}], "extensions": {"EXT_later": {"x": "y"}}}
            return own | {key: others(inner) for key, inner in value.items()}
        return [others(inner) for inner in value] if isinstance(value, list) else value

    files = {
        name: json.dumps(others(json.loads(data))).encode() if name.endswith(".json") else data
        for name, data in files_of(kinds["house"]).items()
    }
    path = tmp_path / "p.zip"
    path.write_bytes(packed(with_digests(files)))
    assert readers.all([path]) == [({READ}, READ, READ)]
    assert check(path) == []
    told = data_of_others(Package.open(path))
    assert [text.partition(" holds data of others")[0] for text in told] == ["manifest.json", "subvolumes/grid.json"]
    assert " extras, extensions, channels.0.extras, " in told[0]
    done = volprep("validate", path, "--quick")
    assert (done.returncode, done.stderr.count("warning: ")) == (0, 2), done.stderr
