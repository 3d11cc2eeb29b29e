"""Packages with proxy geometry: built, checked, drawn, and made by the verb."""

from unittest.mock import patch

import numpy as np
import pytest
import scene_builds
from channel_scene import write_channel_scene
from phantom_scene import write_phantom_scene
from sample_counts import samples_per_pixel
from scene_builds import view_of

from volprep.parts.proxy.files import chosen_files
from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.stages import run_stages
from volprep.render.proxy_renderer import ProxyRenderer
from volprep.render.renderer import Renderer
from volprep.render.renderers import renderer_of
from volprep.scene.request import load_request
from volprep.scene.scene import changed
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import read_glb
from volprep_formats.package.channels import channel_views
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

PROFILES = ["gles3", "gles2-2048"]
PROXY = "\n[proxy]\nblock = 3\n"


def scene_with(folder, profile, text):
    path = write_phantom_scene(folder, profile)
    whole = path.read_text().replace("[pyramid]", f"{text}\n[quantize]\nbits = 8\n\n[pyramid]")
    path.write_text(f'crop = "none"\n{whole}')
    return path


def built(folder, profile, text):
    target = folder / "phantom.volpkg"
    return scene_builds.built(scene_with(folder, profile, text), target)


@pytest.fixture(scope="module", params=PROFILES)
def package(request, tmp_path_factory):
    """A phantom whose transfer functions have meshes."""
    return built(tmp_path_factory.mktemp("proxy"), request.param, PROXY)


def test_the_package_is_sound_and_each_file_belongs_to_one_item(package):
    assert check(package.path) == []
    kept = {item.name: item for item in package.manifest.plan if item.kept}
    meshes = [mesh.file for mesh in package.manifest.proxy.meshes]
    assert meshes
    assert set(meshes) <= {path for name, item in kept.items() if "proxy" in name for path in item.files}


def test_every_level_is_drawn_as_without_with_fewer_samples(package):
    grid = package.manifest.grid
    camera = view_of(grid, "anterior-left")
    for program in (each for each in package.manifest.level_programs if each.rays == "mesh"):
        for level in program.levels:
            both, taken = [], []
            for kind in (Renderer, ProxyRenderer):
                with kind(package, level=level, transfer=program.transfer) as renderer:
                    both.append(renderer.render(camera, (48, 48)))
                    own = renderer.program
                taken.append(samples_per_pixel(package, own, level, camera, (48, 48), kind=kind)[0].sum())
            # Of 8 bits one step, and what float32 rounds.
            assert np.abs(both[0] - both[1]).max() < 1.001 / 255
            assert taken[1] < taken[0]


@pytest.mark.long
@pytest.mark.usefixtures("stages_run_again")
def test_the_same_scene_gives_the_same_bytes(package, tmp_path):
    again = built(tmp_path, package.manifest.profile.name, PROXY)
    assert [record.sha256 for record in again.manifest.files] == [record.sha256 for record in package.manifest.files]


def test_a_damaged_mesh_is_found(package):
    mesh = package.manifest.proxy.meshes[0]
    data = bytearray(package.read_bytes(mesh.file))
    assert sum(len(part.triangles) for part in read_glb(bytes(data), "mesh").primitives) == mesh.triangles
    data[-1] ^= 0xFF
    with pytest.raises(VolprepError, match="VP4039"):
        read_glb(bytes(data), "mesh")


def test_without_the_table_nothing_of_it_is_in_the_package(tmp_path):
    package = built(tmp_path, "gles3", "")
    assert package.manifest.proxy is None
    assert not [record for record in package.manifest.files if record.role == "mesh" or "proxy" in record.path]
    assert not [item for item in package.manifest.plan if "proxy" in item.name]


def test_what_saves_no_samples_is_left_out_with_its_reason(tmp_path):
    package = built(tmp_path, "gles3", '\n[proxy]\nform = "box"\nblock = 64\n')
    items = [item for item in package.manifest.plan if "proxy" in item.name]
    for item in items:
        if not item.kept:
            assert "of the samples" in item.reason
    assert check(package.path) == []


