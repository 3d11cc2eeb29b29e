"""Volumes in colour: what channels and texels hold, what is drawn, and what is refused."""

from pathlib import Path

import nibabel
import numpy as np
import pytest
import tifffile
from colour_scene import LARGEST_PER_MM, SHAPE_ZYX, ball, waves, write_colour_scene, write_pictures
from judged import validate
from scene_builds import built, planned, view_of

from volprep.lab.ablation.measure import measure_ablation
from volprep.lab.curves.measure import measure_curves
from volprep.pipeline.build import build
from volprep.pipeline.colour_look import in_colour
from volprep.pipeline.look import look_at, picture
from volprep.pipeline.prepare import prepare
from volprep.pipeline.remarks import warnings
from volprep.plan.item_kinds import BEYOND
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request, request_for_source
from volprep.scene.scene import Scene, load_scene
from volprep.validation.subjects.scan import find_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.rules import contradictions
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import ColourChannel, SourceSpec
from volprep_formats.srgb import linear_of_srgb, srgb_of_linear
from volprep_formats.textures import ktx2

PARTS = ("red", "green", "blue", "opacity")

pytestmark = pytest.mark.usefixtures("kept_workers")


def channel(path: Path, part: str, opacity_of: str = "alpha", **more: object) -> np.ndarray:
    """One channel of pictures, from 0 to 1."""
    wanted = ColourChannel(part=part, opacity_of=opacity_of, shares=((0.0, 0.0), (1.0, 1.0)), **more)
    with open_source(SourceSpec(path=str(path), colour=wanted), Path(), Silent()) as source:
        info = source.info
        assert (info.stored_type, info.slope, info.intercept) == ("uint16", 1 / 65535, 0.0)
        return source.read_slab(0, info.grid.shape_zyx[0]) / 65535


def light_of(pixels: np.ndarray) -> np.ndarray:
    """Premultiplied linear light and alpha of sRGB bytes [..., RGBA], pixel by pixel."""
    light = np.vectorize(linear_of_srgb)(pixels[..., :3] / 255)
    alpha = pixels[..., 3:] / 255
    return np.concatenate([light * alpha, alpha], axis=-1)


def test_channels_are_premultiplied_linear_light_and_extinction(tmp_path: Path) -> None:
    write_pictures(tmp_path / "ball.tif", ball())
    wanted = light_of(ball())
    for index, part in enumerate(PARTS):
        found = channel(tmp_path / "ball.tif", part)
        assert np.abs(found - wanted[..., index]).max() <= 0.5 / 65535


@pytest.mark.parametrize(
    ("opacity_of", "expected"),
    [
        ("luminance", 0.299 * 0.2 + 0.587 * 0.4 + 0.114 * 0.8),
        ("red", 0.2),
        ("green", 0.4),
        ("blue", 0.8),
        ("background", np.sqrt((0.2**2 + 0.4**2 + 0.2**2) / 3)),
    ],
)
def test_extinction_follows_the_number_that_the_scene_names(tmp_path: Path, opacity_of: str, expected: float) -> None:
    write_pictures(tmp_path / "one.tif", np.full((2, 3, 4, 3), (51, 102, 204), np.uint8))
    more = {"background": (0.0, 0.0, 1.0)} if opacity_of == "background" else {}
    found = channel(tmp_path / "one.tif", "opacity", opacity_of, **more)
    assert np.abs(found - expected).max() <= 0.5 / 65535


def test_alpha_multiplies_an_extinction_that_follows_something_else(tmp_path: Path) -> None:
    write_pictures(tmp_path / "one.tif", np.full((2, 3, 4, 4), (51, 102, 204, 128), np.uint8))
    assert channel(tmp_path / "one.tif", "opacity", "red") == pytest.approx(0.2 * 128 / 255, abs=1e-5)


