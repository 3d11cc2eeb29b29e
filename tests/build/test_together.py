"""Several channels in one picture: what the program reads, what it draws, and when there is none."""

import re
from pathlib import Path

import numpy as np
import pytest
from channel_scene import channels, write_channel_scene
from judged import validate
from scene_builds import built, drawn, planned

from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.preview import preview_png
from volprep.scene.request import load_request
from volprep.scene.scene import load_scene
from volprep.validation.subjects.subject import DRAFT_TOLERANCE
from volprep.validation.timing.full_rays import uncut, unskipped
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channels import channel_views
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

TOGETHER = '\n[together]\nname = "body"\n'
WAYS = {"packed": ("gles3", "auto"), "apart": ("gles3", "apart"), "mosaic": ("gles2-2048", "auto")}
FLOAT32 = 2e-6
"""Sums of a hundred samples in another order."""


def scene_of(folder: Path, profile: str = "gles3", wish: str = "auto", extra: str = "") -> Path:
    scene = write_channel_scene(folder, profile, "box")
    text = scene.read_text().replace(
        "[render]", f'[lab.textures]\nchannels = "{wish}"\n[skip]\nkind = "none"\n[render]\nopacity_cutoff = 0.998'
    )
    scene.write_text(text + TOGETHER + extra)
    return scene


def changed(scene: Path, *changes: tuple[str, str]) -> Path:
    text = scene.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    scene.write_text(text)
    return scene


def picture(package: Package, transfer: str | None = None) -> np.ndarray:
    return drawn(package, "anterior-left", (24, 24), transfer=transfer, target="rgba32f")


@pytest.fixture(scope="module", params=WAYS.values(), ids=WAYS)
def package(request, tmp_path_factory) -> Package:
    return built(scene_of(tmp_path_factory.mktemp("together"), *request.param))


@pytest.fixture(scope="module")
def packed(tmp_path_factory) -> Package:
    return built(scene_of(tmp_path_factory.mktemp("packed")))


def of_picture(package):
    return [program for program in package.manifest.level_programs if program.transfer == "body"]


def transfers_of(package):
    picture = next(each for each in package.manifest.pictures if each.mixing == "sum")
    return tuple(medium.transfer for medium in picture.media)


class TestWhatItHolds:
    def test_the_manifest_names_the_picture_and_programs_that_draw_it(self, package) -> None:
        assert transfers_of(package) == ("red", "white")
        levels = sorted(level for program in of_picture(package) for level in program.levels)
        assert levels == [level.index for level in package.manifest.levels]
        assert check(package.path) == []

    def test_a_table_is_read_for_each_channel_and_texels_once_where_they_are_shared(self, package) -> None:
        by_name = {texture.name: texture for texture in package.manifest.textures}
        programs = {program.name: program for program in package.manifest.programs}
        for drawing in package.manifest.picture("body").drawings:
            read = [by_name[name] for name in drawing.textures]
            packed = any(len(t.channels) > 1 for t in package.manifest.textures)
            volumes = [("skin", "bone")] if packed else [("bone",), ("skin",)]
            assert sorted(each.channels for each in read if each.role == "volume") == volumes
            assert [each.transfer for each in read if each.role == "transfer"] == ["red", "white"]
            assert len(read) == len(volumes) + 2
            text = package.read_text(programs[drawing.program].fragment)
            assert len(re.findall(r"voxel_texel\(at\)|stored_value\w*\(at\)", text)) == len(volumes)

    def test_no_channel_alone_knows_of_it(self, package) -> None:
        for view in channel_views(package.manifest).values():
            assert all(program.transfer != "body" for program in view.level_programs)

    def test_each_file_is_of_one_item_of_the_plan(self, package) -> None:
        planned = sorted(path for item in package.manifest.plan for path in item.files)
        assert planned == [record.path for record in package.manifest.files]

    def test_verbs_make_the_package_that_build_makes(self, tmp_path, packed) -> None:
        request = load_request(scene_of(tmp_path))
        draft = import_draft(prepare(request), tmp_path / "d.volpkg", Silent()).draft
        for stage in plan_draft(draft, request.scene, request.profile, Silent()).stages[1:]:
            run_verb(tmp_path / "d.volpkg", stage, lambda scene: scene, Silent())
        assert Package.open(tmp_path / "d.volpkg").manifest == packed.manifest


