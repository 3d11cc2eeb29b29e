"""Label volumes: codes are the labels, on every level, and what would change a label is refused."""

from dataclasses import replace
from pathlib import Path

import nibabel
import numpy as np
import pytest
import scene_builds
from command_line import volprep
from judged import validate

from volprep.pipeline.build import build, plan_build
from volprep.scene.profiles import load_profile
from volprep.scene.request import request_for_source
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.parts.subvolumes.record import decode_grid
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.textures import ktx2

SHAPE = (11, 14, 18)
SCENE = """
name = "labels"
crop = "none"

[source]
path = "labels.raw"
labels = true

[source.raw]
shape_zyx = [11, 14, 18]
dtype = "{dtype}"

[pyramid]
coarsest_longest_axis = 5
{pyramid}

[[transfer]]
name = "seven"
points = [
    {{ value = 6.5, colour = "#804020", extinction_per_mm = 0.0 }},
    {{ value = 6.5, colour = "#ffc080", extinction_per_mm = 0.5 }},
    {{ value = 7.5, colour = "#ffc080", extinction_per_mm = 0.5 }},
    {{ value = 7.5, colour = "#ffffff", extinction_per_mm = 0.0 }},
]
{more}
"""


def labels(dtype: str = "uint8") -> np.ndarray:
    """Three things in the background, one of them a thread."""
    volume = np.zeros(SHAPE, np.dtype(dtype))
    volume[2:9, 3:10, 4:12] = 3
    volume[5:, 7:, 9:] = 200
    volume[:, 1, 15] = 7
    return volume


def write_scene(folder: Path, volume: np.ndarray, pyramid: str = "", more: str = "") -> Path:
    volume.tofile(folder / "labels.raw")
    path = folder / "labels.toml"
    path.write_text(SCENE.format(dtype=volume.dtype.name, pyramid=pyramid, more=more))
    return path


def built(folder: Path, volume: np.ndarray, pyramid: str = "") -> Package:
    return scene_builds.built(write_scene(folder, volume, pyramid), folder / "labels.volpkg")


def refusal(folder: Path, volume: np.ndarray, pyramid: str = "", more: str = "") -> VolprepError:
    with pytest.raises(VolprepError) as caught:
        scene_builds.built(write_scene(folder, volume, pyramid, more), folder / "labels.volpkg")
    return caught.value


def codes(package: Package) -> list[np.ndarray]:
    """Codes of all levels, finest first."""
    files = [texture.file for texture in package.manifest.textures if texture.role == "volume"]
    return [np.asarray(ktx2.decode(package.read_bytes(file), file).data).reshape(-1) for file in files]


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "float32"])
def test_codes_of_every_level_are_labels(dtype, tmp_path) -> None:
    package = built(tmp_path, labels(dtype))
    manifest = package.manifest
    assert manifest.quantization.bits == 8
    assert (manifest.quantization.slope, manifest.quantization.intercept) == (1.0, 0.0)
    assert manifest.quantization.max_error == 0.0
    assert [level.filter for level in manifest.levels] == ["none", "mode", "mode"]
    finest, *coarser = codes(package)
    assert np.array_equal(finest, labels().reshape(-1))
    for level in coarser:
        assert set(np.unique(level)) <= {0, 3, 7, 200}


def test_a_thread_is_kept_where_the_background_does_not_count(tmp_path) -> None:
    for name, kept in (("mode", False), ("mode-foreground", True)):
        folder = tmp_path / name
        folder.mkdir()
        level = codes(built(folder, labels(), f'filter = "{name}"'))[1]
        assert (7 in level) == kept


def test_the_plan_says_what_shaders_see_between_labels(tmp_path) -> None:
    manifest = built(tmp_path, labels()).manifest
    item = next(item for item in manifest.plan if item.name == "labels")
    assert item.kept
    assert "labels are not interpolated" in item.reason
    assert {texture.filter for texture in manifest.textures if texture.role == "volume"} == {"nearest"}
    assert {texture.filter for texture in manifest.textures if texture.role == "transfer"} == {"linear"}
    # Labels are whole numbers: 256 entries hold the function at each of them.
    assert next(texture for texture in manifest.textures if texture.role == "transfer").shape_zyx == (1, 1, 256)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("profile", "wish"),
    [("gles3", ""), ("gles2-2048", ""), ("gles3", 'compositing = "back-to-front"\n[bricks]\nsize = 8')],
    ids=["gles3", "gles2-2048", "back-to-front-bricks"],
)
def test_a_package_of_labels_is_true_to_its_scan(profile, wish, tmp_path) -> None:
    scene = write_scene(tmp_path, labels(), more=f"[render]\npicture_size = 32\n{wish}")
    scene_builds.built(scene, tmp_path / "labels.volpkg", profile=profile)
    report = validate(tmp_path / "labels.volpkg", tmp_path / "labels.report")
    assert (report.verdict.failed, report.verdict.differing, report.verdict.unproved) == (0, (), ())
    # Labels are not mixed: a level of five voxels shows other borders than the scan, and the verdict says so.
    assert all(item.startswith("level ") for item in report.verdict.beyond)
    for view in report.programs[0].views:
        assert view.data.maximum < 1e-6
        assert view.truth_bound < 1e-6
        # What remains is rounding to 8 bits: segments of a voxel are split at its faces.
        assert view.seen.rmse < 0.002
    assert report.programs[0].sweep.convergence.expected == 1.0