def test_colours_that_are_multiplied_by_alpha_give_what_straight_ones_give(tmp_path: Path) -> None:
    straight = np.full((2, 3, 4, 4), (200, 100, 50, 128), np.uint16) * 257
    multiplied = straight.copy()
    multiplied[..., :3] = np.rint(straight[..., :3] * (128 / 255))
    write_pictures(tmp_path / "straight.tif", straight)
    write_pictures(tmp_path / "multiplied.tif", multiplied, alpha="assocalpha")
    for part in PARTS:
        one, other = (channel(tmp_path / f"{name}.tif", part) for name in ("straight", "multiplied"))
        assert np.abs(one - other).max() < 5e-5


def test_pictures_of_16_bits_keep_their_bits(tmp_path: Path) -> None:
    pixels = np.full((2, 3, 4, 3), (12345, 23456, 34567), np.uint16)
    write_pictures(tmp_path / "wide.tif", pixels)
    assert channel(tmp_path / "wide.tif", "green", "blue") == pytest.approx(
        linear_of_srgb(23456 / 65535) * 34567 / 65535, abs=1e-5
    )


def test_ome_tiff_and_nifti_give_what_pictures_give(tmp_path: Path) -> None:
    pixels = ball()
    write_pictures(tmp_path / "ball.tif", pixels)
    metadata = {"axes": "ZYXS", "PhysicalSizeX": 2.0, "PhysicalSizeY": 2.0, "PhysicalSizeZ": 3.0}
    tifffile.imwrite(
        tmp_path / "ball.ome.tif", pixels, photometric="rgb", extrasamples=["unassalpha"], metadata=metadata
    )
    rgba = np.dtype([(name, np.uint8) for name in "RGBA"])
    voxels = np.ascontiguousarray(pixels.transpose(2, 1, 0, 3)).view(rgba)[..., 0]
    nibabel.save(nibabel.Nifti1Image(voxels, np.diag([-0.75, -1.0, 1.5, 1.0])), tmp_path / "ball.nii.gz")
    for part in PARTS:
        wanted = channel(tmp_path / "ball.tif", part)
        assert np.array_equal(channel(tmp_path / "ball.ome.tif", part), wanted)
        assert np.array_equal(channel(tmp_path / "ball.nii.gz", part), wanted)


def test_a_volume_of_numbers_has_no_colours(tmp_path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(np.zeros((3, 4, 5), np.uint8), np.eye(4)), tmp_path / "grey.nii")
    tifffile.imwrite(tmp_path / "grey.ome.tif", np.zeros((3, 4, 5), np.uint8), metadata={"axes": "ZYX"})
    for name in ("grey.nii", "grey.ome.tif"):
        with pytest.raises(VolprepError, match="VP1290"):
            channel(tmp_path / name, "red", "luminance")


BAD = {
    "no alpha": (np.zeros((2, 3, 4, 3), np.uint8), "alpha", "no alpha"),
    "grey": (np.zeros((2, 3, 4), np.uint8), "luminance", "1 colour channel"),
    "too bright": (np.full((2, 3, 4, 3), 1.5, np.float32), "luminance", "outside of 0 to 1"),
    "not a number": (np.full((2, 3, 4, 3), np.nan, np.float32), "luminance", "NaN"),
}


@pytest.mark.parametrize("name", BAD)
def test_pictures_that_are_no_colour_volume_are_refused(tmp_path: Path, name: str) -> None:
    import tifffile

    pixels, opacity_of, said = BAD[name]
    photometric = "rgb" if pixels.ndim == 4 else "minisblack"
    tifffile.imwrite(tmp_path / "bad.tif", pixels, photometric=photometric)
    with pytest.raises(VolprepError, match=said) as error:
        channel(tmp_path / "bad.tif", "red", opacity_of)
    assert error.value.code == "VP1290"


def test_a_grey_picture_among_coloured_ones_is_refused(tmp_path: Path) -> None:
    import tifffile

    for index in range(3):
        shape = (4, 5) if index == 1 else (4, 5, 3)
        tifffile.imwrite(tmp_path / f"s{index}.tif", np.zeros(shape, np.uint8))
    with pytest.raises(VolprepError, match="VP1163"):
        channel(tmp_path, "red", "luminance")


