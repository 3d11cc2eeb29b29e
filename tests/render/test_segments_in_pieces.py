"""Sub-volumes with segments: texels hold values and labels, and blocks laid over each other are the scan's picture."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import nibabel
import numpy as np
import pytest
from judged import validate
from scene_builds import view_of
from segment_scan import AFFINE, INSIDE, SHAPE_XYZ, SOFT, built, drawn, scene_of, truth, write_segments

from volprep.lab.walk.study import walk
from volprep.parts.subvolumes.cut_inputs import inputs_of_cut
from volprep.pipeline.build import plan_build
from volprep.render.cut import cut
from volprep.render.renderer import Renderer
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep.shading import program
from volprep.truth.decoded import level_volume
from volprep.validation.comparison import edits_and_cuts
from volprep.validation.comparison.edits_and_cuts import judge_cut, random_cut
from volprep.validation.subjects.labelled import LabelledSubject
from volprep.validation.timing.clock import Clock
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid, constant_texture, decode_grid
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.textures import ktx2

VIEW = "anterior-left"
PIECES = {"grid": {"size": 8}}
ONE_HIDDEN = {"style": [{"labels": [3], "visible": False}], "outside_opacity": 0.0}
LIT = {"step_voxels": 0.25, "opacity_cutoff": 1.0, "lighting": "headlight"}

WALK = """
size = 48
[[step]]
view = "anterior-left"
zoom = 2.0
[[step]]
tap = [0.25, 0.5, 0.75]
cut_size = 10
[[step]]
show = "place"
"""
SHOWN = ["sub-volumes", "a box of level 0", "the place of a box in level 0"]


def in_pieces(package):
    """Return the programs that draw sub-volumes."""
    return [program for program in package.manifest.programs if program.sampling == "subvolumes"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return write_segments(tmp_path_factory.mktemp("segments"))


@pytest.fixture(scope="module")
def mixed(folder) -> Package:
    return built(folder, "mixed", change=PIECES, outside_opacity=0.5)


@pytest.fixture(scope="module")
def lit(folder) -> Package:
    return built_with_labels_for_each_sample(folder, "lit", change=PIECES | {"render": LIT}, **ONE_HIDDEN)


@pytest.fixture(scope="module")
def lit_in_mosaics(folder) -> Package:
    change = PIECES | {"render": LIT}
    return built_with_labels_for_each_sample(folder, "lit-in-mosaics", "gles2-4096", change, **ONE_HIDDEN)


def built_with_labels_for_each_sample(*where: object, **change: object) -> Package:
    """Build a package whose whole volume is drawn as its pieces are, which read nothing for groups of samples."""
    with patch.object(program, "samples_of_group", return_value=1):
        return built(*where, **change)


def grid_of(package: Package) -> SubvolumeGrid:
    name = package.manifest.subvolumes.grid
    return decode_grid(package.read_bytes(name), package.path, name)


def blocks(package: Package, view: str) -> Iterator[np.ndarray]:
    """Draw all blocks around every second point with parallel rays, from front to back."""
    counts, grid = grid_of(package).counts_zyx, package.manifest.grid
    camera = view_of(grid, view)
    ahead = (camera @ [0.0, 0.0, 1.0, 0.0])[:3][::-1]
    places = sorted(
        product(*(range(1, count + 1, 2) for count in counts)),
        key=lambda place: sum(at if along > 0 else -at for at, along in zip(place, ahead, strict=True)),
    )
    for place in places:
        point = int(np.ravel_multi_index(place, [count + 1 for count in counts]))
        with Renderer(package, point=point, target="rgba32f") as renderer:
            yield renderer.render(camera, (48, 48))


def laid_over(package: Package, view: str = VIEW) -> np.ndarray:
    """Return the picture of all blocks."""
    picture = np.zeros((48, 48, 4))
    for block in blocks(package, view):
        picture += (1 - picture[..., 3:]) * block
    return picture


def of_one_value(
    folder: Path, name: str, profile: str, compositing: str, lighting: str = "none", *, labelled: bool = True
) -> Package:
    """Build pieces of which a ray shows one value. A greater value is more opaque, whatever visible label it has."""
    functions = [{"name": "veil", "points": [SOFT, INSIDE[-1]]}, {"name": "inside", "points": INSIDE}]
    transfer = [each | {"isovalue": 150.0} for each in functions] if compositing == "first-hit" else functions
    render = {"step_voxels": 0.25, "picture_size": 48, "compositing": compositing, "lighting": lighting}
    change = PIECES | {"render": render, "transfer": transfer if labelled else transfer[:1]}
    if lighting != "none":
        change["lighting"] = {"normals": "central"}
    return built(folder, name, profile, change, **ONE_HIDDEN if labelled else {})


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("profile", "labels", "pixels"),
    [
        ("gles3", "labels", "rg8unorm"),
        ("gles2-4096", "labels", "rg8unorm"),
        ("gles3", "many", "rgb8unorm"),
        ("gles2-4096", "many", "rgb8unorm"),
    ],
)
def test_blocks_laid_over_each_other_are_the_picture_of_the_whole(folder, profile, labels, pixels) -> None:
    source = {"source": str(folder / f"{labels}.nii"), "style": [], "outside_opacity": 0.5}
    package = built(folder, f"{profile}-{labels}", profile, PIECES, **source)
    assert check(package.path) == []
    assert grid_of(package).texture_format == pixels
    (program,) = in_pieces(package)
    assert len([name for name in program.samplers if name.startswith("u_subvolume")]) == 8
    assert not [name for name in program.samplers if "label" in name]
    # Rays take other samples in blocks; OpenGL ES 2 has tables of 8 bits.
    assert np.abs(laid_over(package) - drawn(package)).max() < (0.004 if profile == "gles3" else 0.01)


def test_blocks_laid_over_each_other_are_the_truth(folder, mixed) -> None:
    picture = laid_over(mixed)
    # The bound of the picture of the whole (test_segments.py): no seam is seen.
    assert np.abs(picture - truth(folder, mixed, VIEW)).max() < 0.004
    assert picture[..., 3].max() > 0.5


@pytest.mark.long
def test_crisp_blocks_are_the_picture_of_the_whole(folder) -> None:
    crisp = built(folder, "crisp", change=PIECES, border="crisp")
    difference = np.abs(laid_over(crisp) - drawn(crisp)).max(axis=-1)
    assert np.sqrt((difference**2).mean()) < 0.004


@pytest.mark.parametrize("name", ["lit", "lit_in_mosaics"])
def test_lit_blocks_are_the_picture_of_the_whole_up_to_rounding(request, name) -> None:
    package = request.getfixturevalue(name)
    assert check(package.path) == []
    # Faces of the hidden segment lie within a voxel of cuts. Along an axis blocks begin and end with a whole number of
    # steps: rays take the samples of the whole.
    for view in ("anterior", "superior"):
        assert np.abs(laid_over(package, view=view) - drawn(package, view)).max() < 1e-4


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("profile", "normals"), [("gles2-4096", "central"), ("gles3", "forward"), ("gles3", "central")]
)
def test_lit_blocks_without_segments_are_the_picture_of_the_whole_too(folder, profile, normals) -> None:
    # Forward differences reach a voxel beyond a block, too.
    package = built(folder, f"{profile}-{normals}", profile, PIECES | {"render": LIT, "lighting": {"normals": normals}})
    assert check(package.path) == []
    for view in ("anterior", "superior"):
        assert np.abs(laid_over(package, view=view) - drawn(package, view)).max() < 1e-4


@pytest.mark.parametrize("profile", ["gles3", pytest.param("gles2-4096", marks=pytest.mark.long)])
def test_the_greatest_values_of_blocks_are_the_maximum_of_the_whole(folder, profile) -> None:
    package = of_one_value(folder, f"{profile}-maximum", profile, "maximum")
    assert check(package.path) == []
    # Of values that differ by less than 1/512 of the range the first counts: an opacity of 0.0003.
    picture = np.zeros((48, 48, 4))
    for block in blocks(package, "anterior"):
        picture = np.where(block[..., 3:] > picture[..., 3:] + 0.0003, block, picture)
    assert np.abs(picture - drawn(package, "anterior")).max() < (1e-6 if profile == "gles3" else 0.0003)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("profile", "lighting", "labelled"),
    [
        ("gles3", "headlight", False),
        ("gles2-4096", "headlight", False),
        ("gles3", "none", True),
        ("gles2-4096", "none", True),
    ],
)
def test_the_first_hit_of_blocks_is_that_of_the_whole(folder, profile, lighting, labelled) -> None:
    name = f"{profile}-first-hit-{lighting}-{labelled}"
    package = of_one_value(folder, name, profile, "first-hit", lighting, labelled=labelled)
    assert check(package.path) == []
    assert {each.lighting for each in in_pieces(package)} == {lighting}
    # The first block with a hit counts.
    picture = np.zeros((48, 48, 4))
    for block in blocks(package, VIEW):
        picture = np.where(picture[..., 3:] > 0.0, picture, block)
    assert np.abs(picture - drawn(package)).max() < 2e-6


def test_a_plan_says_why_pieces_are_unlit(folder) -> None:
    render = {"compositing": "first-hit", "lighting": "headlight"}
    transfer = [{"name": name, "points": INSIDE, "isovalue": 150.0} for name in ("veil", "inside")]
    change = PIECES | {"render": render, "transfer": transfer}
    scene = Scene.model_validate(scene_of(folder, **ONE_HIDDEN).model_dump(exclude_unset=True) | change)
    plan = plan_build(Request(scene, load_profile("gles3", folder), None), Silent())
    (item,) = (each for each in plan.items if each.name == "sub-volumes")
    assert item.reason.endswith("without light, since a driver may compile the labels around a hit for a minute")


@pytest.mark.long
@pytest.mark.parametrize(("lighting", "labelled"), [("none", True), ("headlight", False)])
def test_pieces_of_one_value_are_validated(folder, lighting, labelled) -> None:
    package = of_one_value(folder, f"validated-{lighting}", "gles3", "first-hit", lighting, labelled=labelled)
    report = validate(package.path, folder / f"report-{lighting}", witness=False)
    assert report.verdict.passed
    items = [other.item for program in report.programs for other in program.others]
    assert any(item.startswith("pieces around points 1") for item in items)


@pytest.mark.parametrize(("name", "more"), [("mixed", 0), ("lit", 1)])
def test_pieces_hold_the_labels_of_level_0(request, name, more) -> None:
    package = request.getfixturevalue(name)
    (texture,) = (each for each in package.manifest.textures if each.role == "labels" and each.level == 0)
    whole = np.stack([level_texels(package, 0), ktx2.decode(package.read_bytes(texture.file), "labels").data], axis=-1)
    grid = grid_of(package)
    # A lit piece has a voxel more on each side where the volume goes on.
    along = [[(max(low - more, 0), min(high + more, c[-1])) for low, high in pairwise(c)] for c in grid.cuts_zyx]
    assert all(high - low < grid.size for spans in along for low, high in spans)
    boxes = product(*along)
    for piece, box in zip(grid.subvolumes, boxes, strict=True):
        own = whole[tuple(slice(first, last + 1) for first, last in box)]
        if piece.file is None:
            # The last layer may have flags, of cells of the next piece.
            assert ((own & [0xFF, 0x7F]) == constant_texture(piece, grid.texture_format)).all()
        else:
            np.testing.assert_array_equal(ktx2.decode(package.read_bytes(piece.file), piece.file).data, own)


@pytest.mark.parametrize("name", ["mixed", "lit"])
def test_a_cut_of_pieces_with_labels_has_the_values(request, name) -> None:
    package = request.getfixturevalue(name)
    found = cut(package, (10.0, 8.0, 6.0), 9)
    box = zip(found.record.start_zyx, found.record.stop_zyx, strict=True)
    np.testing.assert_array_equal(found.texels, level_texels(package, 0)[tuple(slice(*each) for each in box)])


@pytest.mark.parametrize(
    "name",
    ["mixed", pytest.param("lit", marks=pytest.mark.long), pytest.param("lit_in_mosaics", marks=pytest.mark.long)],
)
def test_a_walk_through_pieces_with_labels_is_the_truth_of_what_it_shows(request, tmp_path, name) -> None:
    (tmp_path / "walk.toml").write_text(WALK)
    report = walk(request.getfixturevalue(name).path, tmp_path / "walk.toml", tmp_path / "pictures", Silent())
    assert [each.shown.split(" around")[0] for each in report.pictures] == SHOWN
    assert max(each.maximum for each in report.pictures) < (0.004 if name == "mixed" else 0.02)
    assert report.failed == ()


def test_a_walk_does_not_change_the_functions_of_segments(mixed, tmp_path) -> None:
    (tmp_path / "walk.toml").write_text("size = 48\n[[step]]\nminimum = 20.0\n")
    with pytest.raises(VolprepError, match="VP4053"):
        walk(mixed.path, tmp_path / "walk.toml", tmp_path / "pictures", Silent())


@pytest.mark.parametrize("profile", ["gles3", pytest.param("gles2-4096", marks=pytest.mark.long)])
def test_a_cut_of_all_voxels_is_the_picture_of_the_whole(folder, profile) -> None:
    package = built_with_labels_for_each_sample(
        folder, f"{profile}-cut", profile, {"grid": {"size": 12}}, outside_opacity=0.5
    )
    found = cut(package, (10.0, 8.0, 6.0), max(SHAPE_XYZ))
    grid = package.manifest.grid
    camera = view_of(grid, VIEW)
    with Renderer(package, point=0, target="rgba32f", edit=inputs_of_cut(found)) as renderer:
        picture = renderer.render(camera, (48, 48))
    assert np.abs(picture - drawn(package)).max() < (1e-4 if profile == "gles3" else 0.01)


def test_lit_pieces_smaller_than_a_cell_with_its_neighbours_are_refused(folder) -> None:
    with pytest.raises(VolprepError, match=r"VP3030.*needs 4 voxels"):
        built(folder, "bad", change={"grid": {"size": 3}, "render": LIT}, border="mixed")


def test_a_piece_of_one_value_and_one_label_is_not_stored(folder, tmp_path) -> None:
    x, _, _ = np.indices(SHAPE_XYZ)
    nibabel.save(nibabel.Nifti1Image(np.full(SHAPE_XYZ, 200, np.uint8), AFFINE), tmp_path / "scan.nii")
    nibabel.save(nibabel.Nifti1Image((x > 9).astype(np.int16), AFFINE), tmp_path / "labels.nii")
    package = built(tmp_path, "halves", change=PIECES, style=[], outside_opacity=0.5)
    pieces = grid_of(package).subvolumes
    assert {(piece.file is None, piece.label) for piece in pieces} == {(True, None), (False, None), (True, 1)}
    assert np.abs(laid_over(package) - truth(tmp_path, package, VIEW)).max() < 0.004


def test_a_profile_of_eight_units_and_16_bits_are_refused_with_the_reason(folder) -> None:
    for profile, more, reason in (
        ("gles2-2048", {}, "8 pieces with looks and their table take 11 texture units of 8: choose a profile"),
        ("gles3", {"quantize": {"bits": 16}}, "set quantize.bits = 8"),
    ):
        with pytest.raises(VolprepError, match=f"VP3030.*{reason}"):
            built(folder, "bad", profile, PIECES | more, border="mixed")


def test_what_pieces_with_labels_cannot_do_is_refused(folder) -> None:
    with pytest.raises(VolprepError, match=r'VP3220.*grid.layout both; set grid.layout = "files"'):
        built(folder, "bad", change={"grid": {"size": 8, "layout": "both"}}, border="mixed")


def test_styles_that_would_take_too_many_units_are_classified_by_control_points(folder) -> None:
    functions = [{"name": f"style-{n}", "points": INSIDE} for n in range(8)]
    styles = [{"labels": [number], "transfer": f"style-{n}"} for n, number in enumerate((1, 2, 3, 200))]
    transfer = [{"name": "veil", "points": [SOFT, INSIDE[-1]]}, *functions[:4]]
    small = (folder / "small.toml", "gles3.toml")
    text = (Path(__file__).parents[2] / "volprep/scene/profiles" / small[1]).read_text()
    small[0].write_text(text.replace("texture_units = 16", "texture_units = 12", 1))
    change = PIECES | {"transfer": transfer}
    package = built(folder, "styles", "small.toml", change, outside="veil", inside="style-3", style=styles)
    assert in_pieces(package)[0].classification == "control-points"
    assert package.manifest.level_programs[0].classification == "lookup"
    assert np.abs(laid_over(package) - drawn(package)).max() < 0.006


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", ["mixed", "lit_in_mosaics"])
def test_a_cut_of_pieces_with_labels_is_judged_by_the_scan_and_its_labels(request, folder, name, monkeypatch) -> None:
    package = request.getfixturevalue(name)
    segments = package.manifest.segments
    labels = held_labels(package.manifest.textures, 0, package.read_bytes)
    subject = LabelledSubject(package, level_volume(package, 0), 24, labels, segments)
    bench = SimpleNamespace(subject=subject, clock=Clock())
    (judged,) = judge_cut(bench, segments.name)
    assert judged.passed
    assert len(judged.views) == 9
    right = random_cut(subject)
    monkeypatch.setattr(edits_and_cuts, "random_cut", lambda _: replace(right, labels=np.zeros_like(right.labels)))
    (judged,) = judge_cut(bench, segments.name)
    assert not judged.passed


@pytest.mark.long
def test_pieces_with_labels_are_validated(folder, mixed) -> None:
    report = validate(mixed.path, folder / "report", witness=False)
    assert report.verdict.passed
    items = [other.item for program in report.programs for other in program.others]
    assert any(item.startswith("pieces around points 1") for item in items)
