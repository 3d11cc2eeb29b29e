"""The nine views of a real head agree with those of an independent renderer, VTK, in orientation and shape.

VTK gets the voxels, the grid and the cameras as eye, direction and up vector; it knows nothing of box space, of our
matrices or of the package. A mirrored, upside-down or exchanged view must score clearly lower, or this test would
prove nothing.
"""

from pathlib import Path

import numpy as np
import pytest
from scene_builds import built

from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.volume import Volume
from volprep.validation.witness.vtk_views import draw_views
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

pytestmark = pytest.mark.long

SIZE = 128
# Skin begins at 25 and is opaque within millimetres; below is the noise of the air.
LOW, HIGH, EXTINCTION_PER_MM = 25.0, 65.0, 0.4
SCENE = f"""
name = "head"
profile = "gles3"
[source]
path = "{{path}}"
[pyramid]
coarsest_longest_axis = 512
[[transfer]]
name = "skin"
points = [
    {{{{ value = {LOW}, colour = "#ffffff", extinction_per_mm = 0.0 }}}},
    {{{{ value = {HIGH}, colour = "#ffffff", extinction_per_mm = {EXTINCTION_PER_MM} }}}},
]
"""
TURNS = {
    "mirrored": lambda picture: picture[:, ::-1],
    "upside down": lambda picture: picture[::-1],
    "turned by half": lambda picture: picture[::-1, ::-1],
}


@pytest.fixture(scope="module")
def pictures(scans, tmp_path_factory) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Opacity [H, W] of each standard view: ours, drawn from the package, and VTK's."""
    source = scans / "mr_t1_studyforrest"
    folder = tmp_path_factory.mktemp("head")
    scene = folder / "head.toml"
    scene.write_text(SCENE.format(path=source))
    built(scene, folder / "head.volpkg")
    with open_source(SourceSpec(path=str(source)), Path("/"), Silent()) as head:
        grid = head.info.grid
        scan = Volume(head.read_slab(0, grid.shape_zyx[0]), grid, head.info.slope, head.info.intercept)
    package = Package.open(folder / "head.volpkg")
    # The package may have lost an empty border; VTK draws the whole scan.
    kept = package.manifest.levels[0].grid
    views = standard_views(kept)
    with Renderer(package) as renderer:
        ours = [renderer.render(camera.box_from_clip(kept, 1.0), (SIZE, SIZE))[..., 3] for camera in views.values()]
    function = package.manifest.transfer_functions[0]
    theirs = draw_views(scan, function, "composite", list(views.values()), pixels=SIZE, scratch=folder).fine[..., 3]
    return dict(zip(views, zip(ours, theirs, strict=True), strict=True))


def overlap(first: np.ndarray, second: np.ndarray) -> float:
    """Intersection over union of what is more opaque than half."""
    one, other = first > 0.5, second > 0.5
    return float((one & other).sum() / (one | other).sum())


def test_every_view_shows_a_head_that_fills_a_good_part_of_the_picture(pictures) -> None:
    for name, (ours, theirs) in pictures.items():
        for picture in (ours, theirs):
            assert 0.1 < (picture > 0.5).mean() < 0.5, name


def test_the_silhouettes_agree_with_vtk(pictures) -> None:
    # Found 0.998 to 0.9997: the rest is pixels at the edge, where VTK takes other samples than we do.
    overlaps = {name: overlap(ours, theirs) for name, (ours, theirs) in pictures.items()}
    assert min(overlaps.values()) > 0.99, overlaps


def test_the_opacities_agree_with_vtk(pictures) -> None:
    differences = {name: float(np.abs(ours - theirs).mean()) for name, (ours, theirs) in pictures.items()}
    # VTK's target has 8 bits: 0.002 is half a code. Found 0.0006 to 0.0008.
    assert max(differences.values()) < 0.002, differences


@pytest.mark.parametrize("turn", TURNS)
def test_a_turned_picture_agrees_clearly_less(pictures, turn) -> None:
    # The head is nearly symmetric: mirrored from above it comes to 0.898, the other turns to 0.80 at most.
    overlaps = {name: overlap(TURNS[turn](ours), theirs) for name, (ours, theirs) in pictures.items()}
    assert max(overlaps.values()) < 0.95, overlaps


def test_each_view_agrees_with_no_other_view_of_vtk(pictures) -> None:
    overlaps = {
        (name, other): overlap(ours, theirs)
        for name, (ours, _) in pictures.items()
        for other, (_, theirs) in pictures.items()
        if other != name
    }
    assert max(overlaps.values()) < 0.95, overlaps
