"""Ways to damage a package so that size and digest of every file are right: each is found, and the item is named.

Nothing here is found by a picture but the preview: what follows from the scan is derived again and compared. The table
in docs/VALIDATED.md lists the cases.
"""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from command_line import volprep
from every_kind import write_segments
from tamper_scenes import KINDS, write_kind
from tampering import Damaged, built, told

from volprep.pipeline.origin import origin_path
from volprep.validation.results.report import Report
from volprep_formats.diagnostics import ExitStatus
from volprep_formats.grid import Grid
from volprep_formats.meshes import read_glb, write_glb
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.png import png_bytes
from volprep_formats.progress import Silent


@dataclass(frozen=True)
class Case:
    """One way to damage a package."""

    name: str
    kind: str
    damage: Callable[[Damaged], object]
    named: str
    """What the message must name."""


def swapped(axis: int, one: int, other: int) -> Callable[[np.ndarray], np.ndarray]:
    def change(texels: np.ndarray) -> np.ndarray:
        moved = np.moveaxis(texels, axis, 0)
        moved[[one, other]] = moved[[other, one]]
        return texels

    return change


def halves(texels: np.ndarray) -> np.ndarray:
    """rgba16float texels as numbers [z, y, x, channel]."""
    return np.ascontiguousarray(texels).view(np.float16)


def extinction_doubled(texels: np.ndarray) -> np.ndarray:
    halves(texels)[..., 3] *= 2
    return texels


def red_and_blue_exchanged(texels: np.ndarray) -> np.ndarray:
    numbers = halves(texels)
    numbers[..., [0, 2]] = numbers[..., [2, 0]]
    return texels


def of_texture(
    role: str, change: Callable[[np.ndarray], np.ndarray], level: int | None = None
) -> Callable[[Damaged], object]:
    return lambda package: package.texels(package.texture(role, level), change)


def of_text(file: str, old: str, new: str) -> Callable[[Damaged], object]:
    return lambda package: package.text(file, old, new)


def in_manifest(change: Callable[[dict], object]) -> Callable[[Damaged], object]:
    return lambda package: change(package.manifest)


def in_render(**changes: object) -> Callable[[Damaged], object]:
    return in_manifest(lambda manifest: manifest["render"].update(changes))


def window_wider(manifest: dict) -> None:
    codes = manifest["channels"][0]["quantization"]
    low, high = codes["window"]
    codes |= {"window": [low, low + 1.2 * (high - low)], "slope": 1.2 * codes["slope"]}


def spacing_scaled(manifest: dict) -> None:
    regrid(manifest, lambda grid: Grid.of(grid.shape_zyx, [2 * h for h in grid.spacing_mm_zyx]))
    for drawing in manifest["pictures"][0]["drawings"]:
        for value in drawing["values"]:
            value["numbers"] = [each / 2 for each in value["numbers"]]


def axes_flipped(manifest: dict) -> None:
    regrid(manifest, lambda grid: Grid.of(grid.shape_zyx, grid.spacing_mm_zyx, direction=-np.eye(3)))


def regrid(manifest: dict, change: Callable[[Grid], Grid]) -> None:
    """Replace every grid, so that the manifest agrees with itself; for a scan that is not cropped."""
    grid = change(Grid.model_validate_json(json.dumps(manifest["grid"])))
    manifest["grid"] = manifest["channels"][0]["source"]["info"]["grid"] = grid.model_dump(mode="json")
    for level in manifest["channels"][0]["levels"]:
        level["grid"] = (grid.coarser(level["factors_zyx"]) if level["index"] else grid).model_dump(mode="json")


def pieces_swapped(package: Damaged) -> None:
    """The files of two pieces of one shape, each under the other's name."""
    one, other = (package.data(f"subvolumes/{name}.ktx2") for name in ("1-0-0", "2-0-0"))
    assert len(one) == len(other)
    package.put("subvolumes/1-0-0.ktx2", bytes(other))
    package.put("subvolumes/2-0-0.ktx2", bytes(one))


def hole_in_a_piece(package: Damaged) -> None:
    data = package.data("subvolumes/0-0-0.ktx2")
    data[-100:-60] = bytes(40)
    package.put("subvolumes/0-0-0.ktx2", bytes(data))


