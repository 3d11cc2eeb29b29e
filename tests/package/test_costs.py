"""What a manifest and a plan say that drawing costs a device is what the renderer hands to the driver."""

import pytest
from tamper_scenes import KINDS, write_kind

from volprep.pipeline.build import build, plan_build
from volprep.render.renderers import renderer_of
from volprep.scene.request import load_request
from volprep.validation.exact.manifests import manifest_differences
from volprep_formats.package.picture import DrawCost
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.textures.texel_formats import gpu_bytes, size_bytes

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
    assert manifest.drawings
    for picture, drawing in manifest.drawings:
        with renderer_of(package, level=drawing.level, transfer=picture.name) as renderer:
            assert renderer.uploaded_bytes == drawing.cost.upload_bytes, drawing
        assert drawing.cost.gpu_bytes >= 0.9 * drawing.cost.upload_bytes


def test_the_plan_says_before_what_the_package_says_after(made) -> None:
    kind, wanted, package = made
    planned = {
        (each.picture, each.level): DrawCost(upload_bytes=each.upload_bytes, gpu_bytes=each.gpu_bytes)
        for each in plan_build(wanted, Silent()).costs
    }
    told = {(picture.name, drawing.level): drawing.cost for picture, drawing in package.manifest.drawings}
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
    first, *others = manifest.pictures
    drawing, *rest = first.drawings
    cost = drawing.cost.model_copy(update={"gpu_bytes": drawing.cost.gpu_bytes + 1})
    wrong = first.model_copy(update={"drawings": (drawing.model_copy(update={"cost": cost}), *rest)})
    (found,) = manifest_differences(manifest.model_copy(update={"pictures": (wrong, *others)}), manifest)
    where = f"pictures[{first.name}].drawings[{drawing.level}].cost"
    assert found.startswith(f"{where}.gpu_bytes is {cost.gpu_bytes}")


def test_texels_of_three_bytes_and_of_palettes_take_four_on_a_gpu() -> None:
    for name, upload, memory in (
        ("rgb8unorm", 3, 4),
        ("palette8-rgba8unorm", 1, 4),
        ("r8unorm", 1, 1),
        ("rgba16float", 8, 8),
    ):
        assert size_bytes(name, (2, 3, 5)) == 30 * upload
        assert gpu_bytes(name, (2, 3, 5)) == 30 * memory
    assert gpu_bytes("astc-4x4-unorm", (1, 8, 8)) == size_bytes("astc-4x4-unorm", (1, 8, 8)) == 64
