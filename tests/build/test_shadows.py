"""Shadows: from the scene to the picture and the verdict."""

import numpy as np
import pytest
import scene_builds
from judged import validate
from scene_builds import planned, view_of

from volprep.compositing import COMPOSITINGS
from volprep.render.inputs import light_from_box
from volprep.render.renderer import Renderer
from volprep.truth.decoded import level_volume
from volprep.truth.volume import Medium
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package

SHAPE_ZYX = (20, 14, 24)
SPACING = (1.0, 1.2, 0.8)
HW = (40, 40)
SCENE = """name = "shadows"
profile = "{profile}"
crop = "none"
{top}
[source]
path = "voxels.raw"
raw = {{ shape_zyx = [20, 14, 24], dtype = "uint8", spacing_mm_zyx = [1.0, 1.2, 0.8] }}
[pyramid]
coarsest_longest_axis = 24
[quantize]
window = [0.0, 255.0]
[tolerance]
maximum = 1.0
[render]
lighting = "{lighting}"
picture_size = 40
{render}
[lighting]
{light}
[[transfer]]
name = "all"
reference_mm = 3.0
isovalue = 127.5
points = [
    {points}
]
"""
POINT = '{{ value = {}, colour = "{}", extinction_per_mm = {} }},'
FOG = "\n    ".join(
    POINT.format(value, "#ffffff", tau) for value, tau in ((0, 0.02), (127.5, 0.02), (127.5, 40), (255, 40))
)
SOFT = "\n    ".join(POINT.format(*each) for each in ((20, "#ff8040", 0.0), (200, "#ffc0a0", 0.6)))
ABOVE = "light_mm = [30.0, 7.8, 60.0]"
INSIDE = "light_mm = [17.5, 9.0, 18.0]"
MAP = '\nnormals = "central"\nshadows = "map"\n'
HALF = MAP.replace("map", "half-angle")
SURFACE = 'compositing = "isosurface"'
RAYS = '\nnormals = "central"\nshadows = "rays"\n'


def blobs():
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) * h for n, h in zip(SHAPE_ZYX, SPACING, strict=True)), indexing="ij")
    one, other = (np.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) for a, b, c in ((7, 8, 6), (13, 9, 14)))
    return np.rint(255 * np.clip((6 - np.minimum(one, other + 1.5)) / 4, 0, 1)).astype(np.uint8)


def scene_of(  # noqa: PLR0917 - keys of a scene
    folder, light=ABOVE + RAYS, render="", lighting="phong", profile="gles3", top="", voxels=None, points=SOFT
):
    folder.mkdir(parents=True, exist_ok=True)
    (blobs() if voxels is None else voxels).tofile(folder / "voxels.raw")
    text = SCENE.format(profile=profile, top=top, lighting=lighting, render=render, light=light, points=points)
    (folder / "shadows.toml").write_text(text, encoding="utf-8")
    return folder / "shadows.toml"


def built(folder, *scene, **wishes):
    return scene_builds.built(scene_of(folder, *scene, **wishes), folder / "shadows.volpkg")


def drawn(package, matrix, step_mm=None):
    with Renderer(package, target="rgba32f") as renderer:
        return renderer.render(matrix, HW, step_mm)


def truth_of(package, matrix):
    volume = level_volume(package, 0)
    medium = Medium(volume, package.manifest.transfer_functions[0])
    oracle = COMPOSITINGS[package.manifest.level_programs[0].compositing].oracle
    return oracle([medium], matrix, HW)


def camera(package, view="anterior-left", projection="orthographic"):
    grid = package.manifest.levels[0].grid
    return view_of(grid, view, projection)


