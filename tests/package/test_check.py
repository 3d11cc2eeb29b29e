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
from volprep_formats.package import rules as agreement
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


def segments_of_labels(manifest: dict) -> None:
    for texture in manifest["textures"]:
        texture["filter"] = "nearest" if texture["role"] == "volume" else "linear"
    manifest["programs"][0]["classification"] = "preintegrated"


def another_table_of_level_0(manifest: dict) -> None:
    """Give level 0 a table of its own, with another scale than the common one."""
    table = next(texture for texture in manifest["textures"] if texture["role"] == "transfer")
    scale = 2 * table["max_extinction_per_mm"]
    manifest["textures"].append({**table, "name": "lookup-own", "level": 0, "max_extinction_per_mm": scale})


def both(*changes: Change) -> Change:
    def change(manifest: dict) -> None:
        for each in changes:
            each(manifest)

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


KEPT = {"channel": "scan", "kept": True, "basis": "level", "level": 0, "size_bytes": 1, "pictures": 9, "psnr_db": 40.0}

CONTRADICTIONS: dict[str, Change] = {
    "level 0 is said to be compressed as eac-r11unorm, but its textures are not": lambda manifest: manifest.update(
        compression=[{"format": "eac-r11unorm", "rmse": 0.1, "maximum": 0.1, **KEPT}]
    ),
    "texture volume-scan-0 has the format r16unorm, which the profile does not have": set_to(
        "textures", 1, "format", to="r16unorm"
    ),
    "file textures/level1.ktx2 is named 2 times": twice("files"),
    "texture volume-scan-1 is named 2 times": twice("textures"),
    "program raycast is named 2 times": twice("programs"),
    "transfer function bone is named 2 times": twice("channels", 0, "transfer_functions"),
    "plan item everything is named 2 times": twice("plan"),
    "the files are not in order of path": lambda manifest: manifest["files"].reverse(),
    "the manifest names itself": lambda manifest: manifest["files"].insert(
        0, {"path": "manifest.json", "role": "preview", "size_bytes": 1, "sha256": "0" * 64}
    ),
    "shaders/other.frag is used as a shader, but is not among the files": set_to(
        "programs", 0, "fragment", to="shaders/other.frag"
    ),
    "preview.png is used as a preview, but has the role texture": set_to("files", 0, "role", to="texture"),
    "textures/bone.ktx2 is working data": set_to("files", 3, "role", to="work"),
    "nothing uses preview.png": drop("preview"),
    "the plan names gone.ktx2": lambda manifest: manifest["plan"][0]["files"].append("gone.ktx2"),
    "the levels for previews only are not the coarsest ones, without the finest": lambda manifest: manifest["channels"][
        0
    ]["levels"][0].update(preview_only=True),
    "the levels are not in ascending order": lambda manifest: manifest["channels"][0]["levels"].reverse(),
    "the grid is no part of the source's grid": set_to("grid", "spacing_mm_zyx", 0, to=2.0),
    "shape_zyx of level 1 does not follow": set_to("channels", 0, "levels", 1, "grid", "shape_zyx", to=[5, 4, 4]),
    "spacing_mm_zyx of level 1 does not follow": set_to(
        "channels", 0, "levels", 1, "grid", "spacing_mm_zyx", to=[2.5, 1.4, 0.61]
    ),
    "extent_mm_zyx of level 1 does not follow": set_to(
        "channels", 0, "levels", 1, "grid", "extent_mm_zyx", to=[12.5, 5.6, 2.7]
    ),
    "direction of level 1 does not follow": set_to("channels", 0, "levels", 1, "grid", "direction", 1, 1, to=1.0),
    "corner of level 1 does not follow": set_to("channels", 0, "levels", 1, "grid", "origin_mm_xyz", 0, to=-12.0),
    "picture bone is there 2 times": lambda manifest: manifest["pictures"].append(manifest["pictures"][0]),
    "picture bone shows a transfer function that its channel does not have": set_to(
        "pictures", 0, "media", 0, "channel", to="other"
    ),
    "picture bone mixes 1 media as sum": set_to("pictures", 0, "mixing", to="sum"),
    "picture bone draws levels [1, 0], which are not levels of its channel in their order": lambda manifest: manifest[
        "pictures"
    ][0]["drawings"].reverse(),
    "picture bone at level 0 names the program other, which does not draw it": set_to(
        "pictures", 0, "drawings", 0, "program", to="other"
    ),
    "picture bone at level 0 names the program , which does not draw it": lambda manifest: manifest["pictures"][0][
        "drawings"
    ][0].pop("program"),
    "picture bone at level 0 names 1 textures for 2 samplers": lambda manifest: manifest["pictures"][0]["drawings"][0][
        "textures"
    ].pop(),
    "picture bone at level 0 names the texture volume-scan-1, which is not of it": set_to(
        "pictures", 0, "drawings", 0, "textures", 0, to="volume-scan-1"
    ),
    "picture bone at level 0 has values for  instead of texture_from_box": set_to(
        "pictures", 0, "drawings", 0, "values", to=[]
    ),
    "picture bone at level 0 has texture_from_box that does not follow from its level": set_to(
        "pictures", 0, "drawings", 0, "values", 0, "numbers", 0, to=0.37
    ),
    "texture volume-scan-0 has (5, 7, 9) texels; the profile allows 8": set_to("profile", "max_3d_texture_size", to=8),
    "texture volume-scan-0 is of channels left and transfer function None": set_to(
        "textures", 1, "channels", to=["left"]
    ),
    "texture lookup-bone is 2D, but has 2 slices": set_to("textures", 0, "shape_zyx", 0, to=2),
    "texture lookup-bone is the table of skin, which is no transfer function": set_to(
        "textures", 0, "transfer", to="skin"
    ),
    "texture lookup-bone has not one row as a lookup table, or four rows": set_to("textures", 0, "shape_zyx", 1, to=2),
    "texture lookup-bone is pre-integrated without a range of stored values": set_to(
        "textures", 0, "stored_range", to=[0.0, 1.0]
    ),
    "a palette is that of skin, which is no transfer function": set_to(
        "palettes",
        to=[{"transfer": "skin", "entries": [{"colour": [0.0, 0.0, 0.0], "extinction_per_mm": 0.0}] * 2}],
    ),
    "some volumes are sampled with the filter linear, others with nearest": set_to(
        "textures", 1, "filter", to="nearest"
    ),
    "the volumes hold labels, but a program draws pre-integrated segments between them": segments_of_labels,
    "texture lookup-bone is a table of a transfer function, but has a mosaic, or a level that it cannot have": set_to(
        "textures", 0, "level", to=7
    ),
    "texture lookup-bone has 8 bits without max_extinction_per_mm": drop("textures", 0, "max_extinction_per_mm"),
    "texture volume-scan-0 holds level 7, which is not among the levels": set_to("textures", 1, "level", to=7),
    "texture volume-scan-0 holds level None": drop("textures", 1, "level"),
    "texture volume-scan-0 has no mosaic, so it must be 3D and have the shape (5, 4, 5)": set_to(
        "textures", 1, "level", to=1
    ),
    "texture volume-scan-0 is part 1, but of no mosaic": set_to("textures", 1, "part", to=1),
    "texture volume-scan-0 is a volume, but has only one of": set_to("textures", 1, "transfer", to="bone"),
    "texture volume-scan-0 is classified by skin, which is no transfer function": lambda manifest: manifest["textures"][
        1
    ].update(transfer="skin", reference_mm=1.0),
    "texture volume-scan-0 is classified, so it must have four channels": lambda manifest: manifest["textures"][
        1
    ].update(transfer="bone", reference_mm=1.0),
    "program raycast draws view-slices, without blending": set_to("programs", 0, "geometry", to="view-slices"),
    "program raycast has a uniform u_box_from_clip for slices, which nothing gives it": set_to(
        "programs", 0, "uniforms", 0, "source", to="slices"
    ),
    "program raycast draws triangle, without blending": set_to("programs", 0, "slab_samples", to=40),
    "program raycast has a pass that reads u_gone, which it does not": set_to(
        "programs",
        0,
        "before",
        to=[
            {
                "vertex": "shaders/screen.vert",
                "fragment": "shaders/raycast.frag",
                "geometry": "triangle",
                "sampler": "u_shadow",
                "target": "rgba8",
                "uniforms": [],
                "reads": ["u_gone"],
            }
        ],
    ),
    "program raycast reads 2 textures; the profile has 1 units": set_to("profile", "texture_units", to=1),
    "program raycast has 2 uniforms u_step_mm": set_to("programs", 0, "uniforms", 0, "name", to="u_step_mm"),
    "picture bone at level 1 takes samples at no distance": drop("pictures", 0, "drawings", 1, "step_mm"),
    "it is sealed, but has records of stages": set_to("stages", to=[{"name": "import", "key": "0" * 64}]),
    "it is sealed without render": drop("render"),
    "it is sealed without a channel": set_to("channels", to=[]),
    "it is sealed without quantization": drop("channels", 0, "quantization"),
    "it is sealed without stored_type": drop("channels", 0, "stored_type"),
    "it is sealed without levels": set_to("channels", 0, "levels", to=[]),
    "it is sealed without transfer_functions": set_to("channels", 0, "transfer_functions", to=[]),
    "it is sealed without textures": set_to("textures", to=[]),
    "no picture shows the transfer function bone": set_to("pictures", 0, "media", 0, "transfer", to="skin"),
}