def piece_range(record: dict) -> None:
    record["subvolumes"][0]["maximum"] -= 1


def too_bold(texels: np.ndarray) -> np.ndarray:
    """One block that shows something is said to be empty."""
    occupied = np.argwhere(texels == 0)[0]
    texels[tuple(occupied)] = 1
    return texels


def mesh_of_a_coarser_level(package: Damaged) -> None:
    package.put("meshes/proxy-shell-0.glb", bytes(package.data("meshes/proxy-shell-1.glb")))


def mesh_shrunk(package: Damaged) -> None:
    """The side at the largest x, one block less."""
    file = "meshes/proxy-shell-0.glb"
    mesh = read_glb(bytes(package.data(file)), file)
    (part,) = mesh.primitives
    positions = part.positions_xyz.copy()
    positions[positions[:, 0] == positions[:, 0].max(), 0] -= 2
    package.put(file, write_glb((replace(part, positions_xyz=positions),), mesh.scale_mm_xyz, {}))


def other_preview(package: Damaged) -> None:
    path = package.path / "preview.png"
    picture = OpenImageIO.ImageBuf(str(path)).get_pixels("uint8")
    path.write_bytes(png_bytes(np.ascontiguousarray(picture[::-1, ::-1, :3])))
    package.put("preview.png", path.read_bytes())


def mirrored_and_tolerant(package: Damaged) -> None:
    package.texels(package.texture("volume", 0), lambda texels: texels[:, :, ::-1])
    package.manifest["render"]["tolerance"] = {"rmse": 1.0, "maximum": 1.0}


def added_file(package: Damaged) -> None:
    record = dict(package.manifest["files"][0])
    record["path"] = "textures/zz-more.ktx2"
    package.manifest["files"].append(record)
    (package.path / "textures" / "zz-more.ktx2").write_bytes(b"")
    package.put("textures/zz-more.ktx2", bytes(package.data("textures/volume-scan-2.ktx2")))


def histograms_exchanged(package: Damaged) -> None:
    package.put("histograms/scan-1.bin", bytes(package.data("histograms/scan-2.bin")))


def block_changed(package: Damaged) -> None:
    data = package.data("textures/mosaic-scan-0.ktx2")
    data[-200:-184] = data[-400:-384]
    package.put("textures/mosaic-scan-0.ktx2", bytes(data))


def palette_colour(manifest: dict) -> None:
    manifest["palettes"][0]["entries"][30]["colour"] = [0.0, 1.0, 0.0]


def brick_index_off_by_one(texels: np.ndarray) -> np.ndarray:
    """Two bricks under each other's place: both places exist."""
    stored = np.argwhere((texels != texels[0, 0, 0]).any(axis=-1))
    one, other = tuple(stored[-1]), tuple(stored[-2])
    texels[one], texels[other] = texels[other].copy(), texels[one].copy()
    return texels


def shift(texels: np.ndarray) -> np.ndarray:
    return np.roll(texels, 1, axis=2)


def one_texel(texels: np.ndarray) -> np.ndarray:
    texels[3, 3, 3] ^= 64
    return texels


def wider(texels: np.ndarray) -> np.ndarray:
    return np.clip(texels.astype(int) - 1, 0, 255).astype(np.uint8)