def rmse(picture, truth):
    return float(np.sqrt(np.mean((picture - truth) ** 2)))


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("light", "shadows", "view"),
    [
        (ABOVE, "rays", "anterior-left"),
        (INSIDE, "rays", "anterior-left"),
        (ABOVE, "half-angle", "anterior-left"),
        (ABOVE, "half-angle", "inferior"),
    ],
    ids=["outside", "inside", "half-angle", "light-from-behind"],
)
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_shadows_of_what_absorbs_converge_to_the_refined_picture(tmp_path, light, shadows, view, projection):
    technique = "view-slices" if shadows == "half-angle" else "slabs"
    render = f'technique = "{technique}"\nopacity_cutoff = 1.0'
    package = built(tmp_path, light + RAYS.replace("rays", shadows), render=render)
    matrix = camera(package, view, projection)
    truth = truth_of(package, matrix)
    assert truth.bound.max() <= 1e-6
    errors = [rmse(drawn(package, matrix, step), truth.rgba) for step in (0.8, 0.4, 0.2)]
    assert errors[0] < 2 / 255
    # The light of half-angle slices is in half floats.
    assert errors[2] < errors[0] / 3
    assert errors[2] < 5e-4
    bare = truth_of(built(tmp_path / "bare", light + RAYS.replace("rays", "none")), matrix).rgba
    assert (truth.rgba[..., :3] <= bare[..., :3] + 2e-6).all()
    assert np.abs(truth.rgba[..., 3] - bare[..., 3]).max() < 2e-6
    assert (bare - truth.rgba).max() > 0.05


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("compositing", ["isosurface", "first-hit"])
@pytest.mark.parametrize(
    ("light", "shadows"), [(ABOVE, "rays"), (INSIDE, "rays"), (ABOVE, "map")], ids=["outside", "inside", "map"]
)
def test_shadows_of_a_surface_are_those_of_exact_roots(tmp_path, light, shadows, compositing):
    package = built(
        tmp_path, light + RAYS.replace("rays", shadows), render=f'compositing = "{compositing}"\nstep_voxels = 0.2'
    )
    dark = built(tmp_path / "dark", light + RAYS.replace("rays", "none"), render=f'compositing = "{compositing}"')
    for view in ("anterior-left", "superior"):
        matrix = camera(package, view)
        picture, truth, bare = drawn(package, matrix), truth_of(package, matrix).rgba, truth_of(dark, matrix).rgba
        assert ((bare - truth).max(axis=-1) > 0.1).sum() > 10
        # A ray that touches a surface only just may see it or not, and so may one to the light.
        differs = np.abs(picture - truth).max(axis=-1) > 2e-3
        assert differs.sum() <= 3