@pytest.mark.parametrize("says", CONTRADICTIONS)
def test_a_manifest_that_contradicts_itself_is_found_out(sealed: Path, says: str) -> None:
    edit(sealed, CONTRADICTIONS[says])
    assert [summary for code, summary in found(sealed) if code == "VP4011" and says in summary]


@pytest.mark.parametrize(
    "change",
    [
        set_to("grid", "origin_mm_xyz", 0, to=-11.85),  # half a voxel off
        set_to("grid", "origin_mm_xyz", 0, to=-12.3),  # a voxel before the first
        set_to("grid", "origin_mm_xyz", 0, to=-11.7),  # nine voxels from the second
        set_to("grid", "extent_mm_zyx", 0, to=12.0),
        set_to("grid", "direction", 1, 1, to=1.0),
    ],
)
def test_a_grid_whose_voxels_are_not_the_sources_is_found_out(sealed: Path, change: Change) -> None:
    edit(sealed, change)
    assert any("the grid is no part of the source's grid" in summary for _, summary in found(sealed))


def test_a_grid_that_is_a_part_of_the_sources_is_none(sealed: Path) -> None:
    def widen(manifest: dict) -> None:
        grid = manifest["channels"][0]["source"]["info"]["grid"]
        grid["shape_zyx"][2] += 2
        grid["extent_mm_zyx"][2] += 2 * 0.3
        grid["origin_mm_xyz"][0] -= 0.3

    edit(sealed, widen)
    assert found(sealed) == []


