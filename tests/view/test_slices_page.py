"""The page of slices: WebGL draws the stacks of OpenGL ES 1.1, and an edit uploads their palettes alone."""

import numpy as np
import pytest
from slice_packages import missing_es11, slice_package
from tiny_packages import function
from view_page import opened, picture, served

from volprep.parts.editing.inputs import FunctionEdit
from volprep.render.renderers import renderer_of
from volprep.render.slices import SliceRenderer

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")
EDIT = function((20.0, (0.1, 0.9, 0.3), 0.0), (255.0, (1.0, 0.8, 0.1), 0.5), name="ramp")


@pytest.fixture(scope="module", params=[1, 3], ids=["one layer", "three layers"])
def package(request, tmp_path_factory):
    z, y, x = np.mgrid[:11, :14, :16]
    codes = 110 + 80 * np.sin(x / 2.0) * np.cos(y / 3.0) + 60 * np.sin(z / 2.0)
    folder = tmp_path_factory.mktemp("slices")
    layers = f"layers = {request.param}"
    return slice_package(folder, np.clip(codes, 0, 255), (2.0, 1.0, 1.5), head="editable = true", slices=layers)


def reference(page, package, renderer):
    """The picture of the reference renderer for the camera and the size of the page."""
    drawn = picture(page)
    matrix = page.run("return window.volprep.stage.orbit.boxFromClip(1)")
    with renderer:
        side = drawn.shape[0]
        return drawn, renderer.render(np.reshape(matrix, (4, 4)).T, (side, side))


@pytest.mark.long
def test_the_page_draws_slices_as_the_reference_does_before_and_after_an_edit(browser, package) -> None:
    with served(package.path) as server:
        assert opened(browser, server.url) == "ready"
        drawn, expected = reference(browser, package, SliceRenderer(package))
        assert drawn.shape == expected.shape
        assert expected[..., 3].max() > 0.5
        # Each of eleven slices is rounded to 8 bits by either driver; edges of slices cut other pixels.
        assert np.sqrt(((drawn - expected) ** 2).mean()) < 2 / 255
        points = [point.model_dump() for point in EDIT.points]
        browser.run("await window.volprep.stage.renderer.setTransfer({ points: given[0] }, 'ramp')", points)
        after, expected = reference(browser, package, renderer_of(package, edit=FunctionEdit(EDIT)))
        assert np.sqrt(((after - expected) ** 2).mean()) < 2 / 255
        assert np.abs(after - drawn).max() > 0.1
        stacks = len(package.manifest.textures)
        assert browser.run("return window.volprep.stage.renderer.edited") == 1024 * stacks
        assert browser.console == []
        assert browser.run("return document.querySelectorAll('#function button').length") > 0
