"""A killed build goes on inside the light: samples that were computed are not computed again."""

from unittest.mock import patch

import numpy as np
import pytest
from light_scene import scene_of
from tiny_packages import function

from volprep.kernels import _native
from volprep.parts.light import decision, solve
from volprep.parts.light.kept import KeptSamples
from volprep.pipeline.build import build
from volprep.scene.request import load_request
from volprep.truth.path_traced import LitVolume
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.progress import Silent

GREY = (0.6, 0.6, 0.6)


class Killed(BaseException):
    """The process ends."""


class Kernel:
    """The kernel of samples, which counts its calls, and ends the process at one of them."""

    def __init__(self, until=None) -> None:
        self.calls, self._until, self._real = 0, until, _native.light_samples

    def __call__(self, **arguments) -> None:
        if self.calls == self._until:
            raise Killed
        self.calls += 1
        self._real(**arguments)


@pytest.fixture
def lit(monkeypatch):
    monkeypatch.setattr(solve, "BATCH", 1 << 10)
    volume = np.full((6, 7, 8), 200, np.uint8)
    grid = Grid.of(volume.shape, (1.0, 1.0, 1.0))
    return LitVolume(volume, grid, 1.0, 0.0, function((100.0, GREY, 0.3)), LightModel(kind="scattering"))


def solved(lit, folder, kernel):
    with patch.object(_native, "light_samples", kernel):
        return solve.solve_field(lit, 2, 4 << 10, Silent(), KeptSamples(folder, lit.volume))


def test_a_field_goes_on_where_it_was_killed(lit, tmp_path) -> None:
    whole = Kernel()
    expected = solved(lit, tmp_path / "whole", whole)
    assert whole.calls == 6
    with pytest.raises(Killed):
        solved(lit, tmp_path / "killed", Kernel(until=4))
    rest = Kernel()
    field = solved(lit, tmp_path / "killed", rest)
    assert rest.calls == 2
    assert field.texels.tobytes() == expected.texels.tobytes()


@pytest.mark.parametrize("damaged", [b"", b"PK", None], ids=["empty", "short", "one byte"])
def test_damaged_samples_are_computed_again(lit, tmp_path, damaged) -> None:
    expected = solved(lit, tmp_path, Kernel())
    path = next(tmp_path.iterdir())
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data) if damaged is None else damaged)
    again = Kernel()
    assert solved(lit, tmp_path, again).texels.tobytes() == expected.texels.tobytes()
    assert again.calls == 1


def test_samples_of_another_volume_do_not_count(lit, tmp_path) -> None:
    solved(lit, tmp_path, Kernel())
    lit.volume[3, 3, 3] = 0
    again = Kernel()
    solved(lit, tmp_path, again)
    assert again.calls == 6


@pytest.mark.long
def test_a_killed_build_goes_on_inside_the_light(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(solve, "BATCH", 1 << 14)
    monkeypatch.setattr(decision, "_LEAST_SAMPLES", 1 << 16)
    request, target = load_request(scene_of(tmp_path)), tmp_path / "ball.volpkg"
    # The trial of the plan takes three batches, and the light one, one and four.
    with patch.object(_native, "light_samples", Kernel(until=3 + 4)), pytest.raises(Killed):
        build(request, target, Silent())
    rest = Kernel()
    with patch.object(_native, "light_samples", rest):
        build(request, target, Silent())
    assert rest.calls == 3 + 2
    assert not list(target.rglob("*.npz"))
    assert not (target / ".kept").exists()
