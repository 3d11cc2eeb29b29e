"""A page draws what the reference renderer draws, with everything that a package may have."""

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from npm_package import npm_package
from turned_light import turned_by
from web_pictures import SIZE, TWO_STEPS, box_from_clip_of, drawn_by_reference, drawn_in_page, rmse
from web_scenes import EDIT, SCENES

from volprep.render.renderer import Renderer
from volprep_formats.meshes import read_glb, write_glb
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint


def kind_of(package: Package) -> str:
    return "webgl2" if package.manifest.profile.api == "es3.0" else "webgl"


def levels_of(package: Package, transfer: str) -> list[int]:
    return sorted(
        {level for each in package.manifest.level_programs if each.transfer == transfer for level in each.levels}
    )


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", SCENES)
def test_all_nine_views_are_those_of_the_reference_renderer(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)
    transfers = list(dict.fromkeys(each.transfer for each in package.manifest.level_programs))
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


@pytest.mark.long
@pytest.mark.parametrize("name", ["half-angle slices", "half-angle slices in perspective"])
def test_no_rounding_of_corners_moves_the_rays_of_layers(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)
    # Few layers, so that the rounding of half floats does not add up. SwiftShader rounds corners to a 16th of a pixel.
    level = levels_of(package, "shell")[-1]
    found = drawn_in_page(browser, server, package.path, matrices, options={"program": "shell", "level": level})
    wanted = drawn_by_reference(package, matrices, level=level, transfer="shell")
    assert max(np.abs(picture - other).max() for picture, other in zip(found.pictures, wanted, strict=True)) < 1 / 255


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", SCENES)
def test_every_shader_compiles_in_webgl(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    manifest = package.manifest
    programs = [*manifest.programs]
    drawn = [pair for each in programs for pair in (each, *each.passes)]
    texts = [(package.read_text(each.vertex), package.read_text(each.fragment)) for each in drawn]
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


@pytest.mark.long
@pytest.mark.parametrize("name", ["pieces", "pieces in mosaics", "segments in pieces", "segments in pieces of mosaics"])
def test_the_pieces_around_a_point_are_drawn(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)
    for point in (0, 31):
        found = drawn_in_page(browser, server, package.path, matrices, kind=kind_of(package), point=point)
        wanted = drawn_by_reference(package, matrices, point=point)
        assert max(picture[..., 3].max() for picture in wanted) > 0.1
        assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS


@pytest.mark.long
def test_pieces_have_the_light_that_was_computed_once(browser, server, scene_package) -> None:
    package = scene_package("pieces with light")
    matrices = box_from_clip_of(package)[::3]
    found = drawn_in_page(browser, server, package.path, matrices, point=31)
    wanted = drawn_by_reference(package, matrices, point=31)
    assert next(each for each in package.manifest.programs if each.sampling == "subvolumes").baked
    assert max(picture[..., 3].max() for picture in wanted) > 0.1
    assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS


@pytest.mark.long
@pytest.mark.parametrize("name", ["editable", "editable mosaic", "editable, baked light", "editable, light that turns"])
def test_an_edited_transfer_function_is_drawn_on_every_level(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)
    points = tuple(TransferPoint.model_validate(each) for each in EDIT)
    edit = TransferFunction(name="shell", points=points)
    for level in levels_of(package, "shell"):
        options = {"program": "shell", "level": level}
        how = {"kind": kind_of(package), "options": options, "edit": {"points": EDIT}}
        found = drawn_in_page(browser, server, package.path, matrices, **how)
        wanted = drawn_by_reference(package, matrices, level=level, transfer="shell", edit=edit)
        before = drawn_by_reference(package, matrices, level=level, transfer="shell")
        for picture, reference, unedited in zip(found.pictures, wanted, before, strict=True):
            assert rmse(picture, reference) < TWO_STEPS < rmse(unedited, reference) / 5


_LABELLED = ["segments", "segments in a mosaic", "segments in half-angle slices", "segments with a shadow map"]


@pytest.mark.long
@pytest.mark.parametrize("name", _LABELLED)
def test_a_segment_that_an_app_hides_is_as_one_that_the_package_hides(browser, server, scene_package, name) -> None:
    package, hidden = scene_package(name), scene_package(f"{name}, one hidden")
    matrices = box_from_clip_of(package)
    looks = [["segment-1", {"visible": False}], ["segment-2", {"opacity": 0.5}]]
    found = drawn_in_page(browser, server, package.path, matrices, kind=kind_of(package), segments=looks)
    before = drawn_by_reference(package, matrices)
    for picture, reference, other in zip(found.pictures, drawn_by_reference(hidden, matrices), before, strict=True):
        assert rmse(picture, reference) < TWO_STEPS < rmse(other, reference)


@pytest.mark.long
def test_a_segment_is_hidden_in_pieces(browser, server, scene_package) -> None:
    package, hidden = scene_package("segments in pieces"), scene_package("segments in pieces, one hidden")
    matrices = box_from_clip_of(package)[::3]
    looks = [["segment-1", {"visible": False}], ["segment-2", {"opacity": 0.5}]]
    found = drawn_in_page(browser, server, package.path, matrices, segments=looks, point=17)
    before = drawn_by_reference(package, matrices, point=17)
    wanted = drawn_by_reference(hidden, matrices, point=17)
    for picture, reference, other in zip(found.pictures, wanted, before, strict=True):
        assert rmse(picture, reference) < TWO_STEPS < rmse(other, reference)


@pytest.mark.long(keep=1)
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


@pytest.mark.long
@pytest.mark.parametrize("name", ["shadow rays", "shadow map", "half-angle slices"])
def test_what_a_plane_cuts_away_throws_no_shadow(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    light_xyz = np.linalg.inv(package.manifest.grid.world_from_box) @ [20.0, -30.0, 40.0, 1.0]
    extent_xyz = np.array(package.manifest.grid.extent_mm_zyx[::-1])
    towards = light_xyz[:3] - extent_xyz / 2
    matrix = box_from_clip_of(package)[6]
    forward = matrix[:3, 2]
    plane = np.array([*forward, -float(forward @ (matrix @ [0, 0, 0, 1])[:3])])
    # The side of the plane that the light is not on is kept: what is away was between it and the rest.
    side = -float(np.sign(forward @ towards))
    halfway = matrix @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0.5, 0.5 * side], [0, 0, 0, 1]])
    how = {"options": {"level": 0}, "clip": {"planes": [(side * plane).tolist()]}}
    found = drawn_in_page(browser, server, package.path, [matrix], **how)
    (shadowed,) = drawn_by_reference(package, [halfway], level=0)
    assert shadowed[..., 3].max() > 0.1
    assert rmse(found.pictures[0][..., 3], shadowed[..., 3]) < TWO_STEPS
    seen = shadowed[..., 3] > 0.1
    assert (found.pictures[0][..., :3] > shadowed[..., :3] - 2 * TWO_STEPS).all()
    assert found.pictures[0][seen, :3].mean() > 1.1 * shadowed[seen, :3].mean()