def half_plane():
    """An opaque plate over half of the volume, its edge along y, in fog."""
    voxels = np.zeros(SHAPE_ZYX, np.uint8)
    voxels[14:17, :, :12] = 255
    return voxels


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("source", ["rays", "half-angle", "oracle"])
def test_the_shadow_of_an_opaque_half_plane_is_a_half_space(tmp_path, source):
    """Seen along the edge: what lies behind the plane through the light and the edge has ambient light, no other."""
    technique, shadows = ("view-slices", source) if source == "half-angle" else ("slabs", "rays")
    render = f'technique = "{technique}"\nstep_voxels = 0.25\nopacity_cutoff = 1.0'
    light = ABOVE + RAYS.replace("rays", shadows)
    package = built(tmp_path, render=render, voxels=half_plane(), points=FOG, light=light)
    matrix = camera(package, "anterior")
    picture = truth_of(package, matrix).rgba if source == "oracle" else drawn(package, matrix)
    row, column = np.indices(HW)
    clip = np.stack([(2 * column + 1) / 40 - 1, 1 - (2 * row + 1) / 40, np.zeros(HW), np.ones(HW)], axis=-1)
    x, _, z, _ = np.moveaxis(clip @ matrix.T, -1, 0)
    # Box space begins half a voxel before the first centre, which is the patient's origin.
    light_x, light_z = 30.0 + 0.4, 60.0 + 0.5
    edges = ((12 * 0.8, 14.0), (12 * 0.8, 17.0))
    behind = [edge_x + (light_x - edge_x) * (z - edge_z) / (light_z - edge_z) - x for edge_x, edge_z in edges]
    inside = (picture[..., 3] > 0.2) & (picture[..., 3] < 0.5)
    below = inside & (z < 13.5)
    shadow, light = below & (np.minimum(*behind) > 0.3), below & (np.maximum(*behind) < -0.3)
    assert shadow.sum() > 30
    assert light.sum() > 30
    colour = picture[..., 0] / picture[..., 3].clip(1e-9)
    assert np.abs(colour[shadow] - 0.2).max() < 1e-3
    # What is not in the shadow is seen through fog only.
    paths = np.exp(-0.02 * np.hypot(light_x - x, light_z - z).clip(0, 30))
    assert (colour[light] > 0.2 + 0.8 * paths[light] - 0.05).all()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "wishes",
    [
        {"render": 'technique = "slabs"'},
        {"render": 'technique = "two-pass"'},
        {"render": 'compositing = "back-to-front"'},
        {"render": 'classification = "control-points"'},
        {"render": "", "top": '[skip]\nkind = "none"'},
        {"render": "", "top": '[proxy]\nform = "blocks"\nblock = 4'},
    ],
)
def test_shadows_are_the_same_whatever_else_a_program_does(tmp_path, wishes):
    wishes = {**wishes, "render": f"opacity_cutoff = 1.0\nstep_voxels = 0.5\n{wishes['render']}"}
    one = built(tmp_path / "one", render="opacity_cutoff = 1.0\nstep_voxels = 0.5")
    other = built(tmp_path / "other", **wishes)
    matrix = camera(one)
    assert np.abs(drawn(one, matrix) - drawn(other, matrix)).max() < 1e-3


def test_a_preintegrated_table_throws_the_shadow_of_its_segments(tmp_path):
    package = built(tmp_path, render='classification = "preintegrated"\nopacity_cutoff = 1.0\nstep_voxels = 0.5')
    matrix = camera(package)
    assert rmse(drawn(package, matrix), truth_of(package, matrix).rgba) < 2 / 255


@pytest.mark.long
@pytest.mark.parametrize(
    ("shadows", "render"),
    [
        ("rays", 'technique = "slabs"'),
        ("map", 'compositing = "isosurface"'),
        ("half-angle", 'technique = "view-slices"'),
    ],
)
def test_a_package_with_shadows_is_validated(tmp_path, shadows, render):
    scene = scene_of(tmp_path, ABOVE + RAYS.replace("rays", shadows), render=render)
    if "isosurface" in render:
        # The edge of the shadow takes or leaves a whole pixel of the few: two or three of all in nine views.
        scene.write_text(scene.read_text().replace("maximum = 1.0", "maximum = 1.0\nrmse = 0.04\nflip = 0.12"))
    package = scene_builds.built(scene, tmp_path / "shadows.volpkg")
    assert check(package.path) == []
    report = validate(package.path, tmp_path / "report", picture_size=16)
    assert report.verdict.failed == 0, report.verdict
    assert report.verdict.differing == ()


def test_without_shadows_no_shader_asks_for_them(tmp_path):
    package = built(tmp_path, ABOVE + '\nnormals = "central"\n')
    text = package.read_text(package.manifest.level_programs[0].fragment)
    assert "light_reaching" not in text
    assert "reaching" not in text


def test_steps_that_take_more_turns_than_the_driver_makes_are_refused_and_slabs_take_few(tmp_path):
    matrix = camera(built(tmp_path / "one"))
    with Renderer(Package.open(tmp_path / "one" / "shadows.volpkg")) as renderer:
        if not renderer.draws_step(0.05):
            with pytest.raises(VolprepError, match="VP5024"):
                renderer.render(matrix, (4, 4), 0.05)
    with Renderer(built(tmp_path / "slabs", render='technique = "slabs"')) as renderer:
        assert renderer.draws_step(0.05)


