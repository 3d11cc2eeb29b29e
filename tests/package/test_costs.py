"""What a manifest and a plan say that drawing costs a device is what the renderer hands to the driver."""

import pytest
from tamper_scenes import KINDS, write_kind

from volprep.pipeline.build import build, plan_build
from volprep.render.choose import renderer_of
from volprep.scene.request import load_request
from volprep.validation.exact.manifests import manifest_differences
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.textures.gl_formats import gpu_bytes, size_bytes

ONLY_BOUNDED = {"bricks", "bricks-in-mosaics", "house", "compressed"}
"""Kinds of which a plan knows less than the package: how many bricks are empty, the mesh, whether a form is kept."""


@pytest.fixture(scope="module", params=[*KINDS, "channels"])
def made(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    wanted = load_request(write_kind(folder, request.param))
    build(wanted, folder / "p.volpkg", Silent())
    return request.param, wanted, Package.open(folder / "p.volpkg")


@pytest.mark.long(keep=2)
def test_costs_are_what_the_renderer_uploads(made) -> None:
    _, _, package = made
    manifest = package.manifest
    assert manifest.costs
    for cost in manifest.costs:
        with renderer_of(package, level=cost.level, transfer=cost.transfer) as renderer:
            assert renderer.uploaded_bytes == cost.upload_bytes, cost
        assert cost.gpu_bytes >= 0.9 * cost.upload_bytes


@pytest.mark.long(keep=2)
def test_every_level_that_a_program_draws_has_one_cost(made) -> None:
    _, _, package = made
    manifest = package.manifest
    drawn = {(each.transfer, level) for each in manifest.programs for level in each.levels}
    stated = [(each.transfer, each.level) for each in manifest.costs]
    assert len(stated) == len(set(stated))
    assert not manifest.programs or drawn == set(stated)


def test_the_plan_says_before_what_the_package_says_after(made) -> None:
    kind, wanted, package = made
    planned = {(each.transfer, each.level): each for each in plan_build(wanted, Silent()).costs}
    told = {(each.transfer, each.level): each for each in package.manifest.costs}
    if kind not in ONLY_BOUNDED:
        assert planned == told
    if kind == "house":
        meshes = {(each.transfer, each.level): each for each in package.manifest.proxy.meshes}
        for key, cost in told.items():
            mesh_bytes = meshes[key].vertices * 12 + meshes[key].triangles * 6
            assert mesh_bytes
            assert cost.upload_bytes == planned[key].upload_bytes + mesh_bytes
    if "bricks" in kind:
        assert all(0 < told[key].upload_bytes <= planned[key].upload_bytes for key in told)


def test_a_cost_that_does_not_follow_from_the_textures_is_a_difference(made) -> None:
    _, _, package = made
    manifest = package.manifest
    first, *rest = manifest.costs
    wrong = manifest.model_copy(update={"costs": (first.model_copy(update={"gpu_bytes": first.gpu_bytes + 1}), *rest)})
    # What is derived again has no costs: these come with the seal.
    derived = manifest.model_copy(update={"costs": ()})
    assert not manifest_differences(manifest, derived)
    (found,) = manifest_differences(wrong, derived)
    assert found.startswith(f"costs[{first.transfer}].gpu_bytes is {first.gpu_bytes + 1}")


def test_texels_of_three_bytes_and_of_palettes_take_four_on_a_gpu() -> None:
    for name, upload, memory in (("RGB8", 3, 4), ("PALETTE8_RGBA8", 1, 4), ("R8", 1, 1), ("RGBA16F", 8, 8)):
        assert size_bytes(name, (2, 3, 5)) == 30 * upload
        assert gpu_bytes(name, (2, 3, 5)) == 30 * memory
    assert gpu_bytes("ASTC_4X4", (1, 8, 8)) == size_bytes("ASTC_4X4", (1, 8, 8)) == 64