def step_mm(folder: Path, extinction: str, wish: str = "") -> float:
    folder.mkdir()
    scene = write_scene(folder, labels(), more=f"[render]\n{wish}\n")
    scene.write_text(scene.read_text().replace("extinction_per_mm = 0.5", f"extinction_per_mm = {extinction}"))
    scene_builds.built(scene, folder / "labels.volpkg")
    return Package.open(folder / "labels.volpkg").manifest.step_mm


def test_segments_that_are_split_at_faces_are_as_long_as_voxels(tmp_path) -> None:
    assert step_mm(tmp_path / "solid", "1e6") == 1.0
    assert step_mm(tmp_path / "wished", "1e6", "step_voxels = 0.25") == 0.25


def test_other_steps_through_a_label_are_nearly_transparent_unless_the_scene_says_otherwise(tmp_path) -> None:
    published = 'technique = "two-pass-as-published"'
    assert step_mm(tmp_path / "faint", "0.1", published) == 0.5
    # 1 - exp(-τ step) = 1 / 16, a quarter of the largest error allowed.
    assert step_mm(tmp_path / "dense", "0.5", published) == pytest.approx(-np.log(15 / 16) / 0.5)
    assert step_mm(tmp_path / "solid", "1e6", published) == 0.125
    assert step_mm(tmp_path / "wished", "1e6", f"{published}\nstep_voxels = 2.0") == 2.0


def test_sub_volumes_and_slices_of_labels_are_not_mixed_either(tmp_path) -> None:
    scene = write_scene(tmp_path, labels(), more="[grid]\nsize = 8")
    package = scene_builds.built(scene, tmp_path / "labels.volpkg")
    files = package.manifest.subvolumes
    assert decode_grid(package.read_bytes(files.grid), package.path, files.grid).filter == "nearest"
    slices = tmp_path / "slices"
    slices.mkdir()
    scene_builds.built(write_scene(slices, labels()), slices / "labels.volpkg", profile="gles1")
    textures = Package.open(slices / "labels.volpkg").manifest.textures
    assert {texture.filter for texture in textures} == {"nearest"}


LIT = '[render]\nlighting = "headlight"'


def write_lit_scene(folder: Path, volume: np.ndarray, numbers: tuple[int, ...], more: str = "") -> Path:
    """Write a scene that shows these labels, each in a colour and with an extinction of its own."""
    shown = zip(numbers, ("#ffc080", "#40a0ff", "#80ff60"), (0.5, 2.0, 0.2), strict=True)
    points = []
    for number, colour, extinction in sorted(shown):
        points += [(number - 0.5, colour, 0.0), (number - 0.5, colour, extinction)]
        points += [(number + 0.5, colour, extinction), (number + 0.5, colour, 0.0)]
    table = ",".join(
        f'{{ value = {value}, colour = "{colour}", extinction_per_mm = {extinction} }}'
        for value, colour, extinction in points
    )
    path = write_scene(folder, volume, more=f"{LIT}\n{more}")
    head, _, rest = path.read_text().partition("points = [")
    path.write_text(f"{head}points = [{table}]{rest[rest.index(']') + 1 :]}")
    return path


@pytest.mark.parametrize("normals", ["", '[normals]\ncode = "oct8"'])
def test_lit_labels_are_drawn_as_the_oracle_and_the_witness_light_them(normals, tmp_path) -> None:
    scene = write_lit_scene(tmp_path, labels(), (3, 7, 200), f"picture_size = 96\n{normals}")
    package = scene_builds.built(scene, tmp_path / "labels.volpkg")
    assert {each.filter for each in package.manifest.textures if each.role == "normals"} == {"nearest"}
    report = validate(package, witness=True)
    assert report.verdict.code == "within"
    assert report.witness is not None
    witnessed = {each.item.split()[0] for each in report.witness.checks}
    assert "pictures" in witnessed
    assert ("normals" in witnessed) == (normals == "")
    assert report.witness.contradicted == ()