def texels_of(package: Package, level: int) -> np.ndarray:
    (texture,) = (each for each in package.manifest.textures if each.level == level)
    return np.asarray(ktx2.decode(package.read_bytes(texture.file), texture.file).data)


def cropped(package: Package, voxels: np.ndarray) -> np.ndarray:
    """The part of the pictures that level 0 holds."""
    source, grid = package.manifest.source.info.grid, package.manifest.grid
    start = np.rint((np.linalg.inv(source.world_from_index) @ [*grid.origin_mm_xyz, 1.0])[2::-1]).astype(int)
    return voxels[tuple(slice(a, a + n) for a, n in zip(start, grid.shape_zyx, strict=True))]


def means(voxels: np.ndarray, factors_zyx: tuple[int, int, int]) -> np.ndarray:
    """Means of blocks of voxels; at the end of an axis the last voxel is repeated."""
    padded = np.pad(
        voxels, [(0, -n % f) for n, f in zip(voxels.shape, factors_zyx, strict=False)] + [(0, 0)], mode="edge"
    )
    (z, y, x, _), (a, b, c) = padded.shape, factors_zyx
    return padded.reshape(z // a, a, y // b, b, x // c, c, 4).mean(axis=(1, 3, 5))


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    return built(write_colour_scene(tmp_path_factory.mktemp("ball")))


def test_texels_are_light_as_srgb_and_extinction(package: Package) -> None:
    wanted = cropped(package, light_of(ball()))
    wanted[..., :3] = srgb_of_linear(wanted[..., :3])
    assert {each.format for each in package.manifest.textures} == {"rgba8unorm-srgb"}
    # Half a code, and in the dark, where sRGB is 13 times as steep, what rounding to 16 bits leaves.
    assert np.abs(texels_of(package, 0) - wanted * 255).max() < 0.55


def test_levels_are_means_of_premultiplied_linear_light(package: Package) -> None:
    _, *coarser = package.manifest.levels
    assert {level.filter for level in coarser} == {"box"}
    for level in coarser:
        wanted = means(cropped(package, light_of(ball())), level.factors_zyx)
        wanted[..., :3] = srgb_of_linear(wanted[..., :3])
        assert np.abs(texels_of(package, level.index) - wanted * 255).max() < 0.6


def test_a_program_draws_all_four_channels_and_none_alone(package: Package) -> None:
    manifest = package.manifest
    assert {program.transfer for program in manifest.level_programs} == {"colour"}
    assert {program.classification for program in manifest.programs} == {"colour"}
    assert {texture.channels for texture in manifest.textures} == {PARTS}
    assert list(contradictions(manifest)) == []


def test_one_colour_looks_as_the_closed_form_says(tmp_path: Path) -> None:
    # Without sRGB textures: Mesa's software driver decodes sRGB by a polynomial, which is up to 0.0007 off.
    scene = write_colour_scene(tmp_path, "gles2-2048")
    write_pictures(tmp_path / "slices.tif", np.full((*SHAPE_ZYX, 4), (180, 90, 30, 204), np.uint8))
    package = built(scene)
    with Renderer(package, target="rgba32f") as renderer:
        grid = renderer.level.grid
        camera = view_of(grid, "anterior")
        middle = renderer.render(camera, (33, 33))[16, 16]
    codes = np.rint(light_of(np.array([180, 90, 30, 204])) * 255)
    opacity = 1.0 - np.exp(-LARGEST_PER_MM * codes[3] / 255 * grid.extent_mm_zyx[1])
    assert middle == pytest.approx([*(codes[:3] / codes[3] * opacity), opacity], abs=2e-5)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_a_volume_in_colour_is_validated(tmp_path: Path, profile: str) -> None:
    scene = write_colour_scene(tmp_path, profile, tables="[render]\npicture_size = 48\n")
    package = built(scene)
    report = validate(package.path, tmp_path / "report")
    assert report.verdict.passed
    assert {program.transfer for program in report.programs} == {"colour"}


@pytest.mark.parametrize(
    ("profile", "more", "warned"),
    [("gles3", "", 0), ("gles2-2048", "", 1), ("gles2-2048", "[tolerance]\nflip = 0.1\n", 0)],
)
def test_a_profile_without_srgb_warns_of_dark_colours(tmp_path: Path, profile: str, more: str, warned: int) -> None:
    plan = planned(write_colour_scene(tmp_path, profile, tables=more))
    assert sum("8 bits of linear light" in item.reason for item in plan.items if item.kind == BEYOND) == warned


REFUSED = {
    "[grid]\nsize = 8\n": "[grid]",
    "[bricks]\n": "[bricks]",
    "[proxy]\n": "[proxy]",
    "[normals]\n": "[normals]",
    '[render]\nlighting = "headlight"\n': 'render.lighting = "headlight"',
    '[lighting]\nbaked = "occlusion"\n': 'lighting.baked = "occlusion"',
    '[textures]\ncompression = "etc2"\n': 'textures.compression = "etc2"',
    "[textures]\nmipmaps = true\n": "textures.mipmaps",
    '[lab.textures]\nchannels = "apart"\n': "channels in textures of their own",
    "[skip]\nranges = true\n": "skip.ranges",
}


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("tables", REFUSED)
def test_what_colour_does_not_support_is_refused_before_anything_is_made(tmp_path: Path, tables: str) -> None:
    scene = write_colour_scene(tmp_path, tables=tables)
    with pytest.raises(VolprepError) as error:
        planned(scene)
    assert (error.value.code, error.value.fields["what"]) == ("VP3046", REFUSED[tables])


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("top", "code", "said"),
    [
        ("editable = true", "VP3080", "classification colour"),
        ('segments = { source = "organs.nii" }', "VP3003", "segments"),
        ("fidelity = true", "VP3046", "fidelity"),
        ("together = {}", "VP3003", "together"),
        ("quantize = { bits = 8 }", "VP3003", "quantize"),
        ('render = { classification = "lookup" }', "VP3003", "render.classification"),
    ],
)
def test_settings_that_a_colour_decides_are_refused(tmp_path: Path, top: str, code: str, said: str) -> None:
    scene = write_colour_scene(tmp_path, top=top)
    with pytest.raises(VolprepError, match=said) as error:
        planned(scene)
    assert error.value.code == code


