"""Hybrid resolution: a scene asks for it, the package ships what it needs and nothing else, and is drawn with that."""

from unittest.mock import patch

import numpy as np
import pytest
from ball_scan import write_ball_scene

from volprep.pipeline.build import build, plan_build
from volprep.pipeline.shot import Shot, draw
from volprep.render.hybrid import HybridWish
from volprep.scene.request import load_request
from volprep.techniques import TECHNIQUES
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

HYBRID = "[hybrid]\nlongest_side = 20\n"
SHAPE_HW = (60, 80)
PROFILES = [
    (name, profile)
    for name, technique in TECHNIQUES.items()
    for profile, sampling in (("gles3", "texture3d"), ("gles2-2048", "mosaic"))
    if sampling in technique.samplings
]


def scene_in(folder, technique="ray-casting", profile="gles3", tables=HYBRID):
    return load_request(write_ball_scene(folder, f'technique = "{technique}"', profile, tables))


def package_in(folder, *wishes, **more):
    target = folder / "ball.volpkg"
    build(scene_in(folder, *wishes, **more), target, Silent())
    assert check(target) == []
    return target


def drawn(path, hybrid=None):
    shot = Shot("anterior-left", None, SHAPE_HW, "black", None, None, None, None, hybrid=hybrid)
    return draw(path, shot)[0]


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(("technique", "profile"), PROFILES)
def test_a_package_of_any_technique_is_drawn_with_fewer_pixels_between_lines_with_all(tmp_path, technique, profile):
    path = package_in(tmp_path, technique, profile)
    picture = drawn(path)
    np.testing.assert_array_equal(picture, drawn(path, HybridWish((15, 20))))
    alone = drawn(path, HybridWish((15, 20), lines=False))
    lines = (picture != alone).any(axis=-1)
    assert 100 < lines.sum() < 600
    assert 0.001 < np.abs(alone - drawn(path, HybridWish(lines=False))).mean() < 0.05


def test_the_package_ships_the_shaders_that_draw_it(tmp_path):
    path = package_in(tmp_path)
    hybrid = Package.open(path).manifest.render.hybrid
    for shader in hybrid.shaders:
        text = (path / shader).read_text()
        assert text.startswith("#version 300 es")
        with patch.object(Package, "read_text", lambda self, name, bad=shader: _broken(self, name, bad)):
            with pytest.raises(VolprepError, match="VP5005") as error:
                drawn(path)
            assert shader in str(error.value)


def _broken(package, name, bad):
    text = package.read_bytes(name).decode()
    return text.replace("main", "no such") if name == bad else text


def test_what_is_not_drawn_is_not_shipped(tmp_path):
    hybrid = Package.open(package_in(tmp_path, tables=f"{HYBRID}[lab.hybrid]\nlines = false\n")).manifest.render.hybrid
    assert hybrid.shaders == ("shaders/enlarged.vert", "shaders/enlarged.frag")
    assert not (drawn(tmp_path / "ball.volpkg") != drawn(tmp_path / "ball.volpkg", HybridWish((15, 20), False))).any()
    (tmp_path / "without").mkdir()
    path = package_in(tmp_path / "without", tables="")
    assert Package.open(path).manifest.render.hybrid is None
    assert not list(path.rglob("*enlarged*"))


@pytest.mark.parametrize("opacity", ["alpha", "black-and-white", "white-volume", "luminance-average"])
def test_without_shaders_the_package_says_where_opacity_comes_from(tmp_path, opacity):
    path = package_in(tmp_path, "ray-casting", "gles1", f'{HYBRID}[lab.hybrid]\nopacity = "{opacity}"\n')
    hybrid = Package.open(path).manifest.render.hybrid
    assert (hybrid.opacity, hybrid.shaders) == (opacity, ())
    picture = drawn(path)
    np.testing.assert_array_equal(picture, drawn(path, HybridWish((15, 20), opacity=opacity)))
    assert picture[..., :3].max() > 0.9


def test_an_estimate_of_opacity_is_refused_where_pictures_have_alpha(tmp_path):
    with pytest.raises(VolprepError, match="VP3166"):
        plan_build(scene_in(tmp_path, tables=f'{HYBRID}[lab.hybrid]\nopacity = "white-volume"\n'), Silent())


@pytest.mark.parametrize("side", [0, 8193])
def test_a_small_picture_of_an_impossible_size_is_refused(tmp_path, side):
    with pytest.raises(VolprepError, match=r"VP3003(?s:.*)longest_side"):
        scene_in(tmp_path, tables=f"[hybrid]\nlongest_side = {side}\n")


def test_a_picture_that_has_no_more_pixels_is_drawn_with_its_own(tmp_path):
    path = package_in(tmp_path, tables="[hybrid]\nlongest_side = 80\n[lab.hybrid]\nlines = false\n")
    np.testing.assert_array_equal(drawn(path), drawn(path, HybridWish(SHAPE_HW, lines=False)))
