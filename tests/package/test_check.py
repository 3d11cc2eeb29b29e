"""Everything that `validate --quick` can find: a sound package has none of it, and each case below has its own."""

import hashlib
import inspect
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.diagnostics.shown import shown
from volprep_formats.package import picture_rules, rules
from volprep_formats.package.check import Finding, check
from volprep_formats.package.storage.draft import Draft
from volprep_formats.textures import ktx2

Change = Callable[[dict], object]


def edit(package: Path, change: Change) -> None:
    manifest = json.loads((package / "manifest.json").read_text())
    change(manifest)
    (package / "manifest.json").write_text(json.dumps(manifest))


def replace(package: Path, name: str, data: bytes) -> None:
    """Give a file of the package another content, with the size and digest that belong to it."""
    (package / name).write_bytes(data)
    record = {"size_bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    edit(package, lambda manifest: next(f for f in manifest["files"] if f["path"] == name).update(record))


def found(package: Path) -> list[tuple[str, str]]:
    return [(finding.code, finding.summary) for finding in check(package)]


def set_to(*path: str | int, to: object) -> Change:
    def change(manifest: dict) -> None:
        inner = manifest
        for part in path[:-1]:
            inner = inner[part]
        inner[path[-1]] = to

    return change


def drop(*path: str | int) -> Change:
    def change(manifest: dict) -> None:
        inner = manifest
        for part in path[:-1]:
            inner = inner[part]
        del inner[path[-1]]

    return change


def twice(*path: str | int) -> Change:
    def change(manifest: dict) -> None:
        inner = manifest
        for part in path:
            inner = inner[part]
        inner.append(inner[-1])

    return change


def test_a_sound_package_has_no_findings(sealed: Path, sealed_mosaic: Path) -> None:
    assert check(sealed) == []
    assert check(sealed_mosaic) == []


def test_a_draft_is_said_to_be_one(draft: Draft) -> None:
    assert [code for code, _ in found(draft.folder)] == ["VP4005"]


@pytest.mark.parametrize(
    ("data", "code"),
    [(b"{", "VP4002"), (b'{"format": "volpkg", "version": "2.0"}', "VP4003"), (b'{"format": "volpkg"', "VP4002")],
)
def test_a_manifest_that_cannot_be_read_is_the_only_finding(sealed: Path, data: bytes, code: str) -> None:
    (sealed / "manifest.json").write_bytes(data)
    assert [code for code, _ in found(sealed)] == [code]


def test_a_path_that_is_no_package_is_a_finding(tmp_path: Path) -> None:
    assert [code for code, _ in found(tmp_path / "none")] == ["VP4001"]
    assert [code for code, _ in found(tmp_path)] == ["VP4002"]


def test_a_broken_schema_is_a_finding(sealed: Path) -> None:
    edit(sealed, set_to("colour", to=1))
    assert [code for code, _ in found(sealed)] == ["VP4004"]


def test_each_damaged_file_is_a_finding(sealed: Path) -> None:
    (sealed / "preview.png").unlink()
    (sealed / "shaders/raycast.frag").write_bytes(b"too long for its record")
    (sealed / "shaders/screen.vert").write_bytes((sealed / "shaders/screen.vert").read_bytes().upper())
    lines = found(sealed)
    assert [code for code, _ in lines] == ["VP4007", "VP4008", "VP4009"]
    for name, (_, summary) in zip(("preview.png", "raycast.frag", "screen.vert"), lines, strict=True):
        assert str(shown(name)) in summary


def test_a_file_in_place_of_a_folder_is_a_finding(sealed: Path) -> None:
    for path in (sealed / "shaders").iterdir():
        path.unlink()
    (sealed / "shaders").rmdir()
    (sealed / "shaders").write_text("")
    assert [code for code, _ in found(sealed)] == ["VP4010", "VP4007", "VP4007"]


@pytest.mark.parametrize("name", ["notes.txt", "textures/.hidden", "a/b/c", ".stage/lock", "empty/", "a\nb", "link"])
def test_whatever_the_manifest_does_not_name_is_a_finding(sealed: Path, name: str) -> None:
    path = sealed / name
    if name.endswith("/"):
        path.mkdir()
    elif name == "link":
        path.symlink_to(sealed / "shaders")
    else:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine")
    ((code, summary),) = found(sealed)
    assert code == "VP4010"
    assert str(shown(name)) in summary


def test_a_link_in_place_of_a_folder_is_found_and_not_followed(tmp_path: Path, sealed: Path) -> None:
    (sealed / "shaders").rename(tmp_path / "outside")
    (sealed / "shaders").symlink_to(tmp_path / "outside")
    assert [code for code, _ in found(sealed)] == ["VP4010", "VP4007", "VP4007"]


RANGES = {"texture": "gone", "level": 0, "block": 4, "blocks_zyx": [1, 2, 2]}
TABLE = {**RANGES, "transfer": "bone", "kind": "blocks", "empty_share": 0.5}
SEGMENTS = {
    "transfers": ["bone"],
    "segments": [{"name": "lung", "number": 1, "transfer": "bone", "volume_ml": 1.0}],
    "labels": [{"segments": [], "transfer": "bone"}, {"segments": ["nobody"], "transfer": "bone"}],
    "sha256": "0" * 64,
}

CONTRADICTIONS: dict[str, Change] = {
    "texture volume-scan-0 has the format r16unorm, which the profile does not have": set_to(
        "textures", 1, "format", to="r16unorm"
    ),
    "file textures/level1.ktx2 is named 2 times": twice("files"),
    "texture volume-scan-1 is named 2 times": twice("textures"),
    "program raycast is named 2 times": twice("programs"),
    "transfer function bone is named 2 times": twice("channels", 0, "transfer_functions"),
    "the files are not in order of path": lambda manifest: manifest["files"].reverse(),
    "the manifest names itself": lambda manifest: manifest["files"].insert(
        0, {"path": "manifest.json", "role": "preview", "size_bytes": 1, "sha256": "0" * 64}
    ),
    "shaders/other.frag is used as a shader, but is not among the files": set_to(
        "programs", 0, "fragment", to="shaders/other.frag"
    ),
    "preview.png is used as a preview, but has the role texture": set_to("files", 0, "role", to="texture"),
    "picture bone does not draw the levels [0, 1] of each of 2 frames in their order": lambda manifest: manifest.update(
        frames=[{}, {}]
    ),
    "picture bone draws levels [1, 0], which are not levels of its channel in their order": lambda manifest: manifest[
        "pictures"
    ][0]["drawings"].reverse(),
    "picture bone at level 0 names 1 textures for 2 samplers": lambda manifest: manifest["pictures"][0]["drawings"][0][
        "textures"
    ].pop(),
    "texture lookup-bone is 2D, but has 2 slices": set_to("textures", 0, "shape_zyx", 0, to=2),
    "picture bone at level 1 takes samples at no distance": drop("pictures", 0, "drawings", 1, "step_mm"),
    "it is sealed, but has records of stages": set_to("stages", to=[{"name": "import", "key": "0" * 64}]),
    "it is sealed without render": drop("render"),
    "it is sealed without a channel": set_to("channels", to=[]),
    "it is sealed without quantization": drop("channels", 0, "quantization"),
    "it is sealed without stored_type": drop("channels", 0, "stored_type"),
    "it is sealed without levels": set_to("channels", 0, "levels", to=[]),
    "it is sealed without transfer_functions": set_to("channels", 0, "transfer_functions", to=[]),
    "it is sealed without textures": set_to("textures", to=[]),
    "channel scan is named 2 times": twice("channels"),
    "the shape of level 1 does not follow": set_to("channels", 0, "levels", 1, "grid", "shape_zyx", 0, to=2),
    "channel scan has an empty window": set_to("channels", 0, "quantization", "window", to=[1.0, 1.0]),
    "picture bone is named 2 times": twice("pictures"),
    "picture bone has no drawing": set_to("pictures", 0, "drawings", to=[]),
    "picture bone shows bone, which is no transfer function of other": set_to(
        "pictures", 0, "media", 0, "channel", to="other"
    ),
    "picture bone shows skin, which is no transfer function of scan": set_to(
        "pictures", 0, "media", 0, "transfer", to="skin"
    ),
    "picture bone at level 0 names the program other, which is not there": set_to(
        "pictures", 0, "drawings", 0, "program", to="other"
    ),
    "picture bone at level 0 names the program , which is not there": drop("pictures", 0, "drawings", 0, "program"),
    "picture bone at level 0 names the texture gone, which is not there": set_to(
        "pictures", 0, "drawings", 0, "textures", 0, to="gone"
    ),
    "picture bone at level 0 names the program mesh, which is not there": set_to(
        "pictures", 0, "drawings", 0, "at_mesh", to={"program": "mesh", "mesh": "hull"}
    ),
    "picture bone at level 0 begins at the mesh hull, which is not there": set_to(
        "pictures", 0, "drawings", 0, "at_mesh", to={"program": "raycast", "mesh": "hull"}
    ),
    "picture bone has pieces, and the package has no sub-volumes": set_to(
        "pictures", 0, "pieces", to={"program": "raycast", "textures": ["subvolume-7"], "step_mm": 1.0}
    ),
    "picture bone in pieces names the texture subvolume-9, which is not there": set_to(
        "pictures", 0, "pieces", to={"program": "raycast", "textures": ["subvolume-9"], "step_mm": 1.0}
    ),
    "picture bone in pieces names 1 textures for 2 samplers": set_to(
        "pictures", 0, "pieces", to={"program": "raycast", "textures": ["subvolume-7"], "step_mm": 1.0}
    ),
    "skip table gone has no texture of role skip": set_to("skipping", to={"tables": [TABLE]}),
    "ranges of gone has no texture of role ranges": set_to("skipping", to={"ranges": [RANGES]}),
    "skip table volume-scan-0 has no texture of role skip": set_to(
        "skipping", to={"tables": [{**TABLE, "texture": "volume-scan-0"}]}
    ),
    "label 1 is of segments nobody, which are not there": set_to("segments", to=SEGMENTS),
}


@pytest.mark.parametrize("says", CONTRADICTIONS)
def test_a_manifest_that_contradicts_itself_is_found_out(sealed: Path, says: str) -> None:
    edit(sealed, CONTRADICTIONS[says])
    assert [summary for code, summary in found(sealed) if code == "VP4011" and says in summary]


MOSAIC_CONTRADICTIONS: dict[str, Change] = {
    "texture volume-scan-0 has a mosaic that has no room for 5 slices": set_to(
        "textures", 1, "mosaic", "tiles_y", to=1
    ),
    "texture volume-scan-0 has a mosaic that has textures of (14, 36), not (1, 14, 27)": set_to(
        "textures", 1, "mosaic", "texture_shape_yx", to=[14, 36]
    ),
    "texture volume-scan-0 has a mosaic that has tiles that do not fit into textures of (14, 27)": set_to(
        "textures", 1, "mosaic", "tiles_x", to=4
    ),
    "texture volume-scan-0 has a mosaic that has other components than r8unorm": set_to(
        "textures", 1, "mosaic", "slices_per_texel", to=4
    ),
}


@pytest.mark.parametrize("says", MOSAIC_CONTRADICTIONS)
def test_a_mosaic_that_contradicts_its_texture_is_found_out(sealed_mosaic: Path, says: str) -> None:
    edit(sealed_mosaic, MOSAIC_CONTRADICTIONS[says])
    assert [summary for code, summary in found(sealed_mosaic) if code == "VP4011" and says in summary]


def test_every_sentence_on_contradictions_has_a_case() -> None:
    sources = "".join(map(inspect.getsource, (rules, picture_rules)))
    sentences = re.findall(r'(?:yield|yield from \(|append\(|\[)\s*f?"([^"]+ [^"]+)"', sources)
    assert len(sentences) > 20
    cases = "\n".join([*CONTRADICTIONS, *MOSAIC_CONTRADICTIONS])
    for sentence in sentences:
        # The longest run of fixed words of the sentence.
        words = max(re.split(r"\{[^}]*\}", sentence), key=len).strip()
        assert words[:15] in cases, sentence


def test_a_texture_file_that_is_none_is_a_finding(sealed: Path) -> None:
    replace(sealed, "textures/bone.ktx2", b"a picture")
    ((code, summary),) = found(sealed)
    assert code == "VP4030"
    assert "textures/bone.ktx2" in summary


@pytest.mark.parametrize(
    ("shape_zyx", "dimensions", "dtype", "texture_format"),
    [
        ((5, 7, 8), 3, np.uint8, "r8unorm"),
        ((1, 7, 9), 2, np.uint8, "r8unorm"),
        ((5, 7, 9), 3, np.float16, "r16float"),
        ((5, 7, 9), 3, np.uint16, "r16unorm"),
    ],
)
def test_a_texture_file_that_is_not_what_the_manifest_says_is_a_finding(
    sealed: Path, shape_zyx: tuple[int, int, int], dimensions: int, dtype: type, texture_format: ktx2.Ktx2Format
) -> None:
    image = ktx2.Ktx2Image(texture_format, shape_zyx, np.zeros(shape_zyx, dtype), dimensions)
    replace(sealed, "textures/level0.ktx2", b"".join(ktx2.encode(image)))
    ((code, summary),) = found(sealed)
    assert code == "VP4011"
    assert "textures/level0.ktx2 holds" in summary


def test_a_shader_that_is_no_text_is_a_finding(sealed: Path) -> None:
    replace(sealed, "shaders/raycast.frag", b"\xff")
    assert [code for code, _ in found(sealed)] == ["VP4011"]


def test_a_finding_says_what_the_error_says(sealed: Path) -> None:
    error = VolprepError("VP4009", path=sealed, file="a")
    assert f"{error.code} {error.summary}. {error.remedy}" == str(error)
    assert Finding.of(error) == Finding(code="VP4009", summary=error.summary, remedy=error.remedy)
