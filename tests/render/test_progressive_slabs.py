"""Slabs over the low resolution of what is behind them: no frame is worse than the one before it."""

from itertools import pairwise

import numpy as np
import pytest
from scene_builds import built, view_of

from tests.papers.progress import dssim
from volprep.render.progressive import coarse_level, frames, low_resolution
from volprep.render.renderer import Renderer

HW = (120, 120)
ENGINE = 'raw = { shape_zyx = [128, 256, 256], dtype = "uint8" }'
SCANS = {
    "mr": ('path = "{data}/mr_t1_studyforrest"', "mr-head"),
    "flair": ('path = "{data}/flair_pair/FLAIR.nii.gz"', "mr-head"),
    "ch2": ('path = "{data}/nifti_ch2/ch2.nii.gz"', "mr-head"),
    "engine": ('path = "{data}/engine_pair/data/engine_256x256x128_uint8.raw.gz"\n{raw}', "micro-ct"),
}


@pytest.fixture(scope="module", params=SCANS)
def package(request, scans, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    source, preset = SCANS[request.param]
    (folder / "scan.toml").write_text(
        f'name = "scan"\n[render]\ntechnique = "slabs"\n[pyramid]\nfilter = "box"\n'
        f'[source]\n{source.format(data=scans, raw=ENGINE)}\n[[transfer]]\nname = "a"\npreset = "{preset}"\n'
    )
    return built(folder / "scan.toml", folder / "scan.volpkg")


@pytest.mark.long
def test_no_frame_is_worse_than_the_one_before_it(package):
    level = coarse_level(package)
    assert level == 2
    grid = package.manifest.grid
    with Renderer(package) as fine, Renderer(package, level=level) as coarse:
        step_mm = package.manifest.step_mm
        for view in ("anterior-left", "superior"):
            matrix = view_of(grid, view)
            shown = [*frames(fine, "slabs", matrix, HW, step_mm, budget_s=0.0, coarse=coarse)]
            assert np.array_equal(shown[0].picture, low_resolution(coarse, matrix, HW, step_mm))
            assert np.array_equal(shown[-1].picture, fine.render(matrix, HW, step_mm))
            values = [dssim(frame.picture, shown[-1].picture) for frame in shown]
            assert values[0] > 0.05
            # Nothing that 8 bits can show: half a step over a hundredth of the pixels is a DSSIM of 1e-5.
            assert all(after <= before + 1e-5 for before, after in pairwise(values)), values