def test_the_same_label_with_another_number_has_the_same_light(tmp_path) -> None:
    pictures = []
    for first, second, third in ((3, 7, 200), (201, 5, 9)):
        folder = tmp_path / str(first)
        folder.mkdir()
        volume, old = np.zeros(SHAPE, np.uint8), labels()
        for label, was in ((first, 3), (second, 7), (third, 200)):
            volume[old == was] = label
        scene = write_lit_scene(folder, volume, (first, second, third))
        pictures.append(scene_builds.drawn(scene_builds.built(scene, folder / "labels.volpkg")))
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1 / 255)
    assert pictures[0].max() > 0.2


@pytest.mark.parametrize(
    ("more", "missing"),
    [
        ('[render]\nlighting = "phong"\n[lighting]\nlight_mm = [0.0, 0.0, 0.0]', "headlight"),
        (f'{LIT}\n[lighting]\nnormals = "central"', "volume"),
        (f'[[transfer]]\nname = "b"\npreset = "labels"\n{LIT}', "one transfer function"),
        (f'{LIT}\ntechnique = "two-pass-as-published"', "faces of voxels"),
    ],
)
def test_light_that_would_fall_on_the_numbers_of_labels_is_refused(more, missing, tmp_path) -> None:
    error = refusal(tmp_path, labels(), more=more)
    assert (error.code, error.status) == ("VP3286", ExitStatus.SCENE)
    assert missing in str(error)


def test_a_label_map_without_a_scene_is_lit_where_devices_have_3d_textures(tmp_path) -> None:
    nibabel.save(nibabel.Nifti1Image(labels().T, np.eye(4)), tmp_path / "dseg.nii")
    request = request_for_source(tmp_path / "dseg.nii").with_source(labels=True)
    for profile, lighting in (("gles3", "headlight"), ("gles2-4096", "none")):
        own = replace(request, profile=load_profile(profile, Path()))
        build(own, tmp_path / f"{profile}.volpkg", Silent())
        programs = Package.open(tmp_path / f"{profile}.volpkg").manifest.programs
        assert {each.lighting for each in programs} == {lighting}


def test_a_classification_that_mixes_labels_is_refused(tmp_path) -> None:
    for name, wish in (("segments", '"preintegrated"'), ("few", '"palette"\n[lab.render]\npalette_entries = 255')):
        folder = tmp_path / name
        folder.mkdir()
        error = refusal(folder, labels(), more=f"[render]\nclassification = {wish}")
        assert (error.code, error.status) == ("VP3043", ExitStatus.SCENE)
    whole = tmp_path / "whole"
    whole.mkdir()
    scene = write_scene(
        whole, labels(), more='[render]\nclassification = "palette"\n[lab.render]\npalette_entries = 256'
    )
    scene_builds.built(scene, whole / "labels.volpkg")
    (palette,) = Package.open(whole / "labels.volpkg").manifest.palettes
    assert [index for index, entry in enumerate(palette.entries) if entry.extinction_per_mm] == [7]


@pytest.mark.parametrize("name", ["box", "gaussian", "lanczos3", "median", "maximum", "feature-preserving"])
def test_a_filter_that_makes_other_labels_is_refused(name, tmp_path) -> None:
    error = refusal(tmp_path, labels(), f'filter = "{name}"')
    assert error.code == "VP3024"
    assert "mode, mode-foreground, nearest" in error.remedy


def test_labels_that_codes_cannot_be_are_refused(tmp_path) -> None:
    negative, fraction = labels("int16"), labels("float32")
    negative[0, 0, 0] = -1
    fraction[0, 0, 0] = 2.5
    assert "go from -1 to 200" in refusal(tmp_path, negative).summary
    error = refusal(tmp_path, fraction)
    assert error.code == "VP3025"
    assert "a voxel is 0.5 away from any" in error.summary
    assert not list(tmp_path.glob("*.volpkg"))


@pytest.mark.long
def test_labels_above_255_get_codes_and_the_package_says_their_numbers(tmp_path) -> None:
    atlas = labels("uint16").astype(np.uint16)
    numbers = {0: 0, 3: 17, 7: 1002, 200: 14175}
    assert set(np.unique(atlas)) == set(numbers)
    for code, number in sorted(numbers.items(), reverse=True):
        atlas[atlas == code] = number
    atlas.tofile(tmp_path / "labels.raw")
    scene = tmp_path / "scene.toml"
    text = SCENE.format(dtype="uint16", pyramid="", more="[render]\npicture_size = 32")
    scene.write_text(text.replace("6.5", "1.5").replace("7.5", "2.5"))
    package = scene_builds.built(scene, tmp_path / "atlas.volpkg")
    (channel,) = package.manifest.channels
    assert channel.source.info.label_numbers == (0, 17, 1002, 14175)
    texels = ktx2.decode(package.read_bytes(channel_volume(package)), "v").data.reshape(SHAPE)
    np.testing.assert_array_equal(np.array(channel.source.info.label_numbers)[texels], atlas)
    verdict = validate(tmp_path / "atlas.volpkg", tmp_path / "report").verdict
    assert (verdict.failed, verdict.differing, verdict.unproved) == (0, (), ())


