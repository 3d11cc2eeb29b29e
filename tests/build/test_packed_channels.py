"""Channels in the components of one texture: what it holds, what is drawn from it, and when there is none."""

from pathlib import Path

import numpy as np
import pytest
import scene_builds
from channel_scene import channels, write_channel_scene
from judged import validate
from scene_builds import view_of

from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.truth.decoded import level_volume
from volprep.validation.timing.full_rays import uncut
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.readers.volpkg import open_level
from volprep_formats.textures import ktx2

AIR = """
[[transfer]]
name = "air"
channel = "air"
points = [
    { value = 200.0, colour = "#00ff00", extinction_per_mm = 0.0 },
    { value = 900.0, colour = "#80ff80", extinction_per_mm = 0.4 },
]
"""
HAIR = """
[[source.channels]]
name = "hair"
path = "air.raw"
raw = { shape_zyx = [17, 22, 27], dtype = "int16", spacing_mm_zyx = [1.5, 1.0, 0.75] }
"""
FORMATS = {
    ("gles3", 2): ("rg8unorm", "3d"),
    ("gles3", 3): ("rgb8unorm", "3d"),
    ("gles2-2048", 2): ("rg8unorm", "2d"),
    ("gles2-2048", 4): ("rgba8unorm", "2d"),
}


def scene_of(folder: Path, profile: str = "gles3", count: int = 2, wish: str = "packed", extra: str = "") -> Path:
    """The small scene, with so many channels drawn."""
    scene = write_channel_scene(folder, profile, "box")
    text = scene.read_text().replace("[render]", f'[lab.textures]\nchannels = "{wish}"\n[render]')
    if count >= 3:
        text += AIR
    if count == 4:
        text = text.replace("\n[pyramid]", f"{HAIR}\n[pyramid]")
        text += AIR.replace('"air"', '"hair"').replace("200.0", "150.0")
    scene.write_text(text + extra)
    return scene


def built(folder: Path, *arguments, **named) -> Package:
    return scene_builds.built(scene_of(folder, *arguments, **named), folder / "a.volpkg")


@pytest.fixture(scope="module", params=FORMATS, ids=lambda each: f"{each[0]}-{each[1]}")
def package(request, tmp_path_factory) -> Package:
    return built(tmp_path_factory.mktemp("packed"), *request.param)


@pytest.fixture(scope="module")
def apart(tmp_path_factory):
    """The same package with textures apart, by its profile and number of channels."""
    made: dict[tuple[str, int], Package] = {}

    def give(package: Package) -> Package:
        key = package.manifest.profile.name, len(package.manifest.channels)
        if key not in made:
            made[key] = built(tmp_path_factory.mktemp("apart"), *key, wish="apart")
        return made[key]

    return give


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> Package:
    return built(tmp_path_factory.mktemp("two"))


def volumes(manifest):
    return [texture for texture in manifest.textures if texture.role == "volume"]


def assert_same_pictures(package: Package, other: Package, *, exactly: bool = False) -> None:
    for transfer in package.manifest.transfer_functions:
        pictures = []
        for each in (package, other):
            with Renderer(each, transfer=transfer.name, target="rgba32f") as renderer:
                grid = renderer.level.grid
                view = view_of(grid, "anterior-left")
                pictures.append(renderer.render(view, (24, 24)))
        # Other layouts round the place of a texel otherwise.
        np.testing.assert_allclose(*pictures, atol=0 if exactly else 1e-4)
        assert pictures[0][..., 3].max() > 0.1


class TestWhatItHolds:
    @pytest.mark.long(keep=1)
    def test_a_level_is_one_texture_with_a_component_for_each_channel(self, package) -> None:
        manifest = package.manifest
        held = tuple(channel.name for channel in manifest.channels)
        texel, dimension = FORMATS[manifest.profile.name, len(held)]
        assert len(volumes(manifest)) == len(manifest.levels)
        for texture in volumes(manifest):
            assert texture.channels == held
            assert (texture.format, texture.dimension) == (texel, dimension)
            assert ktx2.decode(package.read_bytes(texture.file), texture.file).format == texel

    @pytest.mark.long(keep=1)
    def test_every_channel_has_the_values_that_it_has_apart(self, package, apart) -> None:
        alone = channel_packages(apart(package))
        for name, part in channel_packages(package).items():
            for level in part.manifest.levels:
                found, expected = level_volume(part, level.index), level_volume(alone[name], level.index)
                np.testing.assert_array_equal(found.stored, expected.stored)
                assert (found.slope, found.intercept) == (expected.slope, expected.intercept)

    @pytest.mark.long(keep=1)
    def test_it_takes_the_bytes_that_its_channels_take_apart(self, package, apart) -> None:
        def texels(manifest) -> int:
            files = {texture.file for texture in volumes(manifest)}
            return sum(record.size_bytes for record in manifest.files if record.path in files)

        mosaic = volumes(package.manifest)[0].mosaic
        # Headers of two files in place of one, and mosaics whose spare tiles there are once.
        slack = 2000 + (0 if mosaic is None else np.prod(mosaic.texture_shape_yx))
        assert abs(texels(package.manifest) - texels(apart(package).manifest)) < slack

    @pytest.mark.long(keep=1)
    def test_it_agrees_with_itself_and_each_file_is_of_one_item(self, package) -> None:
        assert check(package.path) == []
        planned = sorted(path for item in package.manifest.plan for path in item.files)
        assert planned == [record.path for record in package.manifest.files]

    def test_a_level_is_read_and_exported_of_the_channel_that_is_chosen(self, package) -> None:
        with open_level(package.path, None, "bone") as source:
            expected = level_volume(channel_packages(package)["bone"], package.manifest.levels[0].index)
            np.testing.assert_array_equal(source.read_slab(2, 5), expected.stored[2:5])

    def test_verbs_make_the_package_that_build_makes(self, tmp_path) -> None:
        package = built(tmp_path)
        request = load_request(tmp_path / "tissues.toml")
        draft = import_draft(prepare(request), tmp_path / "d.volpkg", Silent()).draft
        for stage in plan_draft(draft, request.scene, request.profile, Silent()).stages[1:]:
            run_verb(tmp_path / "d.volpkg", stage, lambda scene: scene, Silent())
        assert Package.open(tmp_path / "d.volpkg").manifest.files == package.manifest.files