_ENDING = ["norm16, perspective", "mosaic of several textures", "slices across the view", "slabs"]


@pytest.mark.long
@pytest.mark.parametrize("name", [*_ENDING, "shadow rays", "shadow map", "half-angle slices"])
def test_rays_end_at_the_depth_of_what_is_opaque(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    matrix = box_from_clip_of(package)[6]
    whole_and_half = [drawn_by_reference(package, [matrix], level=0)[0]]
    depth = 110 / 255
    ends = matrix @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, depth, depth - 1], [0, 0, 0, 1]])
    whole_and_half += drawn_by_reference(package, [ends], level=0)
    assert rmse(*whole_and_half) > 2 * TWO_STEPS
    for wanted, at in zip(whole_and_half, (1.0, depth), strict=True):
        how = {"kind": kind_of(package), "options": {"level": 0}, "clip": {"depth": True}, "depth": at}
        found = drawn_in_page(browser, server, package.path, [matrix], **how)
        assert found.said["error"] == 0
        assert rmse(found.pictures[0], wanted) < TWO_STEPS


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


@pytest.mark.long
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


_LIGHTS = ["light with a place", "light at another place"]
_SHADOWS = ["half-angle slices", "half-angle slices, light at another place"]


@pytest.mark.long
@pytest.mark.parametrize("names", [_LIGHTS, _SHADOWS], ids=["light", "shadows"])
def test_a_light_that_is_moved_lights_as_if_the_package_had_it_there(browser, server, scene_package, names) -> None:
    package, other = map(scene_package, names)
    matrices = box_from_clip_of(package)[:3]
    place = list(other.manifest.level_programs[0].light.place_mm_xyz)
    found = drawn_in_page(browser, server, package.path, matrices, light=place)
    wanted = drawn_by_reference(other, matrices)
    assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS
    assert max(map(rmse, drawn_by_reference(package, matrices), wanted)) > 2 * TWO_STEPS
    for light, words in (([1.0, 2.0], "three numbers"), (["x", 0, 0], "three numbers")):
        with pytest.raises(Exception, match=f"VP7063.*{words}"):
            drawn_in_page(browser, server, package.path, matrices, light=light)
    with pytest.raises(Exception, match=r"VP7063.*no program of the package is lit"):
        drawn_in_page(browser, server, scene_package("mipmaps").path, matrices, light=place)


TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@pytest.mark.long
def test_an_app_turns_the_light_around_the_volume(browser, server, scene_package) -> None:
    package = scene_package("light that turns, in a mosaic")
    matrices = box_from_clip_of(package)[:3]
    how = {"kind": kind_of(package)}
    found = drawn_in_page(browser, server, package.path, matrices, light={"turn": TURN.ravel().tolist()}, **how)
    with Renderer(package, edit=turned_by(TURN)) as renderer:
        wanted = [renderer.render(matrix, (SIZE, SIZE)) for matrix in matrices]
    assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS
    assert max(map(rmse, drawn_by_reference(package, matrices), wanted)) > 2 * TWO_STEPS
    dark = {"sky": [0.0] * 3, "ground": [0.0] * 3, "suns": []}
    unlit = drawn_in_page(browser, server, package.path, matrices, light=dark, **how)
    assert max(picture[..., :3].max() for picture in unlit.pictures) == 0.0
    wrong = (
        {"turn": [2.0, 0, 0, 0, 1, 0, 0, 0, 1]},
        {"sky": [1.0]},
        {"suns": [{"direction": [0, 0, 0]}]},
        [1.0, 2.0, 3.0],
    )
    for light, words in zip(wrong, ("rotation", "sky", "sun", "a light with a place"), strict=True):
        with pytest.raises(Exception, match=f"VP7063.*{words}"):
            drawn_in_page(browser, server, package.path, matrices, light=light, **how)


@pytest.mark.long
def test_a_light_that_throws_shadows_is_not_moved_into_the_volume(browser, server, scene_package) -> None:
    for name in ("shadow map", "half-angle slices"):
        package = scene_package(name)
        grid = package.manifest.grid
        middle = grid.world_from_box @ [*(np.array(grid.extent_mm_zyx[::-1]) / 2), 1.0]
        with pytest.raises(Exception, match=r"VP7063.*in the volume"):
            drawn_in_page(browser, server, package.path, [], light=middle[:3].tolist())


