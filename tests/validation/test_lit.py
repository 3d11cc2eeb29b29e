"""Packages that are lit: proved against the oracle with light, whose normals are those of the scan."""

from pathlib import Path

import numpy as np
import pytest
import scene_builds
from blobs import blobs
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import view_of
from tiny_packages import ES3, function, tiny_package

from volprep.render.renderer import Renderer
from volprep.scene.scene import NormalSettings
from volprep.truth.normal_codes import decoded, interpolated
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep.validation.subjects.scan import find_scan, read_scan
from volprep.validation.subjects.subject import DRAFT_TOLERANCE, Subject, errors
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

SIZE = 40


def built(folder: Path, code: str = "biased8", profile: str = "gles3") -> Package:
    """The phantom with one transfer function, lit; its window cuts off no value."""
    scene = write_phantom_scene(folder, profile, "box")
    text, _, _ = scene.read_text().rpartition("[[transfer]]")
    more = f'[render]\nlighting = "headlight"\n[normals]\ncode = "{code}"\n[quantize]\nwindow = [0, 1500]\n'
    scene.write_text(text + more)
    return scene_builds.built(scene, folder / "phantom.volpkg")


def subject_of(package: Package) -> Subject:
    spec = find_scan(package.path, None).spec_of("")
    return Subject(package, read_scan(package.manifest, spec, Silent()), SIZE)


@pytest.mark.long
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_a_lit_package_is_proved_like_any_other(profile, tmp_path) -> None:
    package = built(tmp_path, profile=profile)
    report = validate(package.path, tmp_path / "report", picture_size=SIZE)
    assert report.verdict.passed
    (program,) = report.programs
    for view in program.views:
        assert view.truth_bound <= DRAFT_TOLERANCE
        assert 0 < view.data.rmse < 0.005
        assert (tmp_path / "report" / view.pictures.difference).exists()
    assert [point for point in program.sweep.points if point.level > 0]
    # What is drawn without early ray termination is lit, too.
    assert program.sweep.breakdown.termination is not None
    assert program.sweep.breakdown.quadrature.rmse < 0.02


@pytest.mark.parametrize("code", ["biased8", "snorm8"])
def test_the_error_of_steps_falls_with_order_2_where_they_are_lit(code, tmp_path) -> None:
    codes = blobs(3, (24, 20, 28))
    glow = function((0.0, (0.9, 0.6, 0.2), 0.0), (255.0, (0.2, 0.7, 1.0), 0.6))
    settings = NormalSettings(code=code)
    package = tiny_package(tmp_path / "p", codes, glow, ES3, normals=settings, lighting="headlight")
    grid = package.manifest.levels[0].grid
    normals = interpolated(level_texels(package, 0, "normals"), code)
    camera = view_of(grid, "anterior-left")
    truth = oracle_picture(Volume(codes, grid, normals=normals), glow, camera, (SIZE, SIZE)).rgba
    with Renderer(package, target="rgba32f") as renderer:
        pictures = [renderer.render(camera, (SIZE, SIZE), step_mm) for step_mm in (0.5, 0.25, 0.125)]
    found = [errors(picture, truth).rmse for picture in pictures]
    slopes = np.log2(np.divide(found[:-1], found[1:]))
    assert truth.max() > 0.3
    assert (np.abs(slopes - 2) < 0.25).all(), (found, slopes)


def test_codes_of_normals_are_an_error_of_the_data(tmp_path) -> None:
    error = {}
    for code in ("biased8", "oct12"):
        (tmp_path / code).mkdir()
        subject = subject_of(built(tmp_path / code, code))
        truth = subject.truth("shell", "anterior-left").rgba
        error[code] = errors(subject.on_data("shell", "anterior-left", 0).rgba, truth).rmse
    assert 0 < error["oct12"] < error["biased8"] < 0.005
    scan = subject.scan
    unlit = subject.on_volume(type(scan)(scan.stored, scan.grid, scan.slope, scan.intercept), "shell", "anterior-left")
    assert (truth[..., :3] <= unlit.rgba[..., :3] + 2e-6).all()
    assert np.abs(truth - unlit.rgba).max() > 0.2


@pytest.mark.parametrize("code", ["biased8", "snorm8", "oct8", "oct12"])
def test_vectors_between_which_a_filter_mixes_point_where_codes_do(code) -> None:
    octets = np.random.default_rng(1).integers(0, 256, (500, 3), dtype=np.uint8)
    octets[0] = 128 if code == "biased8" else 0
    vectors = interpolated(octets, code).astype(np.float64)
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    assert length[0] == 0
    np.testing.assert_allclose(vectors[1:] / length[1:], decoded(octets, code)[1:], atol=1e-6)
