"""A page draws the scenes of sample_specs, of real scans, as the reference renderer does."""

from pathlib import Path

import pytest
from command_line import volprep
from web_pictures import TWO_STEPS, box_from_clip_of, drawn_by_reference, drawn_in_page, rmse

from volprep_formats.package.reader import Package

SAMPLES = Path(__file__).parents[2] / "sample_specs"
ENGINE, HEAD, SHELL = "engine_pair/data/*.raw.gz", "mr_t1_studyforrest/dicoms", "qim_microct/shell_*.tif"
SCANS = {
    "engine-raw": ENGINE,
    "engine-lit": ENGINE,
    "head-surface": HEAD,
    "mr-head": HEAD,
    "shell-editable": SHELL,
    "shell-microct": SHELL,
    "shell-proxy": SHELL,
}


@pytest.fixture(params=[f"{sample} for {profile}" for sample in SCANS for profile in ("gles3", "gles2-2048")])
def sample(request, scans, tmp_path) -> Package:
    """Package of a sample scene and a class of devices."""
    name, profile = request.param.split(" for ")
    (source,) = scans.glob(SCANS[name])
    target = tmp_path / "sample.volpkg"
    run = volprep("build", SAMPLES / f"{name}.toml", "--source", source, "--profile", profile, "-o", target)
    assert run.returncode == 0, run.stderr
    return Package.open(target)


@pytest.mark.long
def test_a_page_draws_a_sample_as_the_reference_renderer_does(browser, server, sample) -> None:
    matrices = box_from_clip_of(sample)
    kind = "webgl2" if sample.manifest.profile.api == "es3.0" else "webgl"
    found = drawn_in_page(browser, server, sample.path, matrices, kind=kind)
    assert found.said["error"] == 0
    wanted = drawn_by_reference(sample, matrices, level=found.said["level"], transfer=found.said["program"])
    assert all(picture[..., 3].max() > 0.1 for picture in wanted)
    for picture, reference in zip(found.pictures, wanted, strict=True):
        assert rmse(picture, reference) < TWO_STEPS