MOSAIC_CONTRADICTIONS: dict[str, Change] = {
    "texture volume-scan-0 is compressed without an encoder or a mosaic, or names an encoder": set_to(
        "textures", 1, "format", to="eac-r11unorm"
    ),
    "texture volume-scan-0: its tiles are 7×9 texels apart, so that blocks of eac-r11unorm mix two": set_to(
        "textures", 1, "format", to="eac-r11unorm"
    ),
    "texture lookup-bone is compressed without an encoder or a mosaic, or names an encoder without being": set_to(
        "textures", 0, "encoder", to="etcpak 1"
    ),
    "texture volume-scan-0: its mosaic holds 4 slices of (7, 9), its level (5, 7, 9)": set_to(
        "textures", 1, "mosaic", "slices", to=4
    ),
    "texture volume-scan-0: its mosaic holds 5 slices of (9, 7)": set_to(
        "textures", 1, "mosaic", "tile_shape_yx", to=[9, 7]
    ),
    "texture volume-scan-0: its mosaic has no room for 5 slices": set_to("textures", 1, "mosaic", "tiles_y", to=1),
    "texture volume-scan-0: its shape (1, 14, 27) is not that of its mosaic": set_to(
        "textures", 1, "mosaic", "texture_shape_yx", to=[14, 36]
    ),
    "texture volume-scan-0: its tiles do not fit into textures of (14, 27)": set_to(
        "textures", 1, "mosaic", "tiles_x", to=4
    ),
    "texture volume-scan-0: its mosaic has several components in a voxel and several slices in a texel": both(
        set_to("textures", 1, "mosaic", "slices_per_texel", to=4),
        set_to("textures", 1, "mosaic", "components_per_voxel", to=2),
    ),
    "texture volume-scan-0: its mosaic has one slice in a texel, but these are planar": set_to(
        "textures", 1, "mosaic", "order", to="planar"
    ),
    "the mosaics of the volume of level 0 differ in layout or format": lambda manifest: manifest["textures"].append(
        manifest["textures"][1] | {"format": manifest["textures"][0]["format"]}
    ),
    "the mosaic of the volume of level 0 needs the parts 0 to 1, once each": set_to(
        "textures", 1, "mosaic", "textures", to=2
    ),
    "texture volume-scan-0: its mosaic has 4 components, its format is r8unorm": set_to(
        "textures", 1, "mosaic", "slices_per_texel", to=4
    ),
    "texture volume-scan-0 has (1, 14, 27) texels; the profile allows 0": set_to("textures", 1, "dimension", to="3d"),
}


@pytest.mark.parametrize("says", MOSAIC_CONTRADICTIONS)
def test_a_mosaic_that_contradicts_its_texture_is_found_out(sealed_mosaic: Path, says: str) -> None:
    edit(sealed_mosaic, MOSAIC_CONTRADICTIONS[says])
    assert [summary for code, summary in found(sealed_mosaic) if code == "VP4011" and says in summary]


def test_every_sentence_on_contradictions_has_a_case() -> None:
    source = inspect.getsource(agreement)
    sentences = re.findall(r'(?:yield|yield from \()\s*f?"([^"]+)"', source)
    assert len(sentences) > 30
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


def test_numbers_near_the_end_of_the_range_are_findings_and_no_failure(sealed: Path) -> None:
    def change(manifest: dict) -> None:
        for grid in (manifest["channels"][0]["source"]["info"]["grid"], manifest["channels"][0]["levels"][0]["grid"]):
            grid["shape_zyx"] = [2**31 - 1] * 3
            grid["spacing_mm_zyx"] = [1e308, 5e-324, 1.0]
            grid["origin_mm_xyz"] = [-1.7e308] * 3

    edit(sealed, change)
    assert {code for code, _ in found(sealed)} == {"VP4011"}


def test_a_finding_says_what_the_error_says(sealed: Path) -> None:
    error = VolprepError("VP4009", path=sealed, file="a")
    assert f"{error.code} {error.summary}. {error.remedy}" == str(error)
    assert Finding.of(error) == Finding(code="VP4009", summary=error.summary, remedy=error.remedy)


def test_numbers_whose_consequences_overflow_contradict_the_manifest(sealed: Path) -> None:
    edit(sealed, set_to("grid", "spacing_mm_zyx", 0, to=1e308))
    assert {code for code, _ in found(sealed)} == {"VP4011"}
