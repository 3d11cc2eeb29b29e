"""Packages of several channels: registered files, or the channels of one file, on one grid."""

from dataclasses import replace
from pathlib import Path

import nibabel
import numpy as np
import pytest
import scene_builds
import tifffile
from channel_scene import channels, write_channel_scene
from judged import validate
from scene_builds import built, drawn

from volprep.pipeline.build import plan_build
from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.stages import run_stages
from volprep.scene.channels import ONLY_CHANNEL, drawn_channels, left_out, with_listed_channels
from volprep.scene.request import load_request
from volprep.scene.scene import load_scene
from volprep.truth.decoded import level_volume
from volprep.validation.subjects.scan import find_scan, read_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel_packages import channel_packages, package_of_transfer
from volprep_formats.package.channels import channel_views
from volprep_formats.package.check import check
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.readers.volpkg import open_level
from volprep_formats.source import SourceSpec


@pytest.fixture(scope="module", params=["gles3", pytest.param("gles2-2048", marks=pytest.mark.long)])
def package(request, tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp(request.param)
    target = folder / "tissues.volpkg"
    return built(write_channel_scene(folder, request.param), target)


def refusal(scene) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        scene_builds.planned(scene)
    return error.value


def edited(tmp_path, old: str, new: str, count: int = 1):
    scene = write_channel_scene(tmp_path)
    text = scene.read_text()
    assert text.count(old) == count
    scene.write_text(text.replace(old, new))
    return scene


class TestWhatItHolds:
    @pytest.mark.long(keep=1)
    def test_it_names_its_channels_the_one_of_the_default_transfer_function_first(self, package) -> None:
        found = [(channel.name, channel.transfers) for channel in package.manifest.channels]
        assert found == [("skin", ("red", "blue")), ("bone", ("white",))]
        assert [transfer.name for transfer in package.manifest.transfer_functions] == ["red", "blue", "white"]

    def test_each_channel_has_its_own_values_and_window(self, package) -> None:
        for channel in package.manifest.channels:
            values = channels()[channel.name]
            assert channel.source.info.stored_type == values.dtype.name
            assert (channel.statistics.minimum, channel.statistics.maximum) == (values.min(), values.max())
        skin, bone = package.manifest.channels
        # The last point of its transfer functions lies at 0.9: what is above need not be told apart.
        assert 0.9 <= skin.quantization.window[1] <= 1.0
        assert bone.quantization.window[1] > 500.0

    def test_each_channel_has_its_own_voxels_at_every_level(self, package) -> None:
        for name, part in channel_packages(package).items():
            volume = level_volume(part, part.manifest.levels[0].index)
            physical = volume.slope * volume.stored + volume.intercept
            whole = channels()[name]
            start = np.rint(
                (np.linalg.inv(part.manifest.source.info.grid.world_from_index) @ [*volume.grid.origin_mm_xyz, 1])[
                    2::-1
                ]
            ).astype(int)
            seen = whole[tuple(slice(k, k + n) for k, n in zip(start, volume.grid.shape_zyx, strict=True))]
            error = part.manifest.quantization.max_error
            assert np.abs(physical - np.clip(seen, *part.manifest.quantization.window)).max() <= error * 1.01

    def test_what_no_transfer_function_draws_is_left_out_and_the_plan_says_so(self, package) -> None:
        (item,) = [item for item in package.manifest.plan if (item.name, item.channel) == ("channel", "air")]
        assert not item.kept
        assert not any("air" in record.path for record in package.manifest.files)

    def test_it_agrees_with_itself(self, package) -> None:
        assert check(package.path) == []

    def test_every_file_is_of_one_item_of_the_plan(self, package) -> None:
        planned = sorted(path for item in package.manifest.plan for path in item.files)
        assert planned == [record.path for record in package.manifest.files]

    @pytest.mark.long
    @pytest.mark.usefixtures("stages_run_again")
    def test_the_same_scene_gives_the_same_bytes(self, package, tmp_path) -> None:
        again = tmp_path / "again.volpkg"
        built(write_channel_scene(tmp_path, package.manifest.profile.name), again)
        assert (again / "manifest.json").read_bytes() == (package.path / "manifest.json").read_bytes()

    def test_a_level_is_exported_of_the_channel_that_is_chosen(self, package) -> None:
        for channel in ("bone", 2, "2"):
            with open_level(package.path, None, channel) as source:
                level = level_volume(channel_packages(package)["bone"], package.manifest.levels[0].index)
                assert np.array_equal(source.read_slab(0, 3), level.stored[:3])
        with pytest.raises(VolprepError, match="'skin'"):
            open_level(package.path)


class TestWhatItDraws:
    def test_a_transfer_function_draws_its_channel(self, package) -> None:

        pictures = {}
        for transfer in ("red", "white"):
            pictures[transfer] = drawn(package, "anterior", (32, 32), transfer=transfer)
        # The ball of bone lies to the right of that of skin.
        middle = [
            (picture[..., 3].sum(axis=0) @ np.arange(32)) / picture[..., 3].sum() for picture in pictures.values()
        ]
        assert middle[0] - middle[1] > 4

    @pytest.mark.long
    def test_it_validates_and_with_channels_exchanged_it_does_not(self, tmp_path) -> None:
        scene = write_channel_scene(tmp_path)
        built(scene, tmp_path / "a.volpkg")
        report = validate(tmp_path / "a.volpkg", tmp_path / "a.report", picture_size=16)
        assert report.verdict.passed
        assert [program.transfer for program in report.programs] == ["red", "blue", "white"]
        bone = tmp_path / "bone.raw"
        bone.write_bytes((channels()["bone"] // 2).tobytes())
        with pytest.raises(VolprepError, match="VP6013"):
            validate(tmp_path / "a.volpkg", tmp_path / "a.report", picture_size=16)

    @pytest.mark.long
    @pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
    def test_each_channel_skips_its_own_empty_space(self, tmp_path, profile) -> None:
        scene = write_channel_scene(tmp_path, profile)
        wishes = '[skip]\nkind = "distance"\nblock = 4\nranges = true\n'
        scene.write_text(scene.read_text().replace("[pyramid]", f"{wishes}[pyramid]"))
        manifest = built(scene, tmp_path / "a.volpkg").manifest
        tables = {(table.transfer, table.level) for table in manifest.skipping.tables}
        assert {transfer for transfer, _ in tables} == {"red", "white"}
        ranges = {(*texture.channels, texture.level) for texture in manifest.textures if texture.role == "ranges"}
        assert ranges == {(c.name, level.index) for c in manifest.channels for level in c.levels}
        assert len(ranges) == len(manifest.skipping.ranges)
        report = validate(tmp_path / "a.volpkg", tmp_path / "a.report", picture_size=16)
        assert report.verdict.passed

    @pytest.mark.long
    @pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
    def test_each_channel_is_lit_by_its_own_normals(self, tmp_path, profile) -> None:
        scene = edited(tmp_path, "[render]", '[render]\nlighting = "headlight"')
        scene.write_text(scene.read_text().replace('"gles3"', f'"{profile}"'))
        manifest = built(scene, tmp_path / "a.volpkg").manifest
        assert manifest.profile.name == profile
        assert check(tmp_path / "a.volpkg") == []
        normals = {(*texture.channels, texture.level) for texture in manifest.textures if texture.role == "normals"}
        assert normals == {(c.name, level.index) for c in manifest.channels for level in c.levels}
        assert all(any("normals" in name for name in program.samplers) for program in manifest.programs)


class TestOneChannel:
    @pytest.mark.long
    def test_a_scene_that_draws_one_channel_gives_the_package_of_that_file_alone(self, tmp_path) -> None:
        text = write_channel_scene(tmp_path).read_text()
        begin, end = text.index('[[transfer]]\nname = "red"'), text.index('[[transfer]]\nname = "white"')
        (tmp_path / "one.toml").write_text(text[:end].replace('channel = "skin"', 'channel = "skin"'))
        source = text[text.index("[[source.channels]]") : text.index("[pyramid]")]
        skin = text[text.index('path = "skin.raw"') : text.index('[[source.channels]]\nname = "air"')]
        alone = text[:end].replace(source, f"[source]\n{skin}").replace('channel = "skin"\n', "")
        (tmp_path / "alone.toml").write_text(alone)
        assert begin < end
        one = built(tmp_path / "one.toml", tmp_path / "one.volpkg").manifest
        plain = built(tmp_path / "alone.toml", tmp_path / "alone.volpkg").manifest
        assert [channel.name for channel in one.channels] == ["skin"]
        assert [channel.name for channel in plain.channels] == [ONLY_CHANNEL]
        # But for the name of the channel they are the same, and the plan says what was left out.
        one = Manifest.model_validate_json(one.model_dump_json().replace("skin", ONLY_CHANNEL))
        more = [item for item in one.plan if item not in plain.plan]
        assert [(item.name, item.channel) for item in more] == [("channel", "bone"), ("channel", "air")]
        assert one.model_copy(update={"plan": plain.plan}) == plain


class TestRegistration:
    @pytest.mark.parametrize(
        ("old", "new", "says"),
        [
            ("shape_zyx = [17, 22, 27]", "shape_zyx = [22, 17, 27]", "27×17×22"),
            ("shape_zyx = [17, 22, 27]", "shape_zyx = [11, 17, 54]", "54×17×11"),
            ("1.5, 1.0, 0.75", "1.5, 1.0, 0.752", "0.052 mm apart"),
        ],
    )
    def test_a_channel_that_lies_elsewhere_is_refused_with_the_numbers(self, tmp_path, old, new, says) -> None:
        scene = write_channel_scene(tmp_path)
        first, second, rest = scene.read_text().split("[[source.channels]]")[1:]
        head = scene.read_text().split("[[source.channels]]")[0]
        second = second.replace(old, new)
        if "54" in new:
            (tmp_path / "skin.raw").write_bytes(channels()["skin"].tobytes()[: 11 * 17 * 54 * 4])
        scene.write_text(f"{head}[[source.channels]]{first}[[source.channels]]{second}[[source.channels]]{rest}")
        error = refusal(scene)
        assert error.code == "VP1240"
        assert says in str(error)

    @pytest.mark.long
    def test_a_difference_that_no_eye_sees_is_allowed(self, tmp_path) -> None:
        scene = write_channel_scene(tmp_path)
        parts = scene.read_text().split("1.5, 1.0, 0.75")
        scene.write_text("1.5, 1.0, 0.75".join(parts[:2]) + "1.5, 1.0, 0.7501" + "1.5, 1.0, 0.75".join(parts[2:]))
        manifest = built(scene, tmp_path / "a.volpkg").manifest
        assert len({channel.source.info.grid for channel in manifest.channels}) == 1
        found = find_scan(tmp_path / "a.volpkg", scene)
        for name, view in channel_views(manifest).items():
            assert read_scan(view, found.spec_of(name), Silent()).grid == manifest.source.info.grid
        report = validate(tmp_path / "a.volpkg", tmp_path / "a.report", picture_size=16)
        assert report.verdict.passed


class TestScenes:
    @pytest.mark.parametrize(
        ("old", "new", "says"),
        [
            (
                'channel = "skin"\npoints = [\n    { value = 0.2',
                'channel = "hair"\npoints = [\n    { value = 0.2',
                "hair",
            ),
            ('name = "skin"\npath', 'name = "bone"\npath', "same name"),
            ('name = "skin"\npath', 'name = "Skin"\npath', "name"),
            ('name = "skin"\npath = "skin.raw"', 'name = "skin"', "path is missing"),
            ("[pyramid]", '[source]\npath = "x"\n[pyramid]', ""),
        ],
    )
    def test_channels_that_cannot_be_are_refused(self, tmp_path, old, new, says) -> None:
        scene = edited(tmp_path, old, new)
        with pytest.raises(VolprepError, match=r"VP300[23]") as error:
            load_scene(scene)
        assert says in str(error.value)

    def test_a_list_of_channels_has_no_path_beside_it(self, tmp_path) -> None:
        scene = edited(
            tmp_path, '[[source.channels]]\nname = "bone"', '[source]\npath = "x"\n[[source.channels]]\nname = "bone"'
        )
        with pytest.raises(VolprepError, match="each has its own path"):
            load_scene(scene)

    def test_one_path_cannot_replace_several(self, tmp_path) -> None:
        scene = write_channel_scene(tmp_path)
        with pytest.raises(VolprepError, match="VP1243"):
            load_request(scene, source=tmp_path / "bone.raw")
        with pytest.raises(VolprepError, match="VP1243"):
            load_request(scene).with_source(volume=2)

    def test_sub_volumes_are_made_of_one_channel_only(self, tmp_path) -> None:
        assert refusal(edited(tmp_path, "[pyramid]", "[grid]\nsize = 16\n[pyramid]")).code == "VP1244"

    def test_a_missing_file_is_refused_by_its_name(self, tmp_path) -> None:
        scene = write_channel_scene(tmp_path)
        (tmp_path / "skin.raw").unlink()
        error = refusal(scene)
        assert (error.code, "skin.raw" in str(error)) == ("VP1001", True)
        with pytest.raises(VolprepError, match=r"VP1001.*skin.raw"):
            import_draft(prepare(load_request(scene)), tmp_path / "d.volpkg", Silent())


class TestWhatChannelsShare:
    @pytest.mark.parametrize("order", [1, -1])
    def test_the_crop_holds_what_each_shows(self, tmp_path, order) -> None:
        request = load_request(write_channel_scene(tmp_path))
        scene = request.scene.model_copy(update={"transfer": request.scene.transfer[:2][::order]})
        plan = plan_build(replace(request, scene=scene), Silent())
        seen = (channels()["skin"] > 0.2) | (channels()["bone"] > 300)
        first, last = np.argwhere(seen).min(axis=0), np.argwhere(seen).max(axis=0)
        for each in plan.channels:
            # The neighbours count too: between them and what is seen the field fades out.
            assert each.crop.start_zyx == tuple(np.maximum(first - 1, 0))
            assert each.crop.stop_zyx == tuple(np.minimum(last + 2, seen.shape))

    def test_rays_stop_early_in_all_or_in_none(self, tmp_path) -> None:
        faint = edited(tmp_path, "extinction_per_mm = 0.3 }", "extinction_per_mm = 0.0003 }")
        text = faint.read_text()
        # Most of the one channel hides behind its outside, nothing of the other behind anything.
        dense = text.replace("extinction_per_mm = 0.4 }", "extinction_per_mm = 90.0 }")
        faint.write_text(dense)
        plan = scene_builds.planned(faint)
        assert [each.rays.opacity_cutoff for each in plan.channels] == [0.998, 0.998]
        for number in ("90.0", "0.2"):
            dense = dense.replace(f"extinction_per_mm = {number} }}", "extinction_per_mm = 0.0002 }")
        faint.write_text(dense)
        assert [each.rays.opacity_cutoff for each in scene_builds.planned(faint).channels] == [None, None]


class TestStageByStage:
    @pytest.mark.long
    def test_verbs_make_the_package_that_build_makes(self, tmp_path, package) -> None:
        request = load_request(write_channel_scene(tmp_path, package.manifest.profile.name))
        draft = import_draft(prepare(request), tmp_path / "d.volpkg", Silent()).draft
        for stage in plan_draft(draft, request.scene, request.profile, Silent()).stages[1:]:
            run_verb(tmp_path / "d.volpkg", stage, lambda scene: scene, Silent())
        files = Package.open(tmp_path / "d.volpkg").manifest.files
        assert files == package.manifest.files

    def test_level_0_of_a_draft_is_the_scan_of_the_channel_that_is_chosen(self, tmp_path) -> None:
        import_draft(prepare(load_request(write_channel_scene(tmp_path))), tmp_path / "d.volpkg", Silent())
        for name in ("skin", "bone"):
            with open_level(tmp_path / "d.volpkg", 0, name) as source:
                assert np.array_equal(source.read_slab(0, 17), channels()[name])

    def test_what_was_measured_again_gives_the_same_plan(self, tmp_path) -> None:
        request = load_request(write_channel_scene(tmp_path))
        imported = import_draft(prepare(request), tmp_path / "d.volpkg", Silent())
        again = plan_draft(imported.draft, request.scene, request.profile, Silent())
        assert plan_draft(imported.draft, request.scene, request.profile, Silent(), imported.measured) == again
        assert plan_build(request, Silent()) == again

    @pytest.mark.long
    def test_a_transfer_function_that_changes_its_channel_needs_no_new_import(self, tmp_path) -> None:
        scene = write_channel_scene(tmp_path)
        import_draft(prepare(load_request(scene)), tmp_path / "d.volpkg", Silent())
        scene.write_text(
            scene.read_text().replace('name = "blue"\nchannel = "skin"', 'name = "blue"\nchannel = "bone"')
        )
        request = load_request(scene)
        imported = import_draft(prepare(request), tmp_path / "d.volpkg", Silent())
        assert imported.measured is None
        run_stages(
            imported.draft,
            plan_draft(imported.draft, request.scene, request.profile, Silent()),
            request.scene,
            Silent(),
        )
        assert [channel.transfers for channel in imported.draft.manifest.channels] == [("red",), ("white", "blue")]
        assert check(tmp_path / "d.volpkg") == []

    def test_the_import_is_done_again_when_a_file_of_any_channel_has_changed(self, tmp_path) -> None:
        request = load_request(write_channel_scene(tmp_path))
        assert import_draft(prepare(request), tmp_path / "d.volpkg", Silent()).measured is not None
        assert import_draft(prepare(request), tmp_path / "d.volpkg", Silent()).measured is None
        (tmp_path / "bone.raw").write_bytes((channels()["bone"] * 2).tobytes())
        measured = import_draft(prepare(request), tmp_path / "d.volpkg", Silent()).measured
        assert [each.statistics.maximum for each in measured] == [1.0, 2000.0]


class TestChannelsOfOneFile:
    def scene(self, tmp_path, channel: str):
        values = np.stack([channels()["bone"].astype("u2"), channels()["air"].astype("u2")])
        told = {"axes": "CZYX", "Channel": {"Name": ["GFP (green)", "DAPI"]}, "PhysicalSizeX": 0.3}
        told |= {"PhysicalSizeY": 0.3, "PhysicalSizeZ": 1.0}
        tifffile.imwrite(tmp_path / "a.ome.tif", values, ome=True, photometric="minisblack", metadata=told)
        points = 'points = [{ value = 100.0, colour = "#ffffff", extinction_per_mm = 0.0 }, '
        points += '{ value = 900.0, colour = "#ffffff", extinction_per_mm = 500.0 }]'
        scene = tmp_path / "a.toml"
        scene.write_text(
            f'name = "a"\n[source]\npath = "a.ome.tif"\nchannels = "all"\n[[transfer]]\nname = "one"\n{points}\n'
            f'[[transfer]]\nname = "two"\nchannel = "{channel}"\n{points}\n'
        )
        return scene

    @pytest.mark.long
    def test_all_are_named_as_the_file_names_them(self, tmp_path) -> None:
        scene = self.scene(tmp_path, "dapi")
        manifest = built(scene, tmp_path / "a.volpkg").manifest
        assert [channel.name for channel in manifest.channels] == ["gfp-green", "dapi"]
        report = validate(tmp_path / "a.volpkg", tmp_path / "r", source=scene, picture_size=16)
        assert report.verdict.passed

    def test_a_channel_that_is_not_there_is_refused_with_those_that_are(self, tmp_path) -> None:
        error = refusal(self.scene(tmp_path, "rfp"))
        assert (error.code, error.fields["found"]) == ("VP1241", "gfp-green, dapi")

    def test_names_that_are_equal_or_missing_get_numbers(self, tmp_path) -> None:
        told = {"axes": "CZYX", "Channel": {"Name": ["GFP", "gfp!", "", "µ"]}}
        values = np.zeros((4, 3, 5, 4), np.uint8)
        tifffile.imwrite(tmp_path / "a.ome.tif", values, ome=True, photometric="minisblack", metadata=told)
        scene = load_scene(write_channel_scene(tmp_path))
        source = SourceSpec(path=str(tmp_path / "a.ome.tif"), channels="all")
        transfer = tuple(each.model_copy(update={"channel": None}) for each in scene.transfer)
        listed = with_listed_channels(scene.model_copy(update={"source": source, "transfer": transfer}))
        found = [(channel.name, channel.channel) for channel in listed.source.channels]
        assert found == [("gfp", 1), ("gfp-2", 2), ("channel-3", 3), ("channel-4", 4)]

    def test_volumes_of_a_nifti_file_are_channels(self, tmp_path) -> None:
        values = np.stack([channels()["bone"].T, channels()["air"].T], axis=3)
        nibabel.save(nibabel.Nifti1Image(values, np.diag([-1.0, -1.0, 1.0, 1.0])), tmp_path / "a.nii")
        scene = self.scene(tmp_path, "channel-2")
        text = scene.read_text().replace("a.ome.tif", "a.nii").replace("500.0", "0.5")
        scene.write_text(text)
        manifest = built(scene, tmp_path / "a.volpkg").manifest
        assert [channel.name for channel in manifest.channels] == ["channel-1", "channel-2"]
        assert [channel.statistics.maximum for channel in manifest.channels] == [values[..., n].max() for n in (0, 1)]
        scene.write_text(text.replace('channels = "all"', 'channels = "all"\nvolume = 1'))
        assert refusal(scene).code == "VP1004"

    def test_channels_of_a_package_are_channels(self, tmp_path, package) -> None:
        scene = self.scene(tmp_path, "bone")
        scene.write_text(scene.read_text().replace("a.ome.tif", str(package.path)).replace("500.0", "0.5"))
        plan = scene_builds.planned(scene)
        assert [each.channel for each in plan.channels] == ["skin", "bone"]

    def test_a_format_of_one_channel_is_refused(self, tmp_path) -> None:
        scene = self.scene(tmp_path, "dapi")
        (tmp_path / "a.ome.tif").write_bytes(b"NRRD0004\n")
        assert refusal(scene).code == "VP1242"

    def test_what_is_drawn_and_what_is_not(self, tmp_path) -> None:
        listed = with_listed_channels(load_request(self.scene(tmp_path, "gfp-green")).scene)
        assert [channel.name for channel in drawn_channels(listed)] == ["gfp-green"]
        assert left_out(listed) == ("dapi",)


class TestAgreement:
    def test_views_leave_nothing_of_other_channels(self, package) -> None:
        for name, view in channel_views(package.manifest).items():
            assert [channel.name for channel in view.channels] == [name]
            assert {texture.channels for texture in view.textures} == {(), (name,)}

    def test_a_transfer_function_that_is_not_there_gives_the_package_itself(self, package) -> None:
        assert package_of_transfer(package, "green") is package


def _with(manifest, **changes):
    first, second = manifest.channels
    return (first, second.model_copy(update=changes))


def _with_function(manifest, name):
    """Give the second channel a transfer function more."""
    (white,) = manifest.channels[1].transfer_functions
    return _with(manifest, transfer_functions=(white, white.model_copy(update={"name": name})))


def _moved(record):
    grid = record.info.grid.model_copy(update={"origin_mm_xyz": (1.0, 2.0, 3.0)})
    return record.model_copy(update={"info": record.info.model_copy(update={"grid": grid})})


@pytest.mark.long
def test_tissue_maps_of_a_head_become_one_package(scans, tmp_path) -> None:
    head = nibabel.load(scans / "nifti_ch2" / "ch2.nii.gz")
    values = np.asarray(head.dataobj)[::3, ::3, ::3].astype(np.float32)
    affine = head.affine @ np.diag([3.0, 3.0, 3.0, 1.0])
    for name, typical in (("gm", 82.0), ("wm", 112.0), ("csf", 45.0)):
        nibabel.save(
            nibabel.Nifti1Image(np.exp(-(((values - typical) / 14) ** 2)), affine), tmp_path / f"{name}.nii.gz"
        )
    text = (Path(__file__).parents[2] / "sample_specs" / "tissues.toml").read_text()
    (tmp_path / "tissues.toml").write_text(text.replace("../build/scans/tissues/", ""))
    manifest = built(tmp_path / "tissues.toml", tmp_path / "a.volpkg").manifest
    assert [channel.name for channel in manifest.channels] == ["gm", "wm"]
    assert [item.channel for item in manifest.plan if item.name == "channel"] == ["csf"]
    verdict = validate(tmp_path / "a.volpkg", tmp_path / "a.report", picture_size=32).verdict
    assert (verdict.failed, verdict.differing, verdict.unproved) == (0, (), ())
    # Folds of the cortex are finer than voxels of 6 mm, whatever filter makes them, and the verdict says so.
    assert all(item.startswith("level 1 with ") for item in verdict.beyond)