@pytest.mark.parametrize("measure", [measure_curves, measure_ablation])
def test_choices_of_a_colour_are_not_measured(package: Package, tmp_path: Path, measure) -> None:
    with pytest.raises(VolprepError, match="VP3046"):
        measure(package.manifest, find_scan(package.path, None), tmp_path, Silent())


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('serie = "1.2"', "source.serie: unknown key, perhaps series is meant"),
        ("stack = { spacing_zyx = [1.0, 1.0, 1.0] }", "source.stack.spacing_zyx: unknown key, perhaps spacing_mm_zyx"),
        ("extinction = 'alhpa'", "colour.extinction: Input should be 'alpha'"),
        ("extinctoin = 'alpha'", "colour.extinctoin: unknown key, perhaps extinction is meant"),
        ("volume = -1", "source.volume: Input should be greater than"),
    ],
)
def test_a_wrong_key_is_named_as_it_was_written(tmp_path: Path, line: str, said: str) -> None:
    scene = write_colour_scene(tmp_path)
    kept = [each for each in scene.read_text().splitlines() if not each.startswith(line.split(maxsplit=1)[0] + " ")]
    kept.insert(kept.index("[colour]" if line.startswith("extinct") else "[source]") + 1, line)
    scene.write_text("\n".join(kept))
    with pytest.raises(VolprepError) as error:
        load_scene(scene)
    assert str(error.value.fields["problems"]).startswith(said)
    assert "channels" not in str(error.value)