@pytest.mark.parametrize(
    ("wishes", "code", "what"),
    [
        ({"lighting": "none"}, "VP3160", "render.lighting is none"),
        ({"lighting": "headlight"}, "VP3160", "render.lighting is headlight"),
        ({"light": 'shadows = "rays"'}, "VP3119", "light_mm"),
        ({"profile": "gles2-2048"}, "VP3161", "OpenGL ES 3.0"),
        ({"profile": "gles1"}, "VP3161", "es1.1"),
        ({"render": 'technique = "view-slices"'}, "VP3162", "technique view-slices"),
        ({"top": "[grid]\nsize = 16"}, "VP3162", r"\[grid\]"),
        ({"light": 'shadows = "soft"'}, "VP3003", "shadows"),
        ({"light": ABOVE + MAP}, "VP3162", "compositing emission-absorption"),
        ({"light": ABOVE + MAP, "render": SURFACE + '\ntechnique = "two-pass"'}, "VP3162", "technique two-pass"),
        ({"light": ABOVE + MAP, "render": SURFACE, "top": "[proxy]"}, "VP3162", r"\[proxy\]"),
        ({"light": INSIDE + MAP, "render": SURFACE}, "VP3163", "outside the volume"),
        ({"light": ABOVE + HALF}, "VP3162", "technique ray-casting"),
        ({"light": INSIDE + HALF, "render": 'technique = "view-slices"'}, "VP3163", "half-angle needs a light outside"),
    ],
)
def test_shadows_that_cannot_be_are_refused(tmp_path, wishes, code, what):
    with pytest.raises(VolprepError, match=what) as found:
        planned(scene_of(tmp_path, **wishes))
    assert found.value.code == code