class TestWhatItDraws:
    @pytest.mark.long(keep=1)
    def test_every_transfer_function_draws_the_picture_that_it_draws_apart(self, package, apart) -> None:
        assert_same_pictures(package, apart(package), exactly=True)

    @pytest.mark.long
    def test_it_validates_with_what_termination_costs_told_apart(self, tmp_path) -> None:
        package = built(tmp_path)
        report = validate(package.path, tmp_path / "r", picture_size=16)
        assert report.verdict.passed
        for part in channel_packages(package).values():
            for program in part.manifest.level_programs:
                assert uncut(part, program) is not None
                assert uncut(part, program.model_copy(update={"opacity_cutoff": 0.9})) is None

    @pytest.mark.long
    def test_a_mosaic_of_several_textures_with_gutters_draws_what_channels_apart_draw(self, tmp_path) -> None:
        profile = (Path(__file__).parents[2] / "volprep/scene/profiles/gles2-2048.toml").read_text()
        (tmp_path / "narrow.toml").write_text(profile.replace("size = 2048", "size = 64"))
        package = built(tmp_path, "narrow.toml", extra="[lab.mosaic]\ngutter = 1\n")
        texture = volumes(package.manifest)[0]
        assert (texture.mosaic.textures, texture.mosaic.components_per_voxel, texture.mosaic.slices_per_texel) == (
            3,
            2,
            1,
        )
        (tmp_path / "apart").mkdir()
        (tmp_path / "apart/narrow.toml").write_text((tmp_path / "narrow.toml").read_text())
        alone = built(tmp_path / "apart", "narrow.toml", wish="apart")
        assert volumes(alone.manifest)[0].mosaic.slices_per_texel == 4
        assert_same_pictures(package, alone)


class TestWhen:
    def item(self, scene: Path):
        plan = scene_builds.planned(scene)
        (found,) = [item for item in plan.items if item.name == "packed channels"]
        return found

    @pytest.mark.parametrize(
        ("changes", "says"),
        [
            ({"wish": "apart"}, "the scene keeps them apart"),
            ({"wish": "auto"}, "each program draws one channel"),
            ({"extra": "[quantize]\nbits = 16\n"}, "no profile has texels of 2 components of 16 bits"),
        ],
    )
    def test_channels_stay_apart_for_a_reason(self, tmp_path, changes, says) -> None:
        item = self.item(scene_of(tmp_path, **changes))
        assert not item.kept
        assert item.reason.startswith(says)
        assert item.size_bytes > 0

    def test_channels_that_do_not_fit_packed_stay_apart(self, tmp_path) -> None:
        whole = self.item(scene_of(tmp_path))
        assert whole.kept
        text = (Path(__file__).parents[2] / "volprep/scene/profiles/gles3.toml").read_text()
        room = whole.size_bytes // 2 + 5000
        (tmp_path / "small.toml").write_text(text.replace("268_435_456", str(room)))
        item = self.item(scene_of(tmp_path, "small.toml"))
        assert not item.kept
        assert "packed they do not fit" in item.reason
        assert str(room) in item.reason

    def test_levels_of_channels_that_are_labels_stay_apart(self, tmp_path) -> None:
        scene = scene_of(tmp_path)
        values = (channels()["bone"] > 500).astype("<i2")
        (tmp_path / "bone.raw").write_bytes(values.tobytes())
        text = scene.read_text().replace('filter = "box"\n', "")
        text = text.replace('path = "bone.raw"', 'path = "bone.raw"\nlabels = true', 1)
        text = text.replace("value = 300.0", "value = 0.0").replace("value = 900.0", "value = 1.0")
        scene.write_text(text)
        assert self.item(scene).reason == "labels are not filtered as values are"

    def test_compressed_channels_stay_apart(self, tmp_path) -> None:
        scene = scene_of(tmp_path)
        scene.write_text(scene.read_text().replace("[lab.textures]", '[textures]\ncompression = "eac"\n[lab.textures]'))
        assert self.item(scene).reason == "compressed texels hold one channel"
