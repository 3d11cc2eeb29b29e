"""A page draws what the reference renderer draws, with everything that a package may have."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from web_pictures import SIZE, TWO_STEPS, box_from_clip_of, drawn_by_reference, drawn_in_page, rmse
from web_scenes import EDIT, SCENES

from volprep.parts.editing.inputs import edit_with
from volprep.render.renderer import Renderer
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint


def kind_of(package: Package) -> str:
    return "webgl2" if package.manifest.profile.api == "es3.0" else "webgl"


def levels_of(package: Package, transfer: str) -> list[int]:
    return sorted({level for each in package.manifest.programs if each.transfer == transfer for level in each.levels})


@pytest.mark.parametrize("name", SCENES)
def test_all_nine_views_are_those_of_the_reference_renderer(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)
    transfers = list(dict.fromkeys(each.transfer for each in package.manifest.programs))
    # The finest level of the default picture, and the coarsest one of the last.
    for transfer, level in ((transfers[0], levels_of(package, transfers[0])[0]), (transfers[-1], -1)):
        index = levels_of(package, transfer)[level]
        options = {"program": transfer, "level": index}
        found = drawn_in_page(browser, server, package.path, matrices, kind=kind_of(package), options=options)
        assert (found.said["program"], found.said["level"], found.said["error"]) == (transfer, index, 0)
        # Chromium on SwiftShader has no EXT_texture_norm16.
        assert [each for each in found.said["notes"] if "of 16 bits" not in each] == []
        wanted = drawn_by_reference(package, matrices, level=index, transfer=transfer)
        assert all(picture[..., 3].max() > 0.1 for picture in wanted)
        for picture, reference in zip(found.pictures, wanted, strict=True):
            assert rmse(picture, reference) < TWO_STEPS


@pytest.mark.parametrize("name", SCENES)
def test_every_shader_compiles_in_webgl(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    manifest = package.manifest
    programs = [*manifest.programs]
    programs += manifest.subvolumes.programs if manifest.subvolumes else []
    programs += manifest.proxy.programs if manifest.proxy else []
    texts = [(package.read_text(each.vertex), package.read_text(each.fragment)) for each in programs]
    if manifest.proxy:
        texts.append((package.read_text(manifest.proxy.programs[0].vertex), package.read_text(manifest.proxy.depth)))
    browser.open(f"{server.url}/")
    script = """
    const [kind, texts] = given;
    const gl = new OffscreenCanvas(1, 1).getContext(kind);
    return texts.map((pair) => {
      const program = gl.createProgram();
      pair.forEach((text, i) => {
        const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
      });
      gl.linkProgram(program);
      return gl.getProgramParameter(program, gl.LINK_STATUS) ? "" : gl.getProgramInfoLog(program);
    });
    """
    assert browser.run(script, kind_of(package), texts) == [""] * len(texts)


def test_the_pieces_around_a_point_are_drawn(browser, server, scene_package) -> None:
    package = scene_package("pieces")
    matrices = box_from_clip_of(package)
    for point in (0, 31):
        found = drawn_in_page(browser, server, package.path, matrices, point=point)
        wanted = drawn_by_reference(package, matrices, point=point)
        assert max(picture[..., 3].max() for picture in wanted) > 0.1
        assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS


@pytest.mark.parametrize("name", ["editable", "editable mosaic"])
def test_an_edited_transfer_function_is_drawn_on_every_level(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)
    points = tuple(TransferPoint.model_validate(each) for each in EDIT)
    edit = edit_with(TransferFunction(name="shell", points=points))
    for level in levels_of(package, "shell"):
        options = {"program": "shell", "level": level}
        how = {"kind": kind_of(package), "options": options, "edit": {"points": EDIT}}
        found = drawn_in_page(browser, server, package.path, matrices, **how)
        wanted = drawn_by_reference(package, matrices, level=level, transfer="shell", edit=edit)
        before = drawn_by_reference(package, matrices, level=level, transfer="shell")
        for picture, reference, unedited in zip(found.pictures, wanted, before, strict=True):
            assert rmse(picture, reference) < TWO_STEPS < rmse(unedited, reference) / 5


@pytest.mark.parametrize("name", ["lit, skips by distance", "mosaic of several textures"])
def test_a_plane_cuts_as_the_near_plane_does(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)
    matrix = matrices[6]
    forward = matrix[:3, 2]
    plane = np.array([*forward, -float(forward @ (matrix @ [0, 0, 0, 1])[:3])])
    (whole,) = drawn_by_reference(package, [matrix])
    # The near or the far plane moved to the middle of the volume: orthographic, so that it is a plane of box space.
    for side in (1.0, -1.0):
        halfway = matrix @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0.5, 0.5 * side], [0, 0, 0, 1]])
        how = {"kind": kind_of(package), "clip": {"planes": [(side * plane).tolist()]}}
        found = drawn_in_page(browser, server, package.path, [matrix], **how)
        (wanted,) = drawn_by_reference(package, [halfway])
        assert rmse(found.pictures[0], wanted) < TWO_STEPS < rmse(whole, wanted)


def test_a_box_shows_only_what_is_inside(browser, server, scene_package) -> None:
    package = scene_package("mosaic of several textures")
    matrix = box_from_clip_of(package)[0]
    high_mm_xyz = np.array(package.manifest.grid.extent_mm_zyx[::-1])
    box = [[float(high_mm_xyz[0] / 2), 0.0, 0.0], high_mm_xyz.tolist()]
    how = {"kind": "webgl", "options": {"level": 0}}
    found = drawn_in_page(browser, server, package.path, [matrix], clip={"box": box}, **how)
    (whole,) = drawn_by_reference(package, [matrix], level=0)
    # In the anterior view x of the box runs along the picture's rows.
    columns = (2 * np.arange(SIZE) + 1) / SIZE - 1
    x_mm = np.array([(matrix @ [c, 0, 0, 1])[0] for c in columns])
    inside = x_mm > box[0][0]
    assert whole[:, ~inside, 3].max() > 0.1
    assert found.pictures[0][:, ~inside].max() == 0.0
    assert rmse(found.pictures[0][:, inside], whole[:, inside]) < TWO_STEPS


def test_a_package_that_is_not_editable_says_so(browser, server, scene_package) -> None:
    package = scene_package("bricks")
    with pytest.raises(Exception, match="VP5023"):
        drawn_in_page(browser, server, package.path, box_from_clip_of(package), edit={"points": EDIT})


def test_a_level_of_meshes_is_drawn_from_the_box_where_the_camera_is_inside(browser, server, scene_package) -> None:
    package = scene_package("meshes")
    matrix = box_from_clip_of(package)[6]
    inside = matrix @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0.5, 0.5], [0, 0, 0, 1]])
    found = drawn_in_page(browser, server, package.path, [inside], options={"program": "core"})
    with Renderer(package, transfer="core") as renderer:
        wanted = renderer.render(inside, (SIZE, SIZE))
    assert wanted[..., 3].max() > 0.1
    assert rmse(found.pictures[0], wanted) < TWO_STEPS


def test_a_technique_that_a_page_cannot_draw_is_refused_by_name(browser, server, scene_package) -> None:
    package = scene_package("published slices for OpenGL ES 2")
    with pytest.raises(Exception, match=r"VP7021 .* draws view-slices-as-published.* 8 bits"):
        drawn_in_page(browser, server, package.path, box_from_clip_of(package), kind="webgl")


def test_a_light_that_is_moved_lights_as_if_the_package_had_it_there(browser, server, scene_package) -> None:
    package, other = scene_package("light with a place"), scene_package("light at another place")
    matrices = box_from_clip_of(package)[:3]
    place = list(other.manifest.programs[0].light.place_mm_xyz)
    found = drawn_in_page(browser, server, package.path, matrices, light=place)
    wanted = drawn_by_reference(other, matrices)
    assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS
    assert min(map(rmse, drawn_by_reference(package, matrices), wanted)) > 2 * TWO_STEPS
    for light, words in (([1.0, 2.0], "three numbers"), (["x", 0, 0], "three numbers")):
        with pytest.raises(Exception, match=f"VP7063.*{words}"):
            drawn_in_page(browser, server, package.path, matrices, light=light)
    with pytest.raises(Exception, match=r"VP7063.*no program of the package is lit"):
        drawn_in_page(browser, server, scene_package("mipmaps").path, matrices, light=place)


def test_a_technique_that_a_later_volprep_may_bring_is_refused_by_name(
    browser, server, scene_package, tmp_path
) -> None:
    package = scene_package("slabs")
    copy = shutil.copytree(package.path, tmp_path / "p.volpkg")
    text = (copy / "manifest.json").read_text()
    assert '"technique": "slabs"' in text
    (copy / "manifest.json").write_text(text.replace('"technique": "slabs"', '"technique": "by-magic"'))
    with pytest.raises(Exception, match=r"VP7021 .* draws by-magic.* does not know"):
        drawn_in_page(browser, server, copy, box_from_clip_of(package))


def test_each_level_is_drawn_with_its_own_step(browser, server, scene_package) -> None:
    package = scene_package("steps of levels")
    render = package.manifest.render
    steps = {level: render.step_of(level) for level in levels_of(package, "shell")}
    assert len(set(steps.values())) > 1
    for level, step in steps.items():
        found = drawn_in_page(browser, server, package.path, [], options={"level": level})
        assert found.said["step"] == step


def test_a_mesh_that_is_compressed_is_left_out_and_named(browser, server, scene_package, tmp_path) -> None:
    package = scene_package("meshes")
    copy = Path(shutil.copytree(package.path, tmp_path / "p.volpkg"))
    manifest = json.loads((copy / "manifest.json").read_text())
    for mesh in manifest["proxy"]["meshes"]:
        # What is in the file is then not looked at.
        mesh["draco"] = True
    (copy / "manifest.json").write_text(json.dumps(manifest))
    matrices = box_from_clip_of(package)[:2]
    found = drawn_in_page(browser, server, copy, matrices, options={"program": "core"})
    assert [note.split()[0] for note in found.said["notes"]] == ["VP7064"]
    assert 'draco = "none"' in found.said["notes"][0]
    wanted = drawn_by_reference(package, matrices, transfer="core")
    assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS
