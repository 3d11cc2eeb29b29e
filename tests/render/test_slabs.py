"""Pictures that are made slab by slab: the samples are those of one draw, whatever else the program does."""

from itertools import pairwise

import numpy as np
import pytest
from blobs import SHELLS, blobs
from scene_builds import view_of
from tiny_packages import ES2, ES3, tiny_package

from volprep.parts.mosaic.packing import Packing
from volprep.render.renderer import Renderer
from volprep.shading.slabs import SLAB_SAMPLES

HW = (32, 32)
CODES = blobs(5, (30, 34, 28))
WISHES = {
    "texture3d": (ES3, {}),
    "skipping": (ES3, {"skip": ("distance", 4)}),
    "preintegrated": (ES3, {"classification": "preintegrated", "entries": 64}),
    "mosaic": (ES2, {"packing": Packing(4)}),
    "mosaic-skipping": (ES2, {"skip": ("distance", 4)}),
}


def drawn(folder, technique, profile=ES3, **wishes):
    package = tiny_package(folder, CODES, SHELLS, profile, technique=technique, **wishes)
    grid = package.manifest.grid
    with Renderer(package, target="rgba32f") as renderer:
        camera = view_of(grid, "anterior-left")
        if technique != "slabs":
            return [renderer.render(camera, HW, 0.19)]
        shown = [(finished, renderer.drawn(HW)) for finished in renderer.draw_slabs(camera, HW, 0.19)]
    assert [finished for finished, _ in shown[:-1]] == sorted({finished for finished, _ in shown} - {1.0})
    assert shown[-1][0] == 1.0
    return [picture for _, picture in shown]


@pytest.mark.parametrize(("profile", "wishes"), WISHES.values(), ids=WISHES.keys())
def test_slabs_sum_to_the_picture_of_one_draw(tmp_path, profile, wishes):
    (whole,) = drawn(tmp_path / "whole", "ray-casting", profile, **wishes)
    slabs = drawn(tmp_path / "slabs", "slabs", profile, **wishes)
    assert len(slabs) == -(-np.ceil(np.linalg.norm([30, 34, 28]) / 0.19) // SLAB_SAMPLES)
    assert np.abs(slabs[-1] - whole).max() < 1e-6 * len(slabs)
    assert whole[..., 3].max() > 0.9


def test_opacity_only_grows_from_slab_to_slab(tmp_path):
    slabs = drawn(tmp_path / "slabs", "slabs")
    assert len(slabs) > 5
    for earlier, later in pairwise(slabs):
        assert (later - earlier).min() > -1e-6
    assert (slabs[len(slabs) // 2][..., 3] < slabs[-1][..., 3] - 0.1).any()


def test_a_stopped_slab_misses_no_more_than_the_cutoff_leaves(tmp_path):
    (whole,) = drawn(tmp_path / "whole", "ray-casting")
    cut = drawn(tmp_path / "slabs", "slabs", cutoff=0.99)[-1]
    assert 0.0 < np.abs(cut - whole).max() <= 0.01


def test_a_slab_of_opengl_es_2_is_a_short_loop_whatever_the_step(tmp_path):
    package = tiny_package(tmp_path / "p", CODES, SHELLS, ES2, technique="slabs")
    (program,) = package.manifest.level_programs
    assert f"k < {float(SLAB_SAMPLES)}" in package.read_text(program.fragment)
    assert program.slab_samples == SLAB_SAMPLES
    assert program.step_mm_min < 1e-4