def many_labels(path: Path, count: int) -> Path:
    """Write a NIfTI label map of `count` columns of voxels."""
    volume = np.zeros(SHAPE, np.int16)
    volume[:, 1:, 1:] = np.minimum(np.arange(13 * 17).reshape(13, 17) * count // 220 + 1, count)
    volume[SHAPE[0] // 2 :] += np.where(volume[SHAPE[0] // 2 :] > 0, count, 0).astype(np.int16)
    image = nibabel.Nifti1Image(volume.T, np.diag([2.0, 2.0, 2.0, 1.0]))
    image.header.set_intent("label")
    nibabel.save(image, path)
    return path


@pytest.mark.long
def test_a_scan_of_more_than_255_labels_has_a_colour_for_each(tmp_path) -> None:
    request = request_for_source(many_labels(tmp_path / "atlas.nii", 150))
    small = request.scene.render.model_copy(update={"picture_size": 40})
    request = replace(request, scene=request.scene.model_copy(update={"render": small}))
    build(request, tmp_path / "atlas.volpkg", Silent())
    manifest = Package.open(tmp_path / "atlas.volpkg").manifest
    assert manifest.quantization is not None
    assert manifest.quantization.bits == 16
    assert manifest.statistics.maximum == 300
    function = manifest.transfer_functions[0]
    assert len({point.colour for point in function.points}) >= 250
    assert validate(tmp_path / "atlas.volpkg", tmp_path / "report").verdict.passed


def test_a_profile_without_16_bits_refuses_more_than_255_labels(tmp_path) -> None:
    path = many_labels(tmp_path / "atlas.nii", 150)
    with pytest.raises(VolprepError, match="a package for gles2-2048 holds 255 of them") as caught:
        plan_build(request_for_source(path, "gles2-2048"), Silent())
    assert caught.value.code == "VP3026"


def channel_volume(package: Package) -> str:
    return next(each.file for each in package.manifest.textures if (each.role, each.level) == ("volume", 0))


def test_more_labels_than_codes_are_refused(tmp_path) -> None:
    many = np.arange(np.prod(SHAPE), dtype=np.uint16).reshape(SHAPE)
    assert "2771 labels, from 1 to 2771" in refusal(tmp_path, many).summary


def test_other_codes_than_the_labels_are_refused(tmp_path) -> None:
    for wish in ("bits = 16", "window = [0, 9]"):
        error = refusal(tmp_path, labels(), more=f"[quantize]\n{wish}")
        assert error.code == "VP3025"


def test_a_channel_of_labels_stands_beside_one_of_values(tmp_path) -> None:
    values = np.random.default_rng(0).integers(0, 4000, SHAPE).astype(np.uint16)
    values.tofile(tmp_path / "values.raw")
    path = write_scene(tmp_path, labels(), 'filter = "mode"')
    text = path.read_text().replace("[source]", '[[source.channels]]\nname = "organs"')
    text = text.replace("[source.raw]", "[source.channels.raw]").replace(
        "[pyramid]",
        '[[source.channels]]\nname = "scan"\npath = "values.raw"\n[source.channels.raw]\nshape_zyx = [11, 14, 18]\n'
        'dtype = "uint16"\n[pyramid]',
    )
    path.write_text(
        text + '[[transfer]]\nname = "grey"\nchannel = "scan"\npoints = [{ value = 9.0, colour = "#ffffff", '
        "extinction_per_mm = 0.1 }]\n"
    )
    package = scene_builds.built(path, tmp_path / "labels.volpkg")
    assert package.manifest.quantization.window == (0.0, 255.0)
    assert np.array_equal(codes(package)[0], labels().reshape(-1))


@pytest.mark.long
def test_the_command_line_takes_a_filter_and_refuses_what_is_none(tmp_path) -> None:
    draft = tmp_path / "d.volpkg"
    scene = write_scene(tmp_path, labels())
    nearest = ("stage", "pyramid", draft, "--filter", "nearest")
    for command in (("import", scene, "-o", draft), ("stage", "quantize", draft), nearest):
        run = volprep(*command)
        assert run.returncode == 0, run.stderr
    assert '"filter": "nearest"' in (draft / "manifest.json").read_text()
    smooth = volprep("stage", "pyramid", draft, "--filter", "gaussian")
    assert smooth.returncode == ExitStatus.SCENE
    assert "VP3024" in smooth.stderr
    unknown = volprep("stage", "pyramid", draft, "--filter", "boxx")
    assert unknown.returncode == ExitStatus.SCENE
    assert "VP3003 [pyramid]: filter" in unknown.stderr
    assert "feature-preserving" in unknown.stderr
