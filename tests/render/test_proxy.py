"""Pictures with and without proxy geometry are the same: rays begin at the mesh, samples stay in place."""

import re

import numpy as np
import pytest
from blobs import DIRECTIONS, SHELLS, blobs, check_same
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.render.camera import Camera, standard_views
from volprep.render.proxy_renderer import ProxyRenderer
from volprep.render.renderer import Renderer
from volprep.scene import NormalSettings, ProxySettings
from volprep_formats.grid import Grid

FORMS = ["blocks", "merged", "convex", "box"]
profiles = pytest.mark.parametrize("profile", [ES3, ES2], ids=["texture3d", "mosaic"])


def pictures(package, views, projection="orthographic", *, level=0, shape=(60, 75)):
    """The same views without the mesh and with it."""
    grid = package.manifest.levels[0].grid
    cameras = standard_views(grid, projection)
    found = []
    for kind in (Renderer, ProxyRenderer):
        with kind(package, level=level, target="rgba32f") as renderer:
            each = [
                renderer.render(cameras[view].box_from_clip(grid, shape[1] / shape[0]), shape) for view in views
            ]
        found.append(np.stack(each))
    return found


@profiles
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_beginning_at_the_mesh_changes_no_pixel(tmp_path, profile, form, projection):
    seed = FORMS.index(form)
    direction = list(DIRECTIONS.values())[seed % 3]
    shape, spacing = ((37, 41, 53), (2.0, 0.7, 1.1)) if projection == "perspective" else ((45, 33, 29), (0.8, 1.3, 0.9))
    grid = Grid.of(shape, spacing, (4.0, -9.0, 2.0), direction)
    proxy = ProxySettings(form=form, block=(4, 3, 5, 8)[seed])
    package = tiny_package(tmp_path / "p", blobs(seed + 30, shape), SHELLS, profile, grid=grid, proxy=proxy)
    plain, begun = pictures(package, ("anterior", "superior", "left", "anterior-right", "posterior-left"), projection)
    assert plain[..., 3].max() > 0.5
    check_same(begun, plain)
