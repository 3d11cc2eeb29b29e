"""Slices whose transfer functions users may edit: an edit replaces the palettes, one kilobyte for each texture."""

import numpy as np
import pytest
from command_line import volprep
from judged import validate
from slice_packages import missing_es11, slice_package

from volprep.parts.editing.inputs import FunctionEdit
from volprep.render.renderers import renderer_of
from volprep.render.slices import SliceRenderer
from volprep.scene.request import load_edit
from volprep.truth.camera import standard_views
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.textures import paletted

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")

AFTER = (
    "{ value = 0.0, colour = [0.2, 0.9, 0.1], extinction_per_mm = 0.0 }, "
    "{ value = 90.0, colour = [1.0, 1.0, 0.2], extinction_per_mm = 0.02 }, "
    "{ value = 255.0, colour = [0.1, 0.2, 1.0], extinction_per_mm = 0.6 }"
)
SPACING = (2.0, 1.0, 1.5)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """An editable package, one that was built with the edited function, and the file of that function."""
    folder = tmp_path_factory.mktemp("editable")
    z, y, x = np.mgrid[:9, :12, :10]
    codes = 100 + 90 * np.sin(x / 2.0) * np.cos(y / 3.0) + 60 * np.sin(z / 2.0)
    codes = np.clip(np.rint(codes), 0, 255)
    before = slice_package(folder / "before", codes, SPACING, head="editable = true")
    after = slice_package(folder / "after", codes, SPACING, points=AFTER)
    (folder / "edit.toml").write_text(f"points = [{AFTER}]")
    return before, after, folder / "edit.toml"


def drawn(renderer):
    grid = renderer.level.grid
    views = standard_views(grid)
    with renderer:
        return [renderer.render(views[name].box_from_clip(grid, 1.0), (32, 32)) for name in ("anterior", "left")]


def test_an_edit_is_drawn_as_a_package_that_was_built_with_it(pair):
    before, after, file = pair
    edit = load_edit(file, before.manifest.levels[0].grid)
    pictures = drawn(renderer_of(before, edit=FunctionEdit(edit)))
    np.testing.assert_array_equal(pictures, drawn(SliceRenderer(after)))
    assert not np.allclose(pictures, drawn(SliceRenderer(before)), atol=0.05)


def test_texels_are_codes_and_nothing_but_the_palette_depends_on_the_function(pair):
    before, _, _ = pair
    assert before.manifest.editing is not None
    assert check(before.path) == []
    codes = np.fromfile(before.path.parent / "tiny.raw", np.uint8).reshape(9, 12, 10)
    for texture in before.manifest.textures:
        layout = texture.slices
        _, indices = paletted.decode(before.read_bytes(texture.file), texture.shape_zyx[1:], texture.file)
        rows, columns = layout.slice_shape_yx
        first = np.take(codes, layout.first, axis="zyx".index(layout.axis))
        np.testing.assert_array_equal(indices[:rows, :columns], first)
    (item,) = (each for each in before.manifest.plan if each.name == "slices of ramp across z")
    assert "an edit replaces 1 kB" in item.reason


def test_what_leaves_codes_without_an_entry_is_refused(tmp_path):
    for settings, what in (('form = "rgba"', "form rgba"), ("palette_entries = 30", "palette_entries 30")):
        with pytest.raises(VolprepError, match=f"VP3080 .*{what}"):
            slice_package(tmp_path, np.zeros((3, 3, 3)), head="editable = true", slices=settings)


def test_an_edit_of_other_slices_is_refused(pair):
    _, after, file = pair
    with pytest.raises(VolprepError, match="VP5023"):
        renderer_of(after, edit=FunctionEdit(load_edit(file, after.manifest.levels[0].grid)))


def test_the_command_draws_an_edit(pair, tmp_path):
    before, _, file = pair
    done = volprep("render", before.path, "-o", tmp_path / "p.png", "--edit", file, "--size", "24x24")
    assert done.returncode == 0, done.stderr


def test_validation_judges_edited_palettes(pair, tmp_path):
    report = validate(pair[0].path, tmp_path / "report")
    (edited,) = report.programs[0].others
    assert "palettes of an edited ramp" in edited.item
    # Classified before the filter: as far off as the slices themselves.
    assert edited.rmse < 2 * max(view.seen.rmse for view in report.programs[0].views) + 0.01
