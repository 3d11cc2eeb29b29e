"""Compressed levels: made only where pictures bear it, packed so that no block mixes tiles, drawn by the driver."""

from pathlib import Path

import numpy as np
import pytest
from field_samples import blocks_at, extinction_at, field_at
from phantom_scene import SHAPE_ZYX, write_phantom_scene
from plans import PlanOfOne, plan_of_one
from scene_builds import built, view_of

from volprep.parts.skip.visible import entry_extinctions
from volprep.render.renderer import Renderer
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep.validation.timing.full_rays import unskipped
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.check import check
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.reader import Package
from volprep_formats.package.tables import table_for
from volprep_formats.source import SourceInfo
from volprep_formats.textures import ktx2
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.mosaic import slices_of_mosaic

WISHES = ["none", "eac", "etc2", "astc-5x5"]
SKIP = (
    '[skip]\nkind = "distance"\nblock = 3\nranges = true\n[tolerance]\nrmse = 1.0\nmaximum = 1.0\n'
    "[render]\npicture_size = 32\n"
)


def source() -> np.ndarray:
    """Smoother than the phantom, whose noise no form at 2 bits a voxel bears; one end shows nothing."""
    voxels = 4 * smooth(SHAPE_ZYX).astype("<u2")
    voxels[..., :20] = 160
    return voxels


def scene_with(folder: Path, wish: str) -> Path:
    path = write_phantom_scene(folder, "gles3-astc")
    source().tofile(folder / "phantom.raw")
    text = path.read_text().replace("[pyramid]", f"{SKIP}\n[quantize]\nbits = 8\n\n[pyramid]")
    # A ramp: over a jump any error of a voxel is the whole jump, and no form is taken.
    text = text.replace("value = 700.0", "value = 400.0", 1)
    path.write_text(f'crop = "none"\n{text}\n[textures]\ncompression = "{wish}"\n')
    return path


@pytest.fixture(scope="module")
def packages(tmp_path_factory) -> dict[str, Package]:
    found = {}
    for wish in WISHES:
        folder = tmp_path_factory.mktemp(wish)
        found[wish] = built(scene_with(folder, wish), folder / "phantom.volpkg")
    return found


def volumes(package: Package):
    return [texture for texture in package.manifest.textures if texture.role == "volume"]


@pytest.mark.long
@pytest.mark.parametrize("wish", WISHES[1:])
def test_a_compressed_package_is_sound_and_names_its_encoder(packages: dict[str, Package], wish: str) -> None:
    package = packages[wish]
    assert check(package.path) == []
    for texture in volumes(package):
        assert texture.format in BLOCKS
        assert texture.encoder is not None
        assert texture.encoder.startswith("astc-encoder-py" if wish.startswith("astc") else "etcpak")
        image = ktx2.decode(package.read_bytes(texture.file), texture.file)
        assert image.format == texture.format


@pytest.mark.parametrize("wish", WISHES[1:])
def test_levels_decode_to_nearly_what_they_were(packages: dict[str, Package], wish: str) -> None:
    manifest = packages[wish].manifest
    quantization = manifest.quantization
    found = quantization.slope * 255 * level_texels(packages[wish], 0) + quantization.intercept
    error = found - np.clip(source(), *quantization.window)
    # Of values from 152 to 872; of etc2 four slices share a block.
    limit = {"eac": 10.0, "etc2": 45.0, "astc-5x5": 20.0}[wish]
    assert np.sqrt(np.mean(error**2)) < limit


@pytest.mark.parametrize("wish", WISHES[1:])
def test_the_driver_draws_what_is_decoded(packages: dict[str, Package], wish: str) -> None:
    plain, compressed = packages["none"], packages[wish]
    grid = plain.manifest.grid
    view = view_of(grid, "anterior-left")
    pictures = []
    for package in (plain, compressed):
        with Renderer(package) as renderer:
            pictures.append(renderer.render(view, (96, 96)))
    error = pictures[1] - pictures[0]
    assert pictures[0][..., 3].max() > 0.5
    # Misplaced tiles give 0.1 and more.
    assert np.sqrt(np.mean(error**2)) < {"eac": 0.01, "etc2": 0.05, "astc-5x5": 0.015}[wish]


