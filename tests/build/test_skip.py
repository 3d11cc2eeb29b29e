"""Packages whose rays skip empty space: built, checked, drawn, made by verbs in any order, made anew on a device."""

import math

import numpy as np
import pytest
from phantom_scene import write_phantom_scene
from sample_counts import samples_per_pixel
from scene_builds import built, view_of

from volprep.parts.skip.occupancy import occupied_blocks
from volprep.parts.skip.tables import skip_table
from volprep.parts.skip.visible import entry_extinctions
from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft, scene_of
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.stages import run_stages
from volprep.render.renderer import Renderer
from volprep.scan.block_ranges import BlockRanges
from volprep.scene.request import load_request
from volprep.scene.scene import SkipSettings, changed
from volprep.validation.timing.full_rays import uncut
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic

PROFILES = ["gles3", "gles2-2048"]
SKIP = '\n[skip]\nkind = "distance"\nblock = 3\nranges = true\n'


def scene_with(folder, profile, skip):
    path = write_phantom_scene(folder, profile)
    text = path.read_text().replace("[pyramid]", f"{skip}\n[quantize]\nbits = 8\n\n[pyramid]")
    path.write_text(f'crop = "none"\n{text}')
    return path


@pytest.fixture(scope="module", params=PROFILES)
def packages(request, tmp_path_factory):
    """The same scene without skipping and with it."""
    found = []
    for name, skip in (("plain", ""), ("skipping", SKIP)):
        folder = tmp_path_factory.mktemp(name)
        target = folder / "phantom.volpkg"
        built(scene_with(folder, request.param, skip), target)
        found.append(Package.open(target))
    return found


def texels(package, name):
    texture = next(each for each in package.manifest.textures if each.name == name)
    data = ktx2.decode(package.read_bytes(texture.file), texture.file).data
    return data if texture.mosaic is None else slices_of_mosaic([data[0]], texture.mosaic)


@pytest.mark.long(keep=1)
def test_the_package_is_sound_and_each_file_belongs_to_one_item(packages):
    _, package = packages
    assert check(package.path) == []
    kept = {item.name: item for item in package.manifest.plan if item.kept}
    skip_files = {texture.file for texture in package.manifest.textures if texture.role in {"skip", "ranges"}}
    named = [*kept["skip table core"].files, *kept["ranges of blocks"].files]
    assert sorted(named) == sorted(skip_files)
    # In blocks of 16³ voxels the shell is everywhere.
    assert "skip table shell" not in kept


def test_pictures_are_the_same_with_fewer_samples(packages):
    plain, skipping = packages
    grid = plain.manifest.grid
    for program in (each for each in skipping.manifest.level_programs if each.transfer == "core"):
        level = program.levels[0]
        camera = view_of(grid, "anterior-left")
        pictures, taken = [], []
        for package in (plain, skipping):
            with Renderer(package, level=level, transfer=program.transfer) as renderer:
                pictures.append(renderer.render(camera, (48, 48)))
                own = renderer.program
            taken.append(samples_per_pixel(package, own, level, camera, (48, 48))[0].sum())
        assert np.abs(pictures[0] - pictures[1]).max() <= 1 / 255
        assert taken[1] < 0.8 * taken[0]


def test_the_shader_without_early_termination_is_still_the_packages_own(packages):
    for package in packages:
        for program in package.manifest.level_programs:
            assert uncut(package, program) is not None


def test_a_device_makes_the_same_tables_from_ranges_and_lookup_table(packages):
    _, package = packages
    manifest = package.manifest
    for table in manifest.skipping.tables:
        record = next(each for each in manifest.skipping.ranges if each.level == table.level)
        low, high = np.split(texels(package, record.texture), 2)
        lookup = next(
            each
            for each in manifest.textures
            if each.role == "transfer" and each.transfer == table.transfer and each.level in {None, table.level}
        )
        extinction = entry_extinctions(lookup, ktx2.decode(package.read_bytes(lookup.file), lookup.file).data[0])
        occupied = occupied_blocks(BlockRanges(low, high, record.block), extinction)
        assert np.array_equal(skip_table(occupied, table.kind), texels(package, table.texture))
        assert table.empty_share == pytest.approx(1 - occupied.mean())
        assert math.prod(table.blocks_zyx) == occupied.size


@pytest.mark.long
def test_verbs_in_another_order_end_in_the_same_package(tmp_path):
    """Skipping is added when the shaders are there already; they are made again, and nothing of the old stays."""
    request = load_request(scene_with(tmp_path, "gles3", ""))
    draft = import_draft(prepare(request), tmp_path / "draft", Silent()).draft
    plan = plan_draft(draft, request.scene, request.profile, Silent())
    run_stages(draft, plan.model_copy(update={"stages": plan.stages[:-1]}), request.scene, Silent())
    folder = tmp_path / "draft"
    wishes = {"kind": "distance", "block": 3, "ranges": True}
    run_verb(folder, "skip", lambda scene: changed(scene, "skip", **wishes), Silent())
    assert scene_of(import_draft(prepare(request), folder, Silent()).draft).skip is not None
    run_verb(folder, "shaders", lambda scene: scene, Silent())
    sealed = run_verb(folder, "seal", lambda scene: scene, Silent())
    assert sealed.manifest.skipping is not None
    core = next(program for program in sealed.manifest.level_programs if program.transfer == "core")
    assert core.samplers[-1] == "u_skip"
    assert check(folder) == []


def test_ranges_that_are_no_longer_wanted_go_and_tables_stay(tmp_path):
    request = load_request(scene_with(tmp_path, "gles3", SKIP))
    scene = request.scene
    draft = import_draft(prepare(request), tmp_path / "draft", Silent()).draft
    plan = plan_draft(draft, scene, request.profile, Silent())
    run_stages(draft, plan.model_copy(update={"stages": plan.stages[:-1]}), scene, Silent())
    assert draft.manifest.skipping.ranges
    without = scene.model_copy(update={"skip": scene.skip.model_copy(update={"ranges": False})})
    run_stages(draft, plan_draft(draft, without, request.profile, Silent()), without, Silent())
    assert draft.manifest.skipping.tables
    assert not draft.manifest.skipping.ranges
    assert check(tmp_path / "draft") == []


def test_tables_that_are_no_longer_wanted_go(tmp_path):
    request = load_request(scene_with(tmp_path, "gles3", SKIP))
    draft = import_draft(prepare(request), tmp_path / "draft", Silent()).draft
    plan = plan_draft(draft, request.scene, request.profile, Silent())
    run_stages(draft, plan.model_copy(update={"stages": plan.stages[:-1]}), request.scene, Silent())
    assert draft.manifest.skipping is not None
    without = request.scene.model_copy(update={"skip": SkipSettings(kind="none")})
    run_stages(draft, plan_draft(draft, without, request.profile, Silent()), without, Silent())
    assert draft.manifest.state == "sealed"
    assert draft.manifest.skipping is None
    assert check(tmp_path / "draft") == []