def test_a_colour_without_its_table_is_refused(tmp_path: Path) -> None:
    scene = write_colour_scene(tmp_path, tables='[render]\nclassification = "colour"\n')
    text = scene.read_text()
    points = '[[transfer]]\nname = "a"\npoints = [{ value = 0.0, colour = "#ffffff", extinction_per_mm = 1.0 }]\n'
    start, end = text.index("[colour]"), text.index("[render]")
    scene.write_text(text[:start] + points + text[end:])
    with pytest.raises(VolprepError, match="needs the table") as error:
        load_scene(scene)
    assert error.value.code == "VP3003"


def test_another_source_takes_the_place_of_all_four_channels(tmp_path: Path) -> None:
    request = load_request(write_colour_scene(tmp_path), source=tmp_path / "other.tif")
    assert {each.path for each in request.scene.source.channels} == {str(tmp_path / "other.tif")}


def test_stacks_of_slices_have_no_colours(tmp_path: Path) -> None:
    with pytest.raises(VolprepError, match="VP1244"):
        planned(write_colour_scene(tmp_path, "gles1"))


def test_a_scene_in_colour_is_the_same_when_it_is_read_again(tmp_path: Path) -> None:
    scene = load_scene(write_colour_scene(tmp_path))
    assert Scene.model_validate_json(scene.model_dump_json()) == scene


def looked_at(path: Path) -> Scene:
    """The scene that a scan without one gets."""
    return prepare(request_for_source(path)).scene


def photographs(folder: Path, background: tuple[int, int, int]) -> Path:
    """Pictures of a ball on a background, with a little noise."""
    pixels = ball().astype(float)
    alpha = pixels[..., 3:] / 255
    mixed = alpha * pixels[..., :3] + (1 - alpha) * np.array(background)
    noise = np.random.default_rng(2).normal(0.0, 2.0, mixed.shape)
    write_pictures(folder / "photos.tif", np.clip(np.rint(mixed + noise), 0, 255).astype(np.uint8))
    return folder / "photos.tif"


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("background", [(20, 40, 220), (250, 250, 250), (0, 0, 0)])
def test_the_margin_of_photographs_without_a_scene_is_left_out(tmp_path: Path, background) -> None:
    scene = looked_at(photographs(tmp_path, background))
    assert scene.colour is not None
    found = np.array([int(scene.colour.background[i : i + 2], 16) for i in (1, 3, 5)])
    assert np.abs(found - background).max() <= 3
    assert "volume in colour" in scene.recognised
    with open_source(scene.source.channels[3], Path(), Silent()) as source:
        shares = source.read_slab(0, source.info.grid.shape_zyx[0]) / 65535
    is_inside = ball()[..., 3] == 255
    assert (shares[ball()[..., 3] == 0] > 0).mean() < 0.01
    assert (shares[is_inside] > 0.5).mean() > 0.9


def test_outlines_of_photographs_are_less_solid_than_what_they_surround(tmp_path: Path) -> None:
    # Of pixels that are half background, dark ones and bright ones would lie in rings.
    alpha = np.clip(ball()[..., 3:] / 255 * 3 - 1, 0.0, 1.0)
    write_pictures(tmp_path / "ball.tif", np.rint(alpha * np.array([200, 150, 100])).astype(np.uint8))
    scene = looked_at(tmp_path / "ball.tif")
    with open_source(scene.source.channels[3], Path(), Silent()) as source:
        shares = source.read_slab(0, source.info.grid.shape_zyx[0]) / 65535
    half = (alpha[..., 0] > 0.4) & (alpha[..., 0] < 0.6)
    assert 0.1 < shares[half].mean() < 0.6
    assert shares[alpha[..., 0] == 1.0].min() > 0.95


def test_alpha_of_pictures_without_a_scene_is_their_extinction(tmp_path: Path) -> None:
    write_pictures(tmp_path / "ball.tif", ball())
    assert looked_at(tmp_path / "ball.tif").colour.extinction == "alpha"


def test_pictures_without_a_margin_of_one_colour_follow_luminance(tmp_path: Path) -> None:
    write_pictures(tmp_path / "waves.tif", waves()[..., :3])
    assert looked_at(tmp_path / "waves.tif").colour.extinction == "luminance"


