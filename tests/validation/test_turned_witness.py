"""A second reading of light that an app turns: product and witness have the same light from every direction."""

from types import SimpleNamespace

import numpy as np
import pytest

from volprep.validation.witness.light_checks import check_turned_light, light_of_uniform, stated_light
from volprep_formats.package.parts.light.environment import environment_of, environment_uniform, turned
from volprep_formats.package.parts.light.model import LightModel, Sun

LIGHTING = {
    "sky": [0.4, 0.6, 1.2],
    "ground": [1.0, 0.5, 0.2],
    "suns": [{"direction": [3.0, 0.0, 4.0], "colour": [0.5, 0.2, 0.1]}],
}
MODEL = LightModel.model_construct(
    sky=(0.4, 0.6, 1.2),
    ground=(1.0, 0.5, 0.2),
    suns=(Sun.model_construct(direction=(3.0, 0.0, 4.0), colour=(0.5, 0.2, 0.1)),),
    turnable=True,
)


def found(model: LightModel) -> float:
    light = SimpleNamespace(model=model)
    manifest = SimpleNamespace(textures=[SimpleNamespace(light=light, transfer="a"), SimpleNamespace(light=None)])
    (check,) = check_turned_light(
        SimpleNamespace(package=SimpleNamespace(manifest=manifest)), SimpleNamespace(light=LIGHTING)
    )
    return check.found / check.limit


def test_light_around_is_what_the_scene_states() -> None:
    assert found(MODEL) < 1.0
    directions = np.random.default_rng(1).normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    held = light_of_uniform(environment_uniform(turned(environment_of(MODEL), turn)), directions)
    np.testing.assert_allclose(held, stated_light(LIGHTING, directions, turn), atol=1e-12)


@pytest.mark.parametrize(
    "lie", [{"sky": (0.4, 0.6, 1.1)}, {"ground": (0.4, 0.6, 1.2), "sky": (1.0, 0.5, 0.2)}, {"suns": ()}]
)
def test_other_light_is_contradicted(lie: dict[str, object]) -> None:
    assert found(MODEL.model_copy(update=lie)) > 1.0