@pytest.mark.parametrize("wish", WISHES[1:])
def test_ranges_of_blocks_enclose_what_is_decoded(packages: dict[str, Package], wish: str) -> None:
    package = packages[wish]
    texels = level_texels(package, 0)
    (record,) = (each for each in package.manifest.skipping.ranges if each.level == 0)
    texture = next(each for each in package.manifest.textures if each.name == record.texture)
    held = ktx2.decode(package.read_bytes(texture.file), texture.file).data[0]
    low, high = np.split(slices_of_mosaic([held], texture.mosaic) / 255, 2)
    block = record.block
    for k, j, i in np.ndindex(record.blocks_zyx):
        # A block of B cells has B + 1 voxels along an axis.
        inside = texels[tuple(slice(n * block, n * block + block + 1) for n in (k, j, i))]
        # GPUs may round to 8 bits.
        assert low[k, j, i] <= max(inside.min() - 0.5 / 255, 0)
        assert high[k, j, i] >= min(inside.max() + 0.5 / 255, 1)


def tables_of(package: Package):
    """Each skip table of level 0 as its shader reads it, with the extinction at the entries of the lookup table."""
    for table in package.manifest.skipping.tables:
        if table.level == 0:
            texture = next(each for each in package.manifest.textures if each.name == table.texture)
            held = ktx2.decode(package.read_bytes(texture.file), texture.file).data
            entries = held if texture.mosaic is None else slices_of_mosaic([held[0]], texture.mosaic)
            lookup = table_for(package.manifest.textures, "transfer", table.transfer, 0)
            texels = ktx2.decode(package.read_bytes(lookup.file), lookup.file).data[0]
            yield table, entries.astype(np.int64), entry_extinctions(lookup, texels)


@pytest.mark.parametrize("wish", WISHES[1:])
def test_no_visible_sample_of_what_is_decoded_lies_in_a_skipped_block(packages: dict[str, Package], wish: str) -> None:
    package = packages[wish]
    decoded = level_texels(package, 0).astype(np.float64)
    rng = np.random.default_rng(WISHES.index(wish))
    found = 0
    for table, entries, extinction in tables_of(package):
        # GPUs may give 8 bits, rounded down, up or to the nearest.
        for rounding in (np.floor, np.ceil, np.rint, lambda texels: texels):
            rounded = rounding(decoded * 255) / 255
            position = rng.random((100_000, 3)) * decoded.shape
            visible = extinction_at(extinction, field_at(rounded, position)) > 0
            seen = blocks_at(position[visible], decoded.shape, table.block, entries.shape)
            assert (entries[tuple(seen.T)] == 0).all()
            other = np.clip(seen + rng.integers(-6, 7, seen.shape), 0, np.array(entries.shape) - 1)
            assert (entries[tuple(other.T)] <= np.abs(other - seen).max(axis=1)).all()
            found += int(visible.sum())
        assert (entries > 0).any()
    assert found > 50_000


def test_tables_of_the_codes_before_compression_would_hide_what_is_decoded(packages: dict[str, Package]) -> None:
    """What the proof proves against."""
    decoded = level_texels(packages["etc2"], 0).astype(np.float64)
    lost = 0
    for (table, _, extinction), (_, of_codes, _) in zip(
        tables_of(packages["etc2"]), tables_of(packages["none"]), strict=True
    ):
        position = np.random.default_rng(5).random((400_000, 3)) * decoded.shape
        visible = extinction_at(extinction, field_at(decoded, position)) > 0
        seen = blocks_at(position[visible], decoded.shape, table.block, of_codes.shape)
        lost += int((of_codes[tuple(seen.T)] > 0).sum())
    assert lost > 0


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("wish", WISHES[1:])
def test_skipping_changes_no_picture_of_what_is_decoded(packages: dict[str, Package], wish: str) -> None:
    package = packages[wish]
    grid = package.manifest.grid
    for program in package.manifest.level_programs:
        plain = unskipped(package, program)
        for view in ("anterior-left", "superior"):
            camera = view_of(grid, view)
            pictures = []
            for each in (plain, package):
                with Renderer(each, level=program.levels[0], transfer=program.transfer) as renderer:
                    pictures.append(renderer.render(camera, (48, 48)))
            assert pictures[0].max() > 0.1
            assert np.abs(pictures[0] - pictures[1]).max() < 1e-6


