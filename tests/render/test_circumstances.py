"""Every technique where something goes wrong: a shader that does not compile, a driver that is lost, many pictures."""

import numpy as np
import pytest
from scene_builds import view_of
from tiny_packages import ES3, function, tiny_package

from volprep.render.progressive import frames
from volprep.render.renderer import Renderer
from volprep.techniques import TECHNIQUES
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package

CODES = np.random.default_rng(2).integers(0, 256, (6, 7, 8)).astype(np.uint8)
GREY = function((0.0, (0.0, 0.0, 0.0), 0.0), (255.0, (1.0, 1.0, 1.0), 0.5))
HW = (9, 9)


class Broken(Package):
    """A package of which one shader does not compile."""

    def __init__(self, package, path):
        super().__init__(package.path, package.manifest)
        self._broken = path

    def read_bytes(self, path):
        data = super().read_bytes(path)
        return data.replace(b"void main() {", b"void main() {\n  no_such_function();") if path == self._broken else data


@pytest.fixture(params=TECHNIQUES)
def package(request, tmp_path):
    return tiny_package(tmp_path / "p", CODES, GREY, ES3, technique=request.param)


def camera(package):
    grid = package.manifest.levels[0].grid
    return view_of(grid, "anterior-left")


def sorts(program, path):
    return program.tiles is not None and path in {program.tiles.cost, program.tiles.offsets, program.tiles.place}


def test_a_shader_with_an_error_is_named_with_its_log(package):
    program = package.manifest.level_programs[0]
    drawn = [path for path in program.shaders if not sorts(program, path)]
    assert len(drawn) >= 2
    for path in drawn:
        with (
            pytest.raises(VolprepError, match=r"VP5005(?s:.*)no_such_function") as error,
            Renderer(Broken(package, path)),
        ):
            pass
        assert path in str(error.value)


def test_a_driver_that_is_lost_is_an_error_and_no_black_picture(package, monkeypatch):
    with Renderer(package) as renderer:
        assert renderer.render(camera(package), HW).any()
        with monkeypatch.context() as patched:
            patched.setattr(type(renderer._gl._context), "is_lost", True)
            with pytest.raises(VolprepError, match="VP5042"):
                renderer.render(camera(package), HW)
            with pytest.raises(VolprepError, match="VP5042"):
                renderer.finish()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("order", ["slabs", "tiles", "random", "structured"])
def test_200_pictures_that_come_in_frames_leave_nothing_behind(tmp_path, order):
    technique = order if order in TECHNIQUES else "ray-casting"
    package = tiny_package(tmp_path / "p", CODES, GREY, ES3, technique=technique)
    with Renderer(package) as renderer, Renderer(package) as coarse:
        [*frames(renderer, order, camera(package), HW, 0.5, budget_s=0.0, coarse=coarse)]
        first = +renderer._gl.live
        for number in range(200):
            [*frames(renderer, order, camera(package), (8 + number % 3, 9), 0.5, budget_s=0.01, coarse=coarse)]
        assert +renderer._gl.live == first