def test_channels_have_meshes_each_of_its_own(tmp_path):
    scene = write_channel_scene(tmp_path)
    scene.write_text(scene.read_text().replace("[pyramid]", "[proxy]\nblock = 2\n[pyramid]"))
    with patch("volprep.parts.proxy.part.chosen_files", wraps=chosen_files) as chosen:
        scene_builds.built(scene, tmp_path / "tissues.volpkg")
    package = Package.open(tmp_path / "tissues.volpkg")
    assert check(package.path) == []
    # A decoder counts once for the package: compression is decided for the files of both channels together.
    ((files, _),) = [call.args for call in chosen.call_args_list]
    assert len(files) == sum(mesh.file is not None for mesh in package.manifest.proxy.meshes)
    with_mesh = {mesh.transfer for mesh in package.manifest.proxy.meshes}
    channels = {name for name, view in channel_views(package.manifest).items() if view.proxy.meshes}
    assert len(channels) == 2
    camera = view_of(package.manifest.grid, "anterior-left")
    for transfer in with_mesh:
        both = []
        for kind in (Renderer, ProxyRenderer):
            with kind(package, transfer=transfer) as renderer:
                both.append(renderer.render(camera, (40, 40)))
        assert isinstance(renderer_of(package, transfer=transfer), ProxyRenderer)
        assert both[0].max() > 0.1
        assert np.abs(both[0] - both[1]).max() < 1.001 / 255


def test_the_plan_says_whether_meshes_are_compressed_and_why(package):
    (item,) = [item for item in package.manifest.plan if item.kept and item.name.startswith("proxy geometry")]
    meshes = len(package.manifest.proxy.meshes)
    rule = "where that saves more than 6 bytes for each triangle"
    assert f"0 of {meshes} files compressed with Draco, {rule}" in item.reason
    assert item.reason.endswith("all files together save more than the 256 KiB of a decoder")


def test_the_verb_makes_the_meshes_anew(tmp_path):
    request = load_request(scene_with(tmp_path, "gles3", PROXY))
    imported = import_draft(prepare(request), tmp_path / "draft", Silent())
    plan = plan_draft(imported.draft, request.scene, request.profile, Silent(), imported.measured)
    stages = [stage for stage in plan.stages if stage not in {"shaders", "seal"}]
    run_stages(imported.draft, plan.model_copy(update={"stages": tuple(stages)}), request.scene, Silent())
    wishes = {"form": "blocks", "block": 4}
    draft = run_verb(tmp_path / "draft", "proxy", lambda scene: changed(scene, "proxy", **wishes), Silent())
    assert {(mesh.form, mesh.block) for mesh in draft.manifest.proxy.meshes} == {("blocks", 4)}
    with pytest.raises(VolprepError, match="VP3003"):
        changed(request.scene, "proxy", form="ball")


def test_a_transfer_function_that_shows_nothing_gives_a_package_that_draws_nothing(tmp_path):
    path = scene_with(tmp_path, "gles3", PROXY)
    nothing = (
        '\n[[transfer]]\nname = "nothing"\npoints = [{ value = 0.0, colour = "#ffffff", extinction_per_mm = 0.0 }]\n'
    )
    path.write_text(path.read_text() + nothing)
    target = tmp_path / "phantom.volpkg"
    package = scene_builds.built(path, target)
    assert check(target) == []
    assert {mesh.file for mesh in package.manifest.proxy.meshes if mesh.transfer == "nothing"} == {None}
    (item,) = (item for item in package.manifest.plan if item.name == "proxy geometry nothing")
    assert (item.kept, item.reason) == (True, "the transfer function shows nothing, so meshes and pictures are empty")
    grid = package.manifest.grid
    with ProxyRenderer(package, transfer="nothing") as renderer:
        assert not renderer.render(view_of(grid, "left"), (20, 20)).any()