class TestWhatItDraws:
    def test_it_is_the_picture_that_is_drawn_unless_another_is_named(self, packed) -> None:
        np.testing.assert_array_equal(picture(packed), picture(packed, "body"))
        assert np.abs(picture(packed) - picture(packed, "red")).max() > 0.05
        assert preview_png(packed) == packed.read_bytes("preview.png")

    def test_it_is_the_same_from_shared_texels_and_apart(self, tmp_path, packed) -> None:
        # The same values at the same places in the same order: not a bit differs.
        np.testing.assert_array_equal(picture(packed), picture(built(scene_of(tmp_path, "gles3", "apart"))))

    def test_opacities_of_channels_multiply_to_what_is_let_through(self, package) -> None:
        through = np.prod([1.0 - picture(package, name)[..., 3] for name in ("red", "white")], axis=0)
        # Rays stop at an opacity of 0.998.
        np.testing.assert_allclose(1.0 - picture(package)[..., 3], through, atol=0.002 + FLOAT32)

    def test_where_one_channel_alone_shows_something_it_is_its_picture(self, package) -> None:
        alone, both = picture(package, "red"), picture(package)
        unmixed = picture(package, "white")[..., 3] == 0
        assert unmixed.sum() > 30
        np.testing.assert_allclose(both[unmixed], alone[unmixed], atol=FLOAT32)

    @pytest.mark.long
    def test_a_channel_twice_at_half_extinction_is_the_channel_itself(self, tmp_path) -> None:
        scene = write_channel_scene(tmp_path)
        (tmp_path / "skin.raw").write_bytes(channels()["bone"].tobytes())
        head = scene.read_text().replace('dtype = "float32"', 'dtype = "int16"').partition("[[transfer]]")[0]
        functions = "".join(
            f'[[transfer]]\nname = "{name}"\nchannel = "{channel}"\npoints = [\n'
            f'{{ value = 300.0, colour = "#8080ff", extinction_per_mm = {extinction / 8} }},\n'
            f'{{ value = 900.0, colour = "#ffffff", extinction_per_mm = {extinction} }}]\n'
            for name, channel, extinction in (("a", "bone", 0.15), ("b", "skin", 0.15), ("whole", "bone", 0.3))
        )
        scene.write_text(head + functions + TOGETHER)
        package = built(scene)
        assert transfers_of(package) == ("a", "b")
        assert picture(package)[..., 3].max() > 0.9
        np.testing.assert_allclose(picture(package), picture(package, "whole"), atol=FLOAT32)

    @pytest.mark.long(keep=1)
    @pytest.mark.parametrize(
        "change",
        [
            ("[render]", '[lab.render]\npalette_entries = 256\n[render]\nclassification = "palette"'),
            ("[lab.textures]", "[textures]\nmipmaps = true\n[lab.textures]"),
        ],
        ids=["palette", "mipmaps"],
    )
    def test_palettes_and_mipmaps_draw_it_too(self, tmp_path, change) -> None:
        package = built(changed(scene_of(tmp_path), change))
        assert check(package.path) == []
        through = np.prod([1.0 - picture(package, name)[..., 3] for name in ("red", "white")], axis=0)
        np.testing.assert_allclose(1.0 - picture(package)[..., 3], through, atol=0.002 + FLOAT32)

    def test_the_order_of_the_channels_changes_nothing(self, tmp_path, packed) -> None:
        other = built(scene_of(tmp_path, extra='transfers = ["white", "red"]\n'))
        assert transfers_of(other) == ("white", "red")
        np.testing.assert_allclose(picture(packed), picture(other), atol=FLOAT32)

    @pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
    def test_what_all_channels_leave_empty_is_skipped_and_changes_nothing(self, tmp_path, profile) -> None:
        scene = changed(scene_of(tmp_path, profile), ('kind = "none"', 'kind = "distance"'))
        skips = built(scene)
        assert all("u_skip" in program.samplers for program in of_picture(skips))
        tables = [table for table in skips.manifest.skipping.tables if table.transfer == "body"]
        assert [table.level for table in tables] == [level.index for level in skips.manifest.levels]
        shares = {(each.transfer, each.level): each.empty_share for each in skips.manifest.skipping.tables}
        finest = tables[0].level
        assert 0.05 < shares["body", finest] <= min(shares["red", finest], shares["white", finest])
        (program,) = of_picture(skips)[:1]
        assert check(skips.path) == []
        plain = picture(unskipped(skips, program))
        np.testing.assert_allclose(picture(skips), plain, atol=FLOAT32)

    @pytest.mark.long
    def test_it_validates_against_the_sum_of_all_channels(self, packed, tmp_path) -> None:
        report = validate(packed.path, tmp_path / "r", picture_size=16)
        first = report.programs[0]
        assert report.verdict.passed
        assert [program.transfer for program in report.programs] == ["body", "red", "blue", "white"]
        assert max(view.truth_bound for view in first.views) <= DRAFT_TOLERANCE
        assert max(view.total.maximum for view in first.views) < 0.02
        assert first.sweep.breakdown.termination is not None
        page = (tmp_path / "r/index.html").read_text()
        assert re.findall(r'alt="Rendering of (\w+)"', page) == ["body", "red", "white"]

    def test_its_shader_without_termination_is_the_same_otherwise(self, package) -> None:
        (program,) = of_picture(package)[:1]
        without = uncut(package, program).read_text(program.fragment).splitlines()
        left_out = [line for line in package.read_text(program.fragment).splitlines() if line not in without]
        code = [line.strip() for line in left_out if not line.strip().startswith("//")]
        assert code[0].startswith("float least_transmittance = 0.002 * pow(")
        assert "if (transmittance < least_transmittance) {" in code
        assert len(code) <= 8


