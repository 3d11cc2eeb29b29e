"""What a manifest must say of transfer functions so that its programs can be composed, and of lights."""

import numpy as np
import pytest
from tiny_packages import function, tiny_package

from volprep_formats.package.compositing_rules import compositing_contradictions
from volprep_formats.package.parts.normals.rules import normals_contradictions
from volprep_formats.package.program import Light

WHITE = (1.0, 1.0, 1.0)


@pytest.fixture
def manifest(tmp_path):
    shown = function((0.0, WHITE, 0.0), (255.0, WHITE, 1.0))
    return tiny_package(tmp_path / "p", np.zeros((3, 4, 5), np.uint8), shown).manifest


def with_changes(manifest, program, function_):
    (channel,) = manifest.channels
    changed = tuple(each.model_copy(update=function_) for each in channel.transfer_functions)
    channels = (channel.model_copy(update={"transfer_functions": changed}),)
    programs = tuple(each.model_copy(update=program) for each in manifest.programs)
    return manifest.model_copy(update={"channels": channels, "programs": programs})


@pytest.mark.parametrize("compositing", ["isosurface", "first-hit"])
def test_a_surface_needs_an_isovalue(manifest, compositing) -> None:
    program = {"compositing": compositing}
    (problem,) = compositing_contradictions(with_changes(manifest, program, {}))
    assert "no isovalue" in problem
    assert not [*compositing_contradictions(with_changes(manifest, program, {"isovalue": 3.0}))]


def test_intensities_ascend(manifest) -> None:
    program = {"compositing": "mida"}
    (problem,) = compositing_contradictions(with_changes(manifest, program, {"intensities": (5.0, 5.0)}))
    assert "from 5 to 5" in problem
    assert not [*compositing_contradictions(with_changes(manifest, program, {}))]


def test_a_light_with_a_place_is_there_if_and_only_if_it_lights(manifest) -> None:
    light = Light(place_mm_xyz=(0.0, 0.0, 0.0))
    dark = with_changes(manifest, {"light": light}, {})
    unlit = with_changes(manifest, {"lighting": "phong", "normals_from": "central"}, {})
    for wrong in (dark, unlit):
        assert any("light" in problem for problem in normals_contradictions(wrong))
    placed = {"lighting": "phong", "normals_from": "central", "light": light}
    assert not [*normals_contradictions(with_changes(manifest, placed, {}))]
