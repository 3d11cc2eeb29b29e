import pytest
from pydantic import ValidationError

from volprep.scene.points import ScenePoint
from volprep.scene.transfer import SceneTransfer
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint


def points(*values: float) -> tuple[TransferPoint, ...]:
    return tuple(TransferPoint(value=value, colour=(1.0, 1.0, 1.0), extinction_per_mm=0.1) for value in values)


def test_two_points_at_one_value_make_a_jump() -> None:
    assert len(TransferFunction(name="jump", points=points(0.0, 5.0, 5.0, 9.0)).points) == 4


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((), "at least 1 item"),
        ((2.0, 1.0), "points.1: points must ascend: 2.0 stands before 1.0"),
        ((5.0, 5.0, 5.0), "points.2: at most two points may share a value: 5.0 has more"),
        ((float("nan"),), "finite"),
    ],
)
def test_points_that_define_no_function_are_refused(values, text) -> None:
    with pytest.raises(ValidationError, match=text):
        TransferFunction(name="wrong", points=points(*values))


@pytest.mark.parametrize("extinction", [-0.1, float("inf"), float("nan")])
def test_extinction_is_finite_and_not_negative(extinction) -> None:
    with pytest.raises(ValidationError):
        TransferPoint(value=0.0, colour=(1.0, 1.0, 1.0), extinction_per_mm=extinction)


@pytest.mark.parametrize(
    ("colour", "space", "linear"),
    [
        ("#ffffff", "srgb", (1.0, 1.0, 1.0)),
        ("#000000", "linear", (0.0, 0.0, 0.0)),
        ("#bc00bc", "linear", (0.502886, 0.0, 0.502886)),  # "#rrggbb" is sRGB whatever the space
        ((0.5, 0.2, 0.04), "srgb", (0.214041, 0.0331048, 0.0030960)),
        ((0.5, 0.25, 0.0), "linear", (0.5, 0.25, 0.0)),
    ],
)
def test_colours_of_a_scene_become_linear_light(colour, space, linear) -> None:
    point = ScenePoint(value=0.0, colour=colour, extinction_per_mm=0.1)
    resolved = SceneTransfer(name="one", colour_space=space, points=(point,)).resolved()
    assert resolved.points[0].colour == pytest.approx(linear, abs=1e-6)