HOUSE_SHADER = "shaders/raycast-shell.frag"
PIECES_SHADER = "shaders/subvolumes-shell.frag"
VERTEX_SHADER = "shaders/raycast.vert"
CASES = (
    Case("two slices swapped in level 0", "house", of_texture("volume", swapped(0, 4, 5), 0), "volume-scan-0"),
    Case("level 0 mirrored, tolerance 1.0", "house", mirrored_and_tolerant, "volume-scan-0"),
    Case("a level shifted by one voxel", "house", of_texture("volume", shift, 1), "volume-scan-1 of level 1"),
    Case("a level all zero", "house", of_texture("volume", np.zeros_like, 1), "volume-scan-1 of level 1"),
    Case("a level turned round", "house", of_texture("volume", lambda t: t[:, ::-1], 2), "volume-scan-2 of level 2"),
    Case("window 1.2 times wider", "house", in_manifest(window_wider), "quantization.window"),
    Case("a piece swapped with its neighbour", "house", pieces_swapped, "subvolumes/1-0-0.ktx2"),
    Case("a piece with a hole", "house", hole_in_a_piece, "subvolumes/0-0-0.ktx2"),
    Case(
        "a piece's range one code less",
        "house",
        lambda package: package.json("subvolumes/grid.json", piece_range),
        "subvolumes/grid.json",
    ),
    Case("normals negated", "house", of_texture("normals", lambda t: 255 - t, 0), "normals-scan-0"),
    Case("coarse normals shifted", "house", of_texture("normals", shift, 1), "normals-scan-1"),
    Case("table reversed", "house", of_texture("transfer", lambda t: t[:, :, ::-1]), "transfer-shell"),
    Case("extinction doubled", "house", of_texture("transfer", extinction_doubled), "transfer-shell"),
    Case(
        "a level's own table with red and blue exchanged",
        "house",
        of_texture("transfer", red_and_blue_exchanged, 1),
        "transfer-shell-level1",
    ),
    Case("skip table too bold by one block", "house", of_texture("skip", too_bold, 0), "skip-shell-0"),
    Case("proxy mesh shrunk by one block", "house", mesh_shrunk, "meshes/proxy-shell-0.glb"),
    Case("proxy mesh of another level", "house", mesh_of_a_coarser_level, "meshes/proxy-shell-0.glb"),
    Case("a shader's step doubled", "house", of_text(HOUSE_SHADER, "/ u_step_mm", "/ (2.0 * u_step_mm)"), HOUSE_SHADER),
    Case(
        "sRGB taken for linear in a shader",
        "house",
        of_text(HOUSE_SHADER, "picture = vec4(colour", "picture = vec4(pow(colour, vec3(2.2))"),
        HOUSE_SHADER,
    ),
    Case(
        "half a voxel lost in a shader",
        "house",
        of_text(
            "shaders/subvolumes-shell.frag", "return box_mm * VOXELS_PER_MM", "return box_mm * VOXELS_PER_MM - 0.5"
        ),
        "shaders/subvolumes-shell.frag",
    ),
    Case(
        "rays that end at once",
        "house",
        of_text("shaders/proxy-raycast-shell.frag", "= 0.002 * pow(", "= 0.2 * pow("),
        "shaders/proxy-raycast-shell.frag",
    ),
    Case(
        "a vertex shader upside down", "house", of_text("shaders/raycast.vert", "1.0", "-1.0"), "shaders/raycast.vert"
    ),
    Case("a file that nothing asks for", "house", added_file, "textures/zz-more.ktx2"),
    Case("a wider tolerance", "house", in_render(tolerance={"rmse": 0.5, "maximum": 1.0}), "render.tolerance.rmse"),
    Case("spacing scaled", "fitted", in_manifest(spacing_scaled), "spacing_mm_zyx"),
    Case("axes flipped", "fitted", in_manifest(axes_flipped), "direction"),
    Case(
        "step doubled", "house", in_manifest(lambda m: m["pictures"][0]["drawings"][0].update(step_mm=9.0)), "step_mm"
    ),
    Case(
        "rays that end earlier",
        "house",
        in_manifest(lambda m: m["programs"][0].update(opacity_cutoff=0.5)),
        "opacity_cutoff",
    ),
    Case("another projection", "house", in_render(projection="perspective"), "render.projection"),
    Case(
        "a transfer function's colour changed",
        "house",
        in_manifest(lambda m: m["channels"][0]["transfer_functions"][0]["points"][1].update(colour=[0.0, 1.0, 0.0])),
        "transfer_functions[shell].points[1].colour",
    ),
    Case(
        "another filter named",
        "house",
        in_manifest(lambda m: m["channels"][0]["levels"][1].update(filter="median")),
        "levels[1].filter",
    ),
    Case(
        "a level marked for previews that is not",
        "compressed",
        in_manifest(lambda m: [each.update(preview_only=True) for each in m["pictures"][0]["drawings"][1:]]),
        ".preview_only is True, nothing follows",
    ),
    Case(
        "a level for previews without its mark",
        "editable",
        in_manifest(lambda m: m["pictures"][0]["drawings"][1].pop("preview_only")),
        "drawings[1].preview_only is nothing, True follows",
    ),
    Case("preview of another package", "house", other_preview, "preview.png"),
    Case("two tiles of a mosaic swapped", "mosaic", of_texture("volume", swapped(1, 3, 20), 0), "mosaic-scan-0"),
    Case(
        "rows of a pre-integrated table reversed",
        "mosaic",
        of_texture("preintegrated", lambda t: t[:, ::-1]),
        "preintegrated-shell",
    ),
    Case("bricks' index off by one", "bricks", of_texture("bricks", brick_index_off_by_one, 0), "bricks-scan-0"),
    Case("a texel in a brick", "bricks", of_texture("volume", one_texel, 0), "volume-scan-0"),
    Case("a palette's colour", "bricks", in_manifest(palette_colour), "palettes[shell].entries[30].colour"),
    Case("histogram of another level", "editable", histograms_exchanged, "histograms/scan-1.bin"),
    Case("block ranges narrowed", "editable", of_texture("ranges", wider, 0), "ranges-scan-0"),
    Case("two slices of a stack swapped", "slices", of_texture("slices", swapped(1, 3, 20)), "slices-shell-x-0"),
    Case("classified voxels half as opaque", "classified", of_texture("volume", lambda t: t // 2, 1), "volume-scan-1"),
    Case("a block of a compressed mosaic", "compressed", block_changed, "mosaic-scan-0"),
    Case("a fitted level's voxel", "fitted", of_texture("volume", lambda t: np.maximum(t, 30), 2), "volume-scan-2"),
    Case("another channel in place of one", "channels", of_texture("volume", lambda t: t[:, ::-1]), "volume-one-0"),
)


@pytest.fixture(scope="module")
def packages(tmp_path_factory) -> dict[str, Path]:
    """One sealed package of each kind."""
    found = {}
    for kind in (*KINDS, "channels"):
        folder = tmp_path_factory.mktemp(kind)
        found[kind] = built(folder, write_kind(folder, kind))
    return found


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.kind}: {case.name}")
def test_damage_with_the_right_digests_is_found_and_the_item_is_named(packages, tmp_path, case) -> None:
    package = Damaged(packages[case.kind], tmp_path)
    case.damage(package)
    assert case.named in told(package.save(), preview=case.named == "preview.png")


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("kind", [*KINDS, "channels"])
def test_one_byte_in_the_middle_of_each_texture_and_piece_is_found(packages, tmp_path, kind) -> None:
    package = Damaged(packages[kind], tmp_path)
    files = [each["path"] for each in package.manifest["files"] if each["role"] in {"texture", "subvolume"}]
    whole = {file: bytes(package.data(file)) for file in files}
    for file in files:
        data = bytearray(whole[file])
        data[-len(data) // 4] ^= 64
        package.put(file, bytes(data))
    while "VP6010" in (findings := told(package.save())):
        # The package contradicts itself, which is found before anything is derived.
        named = [file for file in files if file in findings]
        assert named
        for file in named:
            files.remove(file)
            package.put(file, whole[file])
    assert [file for file in files if file not in findings] == []


@pytest.mark.long
def test_wrong_labels_of_pieces_are_found(tmp_path) -> None:
    (tmp_path / "damaged").mkdir()
    package = Damaged(built(tmp_path, write_segments(tmp_path, even_piece=True)), tmp_path / "damaged")
    assert told(package.path) == ""
    pieces = json.loads(package.data("subvolumes/grid.json"))["subvolumes"]
    assert pieces[5] == {"minimum": 150, "maximum": 150, "label": 2}

    package.json("subvolumes/grid.json", lambda record: record["subvolumes"][5].update(label=1))
    texels = package.data("subvolumes/0-0-0.ktx2")
    # The second byte of the last texel is its label.
    texels[-1] ^= 1
    package.put("subvolumes/0-0-0.ktx2", bytes(texels))
    assert [line.partition(":")[0] for line in sorted(told(package.save()).splitlines())] == [
        "VP6030 grid subvolumes/grid.json",
        "VP6030 subvolume subvolumes/0-0-0.ktx2",
    ]

    package.json("subvolumes/grid.json", lambda record: record.update(texture_format="rg8unorm"))
    assert "subvolumes/grid.json" in told(package.save())


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("kind", [*KINDS, "channels"])
def test_a_package_as_it_was_built_passes(packages, kind) -> None:
    assert told(packages[kind], preview=kind == "house") == ""


def test_the_order_of_keys_and_another_name_do_no_harm(packages, tmp_path) -> None:
    package = Damaged(packages["house"], tmp_path)
    package.json("subvolumes/grid.json", lambda record: record.update(reversed(record.items())))
    text = json.dumps(dict(reversed(package.manifest.items())), indent=7)
    (package.path / "manifest.json").write_text(text, encoding="utf-8")
    renamed = package.path.rename(tmp_path / "renamed.volpkg")
    shutil.move(origin_path(package.path), origin_path(renamed))
    assert told(renamed) == ""


def test_the_form_of_a_zip_does_no_harm(packages, tmp_path) -> None:
    package = Damaged(packages["house"], tmp_path)
    zipped = tmp_path / "tried.volpkg.zip"
    names = ["manifest.json", *(each["path"] for each in package.manifest["files"])]
    with zipped.open("wb") as file:
        write_single_file(package.path, names, file, Silent())
    assert told(zipped, preview=True) == ""


def test_a_package_of_another_version_is_not_proved(packages, tmp_path) -> None:
    package = Damaged(packages["fitted"], tmp_path)
    package.manifest["generator"] = "volprep 0.0.9"
    # The texts of its shaders are for the pictures to judge.
    package.text(HOUSE_SHADER, "void main", "// As it was then.\nvoid main")
    (finding,) = told(package.save()).splitlines()
    assert finding.startswith("VP6033 the package: was made by volprep 0.0.9")


@pytest.mark.long
def test_what_the_command_line_names_judges_and_not_the_origin(packages, tmp_path) -> None:
    package = packages["fitted"]
    scene = write_kind(tmp_path, "fitted")
    assert told(package, scene) == ""
    scene.write_text(scene.read_text(encoding="utf-8") + "\n[tolerance]\nrmse = 0.001\n", encoding="utf-8")
    # A smaller tolerance also asks for finer steps, and whatever follows from them.
    wanted = "VP6031 manifest.json: render.tolerance.rmse is 0.01, 0.001 follows from the scene"
    assert wanted in told(package, scene).splitlines()


@pytest.mark.long
def test_a_shader_that_no_driver_takes_is_told_by_its_name(packages, tmp_path) -> None:
    package = Damaged(packages["fitted"], tmp_path)
    package.text(HOUSE_SHADER, "void main", "void man")
    done = volprep("validate", package.save(), "--size", "16")
    assert done.returncode == ExitStatus.TOLERANCE
    assert "VP6030" in done.stderr
    assert f"shader {HOUSE_SHADER}" in done.stderr


def test_only_the_origin_or_a_scene_can_judge(packages, tmp_path) -> None:
    package = Damaged(packages["fitted"], tmp_path)
    origin_path(package.path).unlink()
    assert "VP6012" in told(package.path)


@pytest.mark.long
def test_damage_ends_the_command_with_status_1_and_a_report_that_names_it(packages, tmp_path) -> None:
    package = Damaged(packages["fitted"], tmp_path)
    package.texels(package.texture("volume", 0), swapped(0, 4, 5))
    done = volprep("validate", package.save(), "--size", "16")
    assert done.returncode == ExitStatus.TOLERANCE, done.stderr
    assert "VP6030" in done.stderr
    assert "volume volume-scan-0 of level 0 (textures/volume-scan-0.ktx2)" in done.stderr
    assert "the first is in texel [z 4," in done.stderr
    report = Report.model_validate_json((tmp_path / "tried.report" / "report.json").read_bytes())
    assert not report.verdict.passed
    assert "volume volume-scan-0 of level 0 (textures/volume-scan-0.ktx2)" in report.verdict.differing
    assert "volume-scan-0 of level 0" in (tmp_path / "tried.report" / "index.html").read_text(encoding="utf-8")
    assert [each.name for each in tmp_path.iterdir() if each.name.startswith(".")] == []