@pytest.mark.parametrize("place", [(-1e-3, 5.0, 5.0), (30.0, 7.8, 60.0), (-900.0, -3.0, 4.0), (11.0, 3.0, 1e5)])
def test_the_view_of_a_light_just_holds_the_volume(place):
    extent = np.array([19.2, 16.8, 20.0])
    matrix = light_from_box(np.array(place), extent)
    corners = np.array([[x, y, z, 1] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * [*extent, 1]
    seen = corners @ matrix.T
    assert (seen[:, 3] > 0).all()
    seen = seen[:, :3] / seen[:, 3:]
    assert np.abs(seen).max() <= 1.0
    assert np.ptp(seen[:, :2], axis=0).min() > 1.95
    near = np.linalg.inv(matrix) @ [0.3, -0.2, -1.0, 1.0]
    far = np.linalg.inv(matrix) @ [0.3, -0.2, 1.0, 1.0]
    near, far = near[:3] / near[3], far[:3] / far[3]
    # The light is on the line through both ends of a ray, in front of the near one.
    across = np.cross(far - near, np.array(place) - near)
    assert np.linalg.norm(across) < 1e-6 * np.linalg.norm(far - near) * np.linalg.norm(far - np.array(place))
    assert (near - np.array(place)) @ (far - near) > 0


@pytest.mark.parametrize("place", [(5.0, 5.0, 5.0), (0.0, 5.0, 5.0), (19.2, 16.8, 20.0)])
def test_a_light_that_moves_into_the_volume_has_no_shadow_map(place):
    with pytest.raises(VolprepError, match="VP5040"):
        light_from_box(np.array(place), np.array([19.2, 16.8, 20.0]))


def eye_at(eye_mm, towards_mm, near_mm=0.05, far_mm=90.0):
    """Box space from clip coordinates, for an eye anywhere."""
    forward = np.subtract(towards_mm, eye_mm) / np.linalg.norm(np.subtract(towards_mm, eye_mm))
    right = np.cross(forward, [0.3, 0.2, 0.9])
    right /= np.linalg.norm(right)
    box_from_eye = np.eye(4)
    box_from_eye[:3, :3] = np.column_stack([right, np.cross(right, forward), -forward])
    box_from_eye[:3, 3] = eye_mm
    depth = far_mm - near_mm
    clip_from_eye = np.diag([1.25, 1.25, -(near_mm + far_mm) / depth, 0.0])
    clip_from_eye[2:, 2:] += [[0.0, -2 * near_mm * far_mm / depth], [-1.0, 0.0]]
    return box_from_eye @ np.linalg.inv(clip_from_eye)


KINDS = {"rays": 'technique = "slabs"', "half-angle": 'technique = "view-slices"', "map": SURFACE}


@pytest.mark.long
@pytest.mark.parametrize("shadows", KINDS)
def test_a_camera_may_stand_anywhere_and_pictures_have_any_size(tmp_path, shadows):
    package = built(tmp_path, ABOVE + RAYS.replace("rays", shadows), render=f"{KINDS[shadows]}\nopacity_cutoff = 1.0")
    middle = (9.6, 8.4, 10.0)
    cameras = {
        "inside": eye_at((8.0, 2.5, 9.0), (10.0, 9.0, 11.0)),
        "on-a-face": eye_at((0.0, 7.0, 12.0), middle),
        "near": eye_at((-1.0, -2.0, -1.5), middle, near_mm=6.0),
    }
    with Renderer(package, target="rgba32f") as renderer:
        for name, matrix in cameras.items():
            truth = truth_of(package, matrix).rgba
            assert truth[..., 3].max() > 0.5, name
            wrong = np.abs(renderer.render(matrix, HW, 0.3) - truth).max(axis=-1) > 0.04
            assert wrong.sum() <= (8 if shadows == "map" else 2), (name, wrong.sum())
        assert not renderer.render(eye_at((-3.0, -4.0, -5.0), (-9.0, -12.0, -15.0)), HW).any()
        far = renderer.render(eye_at((-3e3, -4e3, -5e3), middle, near_mm=1e3, far_mm=1e4), (41, 41))
        assert np.isfinite(far).all()
        assert renderer.render(cameras["near"], (1, 1)).shape == (1, 1, 4)
        assert renderer.render(cameras["near"], (1, 8192), 2.0)[..., 3].max() > 0.5
        with pytest.raises(VolprepError, match="VP5009"):
            renderer.render(cameras["near"], (0, 5))
        renderer.render(cameras["near"], (2, 3), 2.0)
        first = +renderer._gl.live
        for number in range(30):
            renderer.render(cameras["near"], (2 + number % 3, 3), 2.0)
        assert +renderer._gl.live == first


STACKS = {
    "view-slices": ("view-slices", "none"),
    "half-angle": ("view-slices", "half-angle"),
    "as-published": ("view-slices-as-published", "none"),
}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("stack", STACKS)
def test_a_ray_from_within_a_layer_meets_it_once(tmp_path, stack):
    technique, shadows = STACKS[stack]
    points = "\n    ".join(POINT.format(value, "#ffffff", 0.01) for value in (0, 255))
    light = ABOVE + RAYS.replace("rays", shadows)
    render = f'technique = "{technique}"\nopacity_cutoff = 1.0'
    package = built(tmp_path, light, render=render, voxels=np.full(SHAPE_ZYX, 99, np.uint8), points=points)
    # Some of the rays go against the stack of half-angle slices.
    matrix = eye_at((8.0, 2.5, 9.0), (10.0, 9.0, 11.0)) @ np.diag([3.0, 3.0, 1.0, 1.0])
    diagonal = float(np.hypot(np.hypot(19.2, 16.8), 20.0))
    # One layer; two would part in the middle of the volume.
    alpha = drawn(package, matrix, 4 * diagonal)[..., 3]
    if stack == "as-published":
        assert np.abs(alpha[..., None] - [0.0, 0.01 * diagonal]).min(axis=-1).max() < 1e-3
        assert alpha.any()
    else:
        assert np.abs(alpha - truth_of(package, matrix).rgba[..., 3]).max() < 2e-4