def test_pictures_of_the_colour_of_their_margin_alone_follow_luminance(tmp_path: Path) -> None:
    dim = np.random.default_rng(4).integers(20, 86, (*SHAPE_ZYX, 1))
    write_pictures(tmp_path / "dim.tif", (dim * np.array([1.0, 0.9, 0.8])).astype(np.uint8))
    scene = looked_at(tmp_path / "dim.tif")
    assert scene.colour.extinction == "luminance"
    with open_source(scene.source.channels[3], Path(), Silent()) as source:
        assert (source.read_slab(0, SHAPE_ZYX[0]) > 0).mean() > 0.9


def test_colours_that_begin_after_the_first_slice_are_kept(tmp_path: Path) -> None:
    pixels = np.zeros((*SHAPE_ZYX, 3), np.uint8)
    pixels[4:, 4:-4, 4:-4] = (200, 120, 30)
    write_pictures(tmp_path / "late.tif", pixels)
    build(request_for_source(tmp_path / "late.tif"), tmp_path / "late.volpkg", Silent())
    package = Package.open(tmp_path / "late.volpkg")
    assert [channel.name for channel in package.manifest.channels] == list(PARTS)


def test_a_look_at_pictures_shows_their_colours(tmp_path: Path) -> None:
    looked = look_at(request_for_source(photographs(tmp_path, (20, 40, 220))))
    assert "volume in colour" in looked.recognised
    shown = picture(looked)
    assert (np.ptp(shown[:256], axis=-1) > 40).mean() > 0.02
    assert shown[0, 0].max() == 0


def test_errors_that_are_not_about_colours_stay(tmp_path: Path) -> None:
    request = request_for_source(photographs(tmp_path, (20, 40, 220)))
    scene = request.scene.with_source(request.scene.source.model_copy(update={"rgb": "red"}))
    refused = VolprepError("VP1164", path="x", what="colours")
    with pytest.raises(VolprepError) as error:
        in_colour(scene, refused)
    assert error.value is refused


@pytest.mark.parametrize(("kind", "is_colour"), [("RGBA-color", True), ("vector", True), ("list", False)])
def test_a_list_of_four_volumes_is_not_taken_for_colours(tmp_path: Path, kind: str, is_colour: bool) -> None:
    lines = ["NRRD0004", "type: uint16", "dimension: 4", "sizes: 4 5 6 7", f"kinds: {kind} domain domain domain"]
    voxels = np.random.default_rng(2).integers(0, 900, (7, 6, 5, 4)).astype("<u2")
    head = "\n".join([*lines, "encoding: raw", "endian: little", "", ""]).encode()
    (tmp_path / "four.nrrd").write_bytes(head + voxels.tobytes())
    request = request_for_source(tmp_path / "four.nrrd")
    if is_colour:
        assert "volume in colour" in look_at(request).recognised
    else:
        with pytest.raises(VolprepError, match=r"VP1101 .* 4 values for each voxel.* --volume N"):
            look_at(request)


def test_a_colour_image_without_a_place_is_refused_for_its_place(tmp_path: Path) -> None:
    from pydicom.data import get_testdata_file

    image = Path(str(get_testdata_file("examples_rgb_color.dcm")))
    with pytest.raises(VolprepError, match=r"VP1036 .* ImageOrientationPatient is missing"):
        look_at(request_for_source(image))


def test_a_transparent_volume_is_told_in_one_line(tmp_path: Path) -> None:
    voxels = np.zeros((3, 4, 5), [("R", "u1"), ("G", "u1"), ("B", "u1"), ("A", "u1")])
    voxels["R"] = 200
    nibabel.save(nibabel.Nifti1Image(voxels, np.eye(4)), tmp_path / "clear.nii")
    manifest = build(request_for_source(tmp_path / "clear.nii"), tmp_path / "clear.volpkg", Silent())
    told = list(warnings(manifest))
    assert len(told) == 1
    assert "no voxel absorbs light" in told[0]