def test_a_technique_that_a_later_volprep_may_bring_is_refused_by_name(
    browser, server, scene_package, tmp_path
) -> None:
    package = scene_package("slabs")
    copy = shutil.copytree(package.path, tmp_path / "p.volpkg")
    text = (copy / "manifest.json").read_text()
    assert '"technique": "slabs"' in text
    (copy / "manifest.json").write_text(text.replace('"technique": "slabs"', '"technique": "by-magic"'))
    with pytest.raises(Exception, match=r"VP4004 .*technique is not one of its words"):
        drawn_in_page(browser, server, copy, box_from_clip_of(package))


def test_each_level_is_drawn_with_its_own_step(browser, server, scene_package) -> None:
    package = scene_package("steps of levels")
    steps = {each.level: each.step_mm for each in package.manifest.picture("shell").drawings}
    assert len(set(steps.values())) > 1
    for level, step in steps.items():
        found = drawn_in_page(browser, server, package.path, [], options={"level": level})
        assert found.said["step"] == step


@pytest.fixture
def compressed(scene_package, tmp_path) -> Path:
    """A package whose meshes are compressed, however little that saves."""
    copy = Path(shutil.copytree(scene_package("meshes").path, tmp_path / "p.volpkg"))
    manifest = json.loads((copy / "manifest.json").read_text())
    for mesh in manifest["proxy"]["meshes"]:
        glb = read_glb((copy / mesh["file"]).read_bytes(), mesh["file"])
        data = write_glb(glb.primitives, glb.scale_mm_xyz, {}, draco=True)
        mesh["draco"] = True
        replace_file(copy, manifest, mesh["file"], data)
    return copy


def replace_file(folder: Path, manifest: dict[str, Any], path: str, data: bytes) -> None:
    (folder / path).write_bytes(data)
    record = next(each for each in manifest["files"] if each["path"] == path)
    record |= {"size_bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    (folder / "manifest.json").write_text(json.dumps(manifest))


@pytest.mark.long
@pytest.mark.parametrize("decoder", ["none", "draco3d"])
def test_a_mesh_that_is_compressed_needs_a_decoder_of_the_app(
    browser, server, scene_package, compressed, decoder
) -> None:
    package = scene_package("meshes")
    matrices = box_from_clip_of(package)
    how: dict[str, Any] = {"options": {"program": "core", "level": 0}}
    if decoder != "none":
        server.folders["draco"] = npm_package("draco3d", "1.5.7") / "node_modules" / "draco3d"
        how["draco"] = "/draco"
    found = drawn_in_page(browser, server, compressed, matrices, **how)
    if decoder == "none":
        assert [note.split()[0] for note in found.said["notes"]] == ["VP7064"]
        assert "decodeDraco" in found.said["notes"][0]
    else:
        assert found.said["notes"] == []
    wanted = drawn_by_reference(package, matrices, transfer="core", level=0)
    assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS
    # The mesh changes no bit.
    plain = drawn_in_page(browser, server, package.path, matrices, options=how["options"])
    assert all((one == other).all() for one, other in zip(found.pictures, plain.pictures, strict=True))


def test_what_a_decoder_does_not_unpack_is_refused_before_it_takes_minutes(browser, server, compressed) -> None:
    matrices = [np.eye(4)]
    how = {"options": {"program": "core", "level": 0}}
    with pytest.raises(Exception, match=r"VP4039.*Draco: Error: no memory"):
        drawn_in_page(browser, server, compressed, matrices, draco="broken", **how)
    manifest = json.loads((compressed / "manifest.json").read_text())
    for mesh in manifest["proxy"]["meshes"]:
        data = (compressed / mesh["file"]).read_bytes()
        at = data.index(b"DRACO\x02\x02") + 12
        # 2^28 - 1 vertices.
        replace_file(compressed, manifest, mesh["file"], data[:at] + b"\xff\xff\xff\x7f" + data[at + 4 :])
    with pytest.raises(Exception, match=r"VP4039.*268435455 vertices"):
        drawn_in_page(browser, server, compressed, matrices, draco="broken", **how)