class TestWhatIsLeftOut:
    DARK = ("value = 300.0", "value = 3000.0"), ("value = 900.0", "value = 4000.0")

    def test_a_channel_that_shows_nothing_is_left_out_with_the_reason(self, tmp_path) -> None:
        air = '\n[[transfer]]\nname = "air"\nchannel = "air"\npoints = [{ value = 100.0, colour = "#00ff00", '
        air += 'extinction_per_mm = 0.0 }, { value = 900.0, colour = "#00ff00", extinction_per_mm = 0.4 }]\n'
        scene = changed(scene_of(tmp_path), *self.DARK, ("\n[together]", f"{air}\n[together]"))
        package = built(scene)
        assert transfers_of(package) == ("red", "air")
        (item,) = [item for item in package.manifest.plan if item.name == "body: channel bone"]
        assert not item.kept
        assert item.reason == "white shows none of its values, 0 to 1000"
        packed = {texture.channels for texture in package.manifest.textures if texture.role == "volume"}
        assert packed == {("skin", "air"), ("bone",)}

    def test_of_one_channel_that_shows_something_there_is_no_picture_of_several(self, tmp_path) -> None:
        package = built(changed(scene_of(tmp_path), *self.DARK))
        assert package.manifest.picture("body") is None
        (item,) = [item for item in package.manifest.plan if item.name == "body"]
        assert (item.kept, item.reason) == (False, "fewer than two channels show something: red")
        np.testing.assert_array_equal(picture(package), picture(package, "red"))

    @pytest.mark.long(keep=2)
    @pytest.mark.parametrize(
        ("changes", "says"),
        [
            ([('name = "body"', 'name = "body"\ntransfers = ["red", "blue"]')], "both draw channel skin"),
            ([("[render]", '[lighting]\nlight_mm = [0, 0, 900]\n[render]\nlighting = "phong"')], "from the viewer"),
            ([("[render]", '[lighting]\nnormals = "volume"\n[render]\nlighting = "headlight"')], "lighting.normals"),
            ([("[render]", '[render]\nclassification = "preintegrated"')], "classification is preintegrated"),
            ([('"gles3"', '"gles2-2048"'), ('channels = "auto"', 'channels = "apart"')], "the scene keeps them apart"),
            ([("[pyramid]", "[bricks]\n[pyramid]")], "levels are bricks"),
            ([('"gles3"', '"few.toml"'), ('channels = "auto"', 'channels = "apart"')], "3 textures"),
        ],
    )
    def test_what_cannot_be_drawn_together_is_refused(self, tmp_path, changes, says) -> None:
        few = (Path(__file__).parents[2] / "volprep/scene/profiles/gles3.toml").read_text()
        (tmp_path / "few.toml").write_text(few.replace("texture_units = 16", "texture_units = 3"))
        scene = changed(scene_of(tmp_path), *changes)
        with pytest.raises(VolprepError, match="VP1245") as error:
            planned(scene)
        assert says in str(error.value)

    def test_labels_are_not_drawn_together(self, tmp_path) -> None:
        scene = scene_of(tmp_path)
        (tmp_path / "bone.raw").write_bytes((channels()["bone"] > 500).astype("<i2").tobytes())
        scene = changed(scene, ("value = 300.0", "value = 0.0"), ("value = 900.0", "value = 1.0"))
        scene = changed(scene, ('filter = "box"\n', ""))
        scene.write_text(scene.read_text().replace('path = "bone.raw"', 'path = "bone.raw"\nlabels = true', 1))
        with pytest.raises(VolprepError, match=r"VP1245.*bone holds labels"):
            planned(scene)

    @pytest.mark.parametrize(
        ("old", "new", "says"),
        [
            ('name = "body"', 'name = "red"', "as a transfer function has"),
            ('name = "body"', 'transfers = ["red", "green"]', "names green"),
            ('name = "body"', 'transfers = ["red"]', "names one"),
            ('name = "body"', 'name = "Body"', "together.name"),
        ],
    )
    def test_scenes_that_cannot_be_are_refused(self, tmp_path, old, new, says) -> None:
        with pytest.raises(VolprepError, match="VP3003") as error:
            load_scene(changed(scene_of(tmp_path), (old, new)))
        assert says in str(error.value)

    def test_one_channel_is_nothing_to_draw_together(self, tmp_path) -> None:
        scene = tmp_path / "one.toml"
        points = 'points = [{ value = 1.0, colour = "#ffffff", extinction_per_mm = 1.0 }]'
        scene.write_text(f'name = "a"\n[source]\npath = "a"\n[[transfer]]\nname = "b"\n{points}\n[together]\n')
        with pytest.raises(VolprepError, match="the source has one"):
            load_scene(scene)


class TestLight:
    """Light from the viewer: on each channel by its own gradient."""

    LIT = ("[render]", '[render]\nlighting = "headlight"')

    @pytest.mark.long(keep=1)
    @pytest.mark.parametrize("way", WAYS)
    def test_the_lit_picture_is_that_of_the_oracle(self, tmp_path, way) -> None:
        scene = scene_of(tmp_path, *WAYS[way])
        unlit = picture(built(scene))
        package = built(changed(scene, self.LIT))
        assert validate(package, tmp_path / "report", picture_size=48).verdict.passed
        assert np.abs(picture(package) - unlit).max() > 0.05