def plan(voxels: np.ndarray, profile: str = "gles3-astc", **scene: object) -> PlanOfOne:
    points = [
        {"value": 40.0, "colour": "#204080", "extinction_per_mm": 0.0},
        {"value": 200.0, "colour": "#ffc080", "extinction_per_mm": 0.3},
    ]
    wanted = Scene.model_validate(
        {"name": "s", "source": {"path": "x"}, "transfer": [{"name": "a", "points": points}], "crop": "none", **scene}
    )
    info = SourceInfo(format="raw", grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)), stored_type=voxels.dtype.name)
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    return plan_of_one(wanted, load_profile(profile, Path()), info, gauge.result("0" * 64))


def smooth(shape=(20, 50, 61)) -> np.ndarray:
    z, y, x = (np.arange(n) for n in shape)
    field = 128 + 90 * np.sin(z / 5)[:, None, None] * np.cos(y / 9)[None, :, None] * np.sin(x / 11)
    return np.rint(field).astype(np.uint8)


def compression_items(decided: PlanOfOne) -> list[PlanItem]:
    return [item for item in decided.items if item.name.startswith(("textures as", "compressed textures"))]


def test_without_a_wish_nothing_is_compressed_and_nothing_is_said() -> None:
    decided = plan(smooth())
    assert decided.volumes[0].format == "r8unorm"
    assert compression_items(decided) == []


def test_auto_takes_the_smallest_form_that_pictures_bear() -> None:
    decided = plan(smooth(), textures={"compression": "auto"})
    kept = [item for item in compression_items(decided) if item.kept]
    assert [item.name for item in kept] == [f"textures as {decided.volumes[0].format}"]
    assert "bits a voxel; it changes rays through patches of the scan by RMSE" in kept[0].reason
    assert all(volume.format == decided.volumes[0].format for volume in decided.volumes)


def test_noise_that_no_form_keeps_is_not_compressed() -> None:
    noise = np.random.default_rng(3).integers(0, 256, (12, 40, 40)).astype(np.uint8)
    tolerance = {"rmse": 0.001, "maximum": 0.01}
    decided = plan(noise, textures={"compression": "auto"}, tolerance=tolerance, quantize={"bits": 8})
    assert decided.volumes[0].mosaic is None
    items = compression_items(decided)
    assert len(items) == 5  # all that are smaller than a byte a voxel
    assert not any(item.kept for item in items)
    assert all("not within half of the tolerance" in item.reason for item in items)


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        ({"quantize": {"bits": 16}}, "values have 16 bits"),
        ({"render": {"classification": "preclassified"}}, "classified voxels are 3D textures"),
    ],
)
def test_what_no_form_keeps_is_left_out_with_the_reason(scene: dict, why: str) -> None:
    (item,) = compression_items(plan(smooth(), textures={"compression": "eac"}, **scene))
    assert not item.kept
    assert why in item.reason


def test_auto_without_a_format_in_the_profile_is_left_out() -> None:
    (item,) = compression_items(plan(smooth(), "gles2-2048", textures={"compression": "auto"}))
    assert item.reason == "profile gles2-2048 has no compressed format of linear values"


def test_a_format_that_the_profile_has_not_is_an_error() -> None:
    with pytest.raises(
        VolprepError, match=r"VP3070 textures.compression astc-6x6 needs textures of format astc-6x6-unorm"
    ):
        plan(smooth(), "gles3", textures={"compression": "astc-6x6"})


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("wish", ["eac", "astc-5x5", "astc-6x6", "astc-8x8"])
def test_tiles_begin_with_blocks_of_their_own(wish: str) -> None:
    tolerance = {"rmse": 1.0, "maximum": 1.0}
    for gutter in (0, 1):
        decided = plan(smooth(), textures={"compression": wish}, mosaic={"gutter": gutter}, tolerance=tolerance)
        for volume in decided.volumes:
            size = BLOCKS[volume.format].size
            assert [pitch % size for pitch in volume.mosaic.pitch_yx] == [0, 0]
            least = (n + 2 * gutter for n in volume.mosaic.tile_shape_yx)
            assert all(0 <= pitch - n < size for pitch, n in zip(volume.mosaic.pitch_yx, least, strict=True))


def test_uncompressed_twins_need_no_padding() -> None:
    assert plan(smooth(), "gles2-2048").volumes[0].mosaic.padding_yx == (0, 0)
