"""Several channels without a scene: `volprep build cells.ome.tif`."""

from pathlib import Path

import numpy as np
import pytest
import tifffile
from judged import validate
from scene_builds import view_of

from volprep.pipeline.build import build, plan_build
from volprep.render.renderer import Renderer
from volprep.scene.request import request_for_source
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

CENTRES_X = (7.0, 20.0, 33.0, 46.0)


def write_stains(path: Path, count: int) -> Path:
    """A ball in each channel, one beside the other, in the noise of a camera."""
    z, y, x = np.indices((16, 18, 54), float)
    noise = np.random.default_rng(2).poisson(100, (count, *z.shape))
    distances = [np.hypot(np.hypot(z - 8, y - 9), x - at) for at in (*CENTRES_X, *CENTRES_X)[:count]]
    balls = np.clip(6.0 - np.array(distances), 0, 1) * 2000
    told = {"axes": "CZYX", "PhysicalSizeX": 0.2, "PhysicalSizeY": 0.2, "PhysicalSizeZ": 0.2}
    told["Channel"] = {"Name": [f"Stain {number}" for number in range(1, count + 1)]}
    values = (balls + noise).astype(np.uint16)
    tifffile.imwrite(path, values, ome=True, photometric="minisblack", metadata=told)
    return path


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp("stains")
    build(request_for_source(write_stains(folder / "cells.ome.tif", 4)), folder / "cells.volpkg", Silent())
    return Package.open(folder / "cells.volpkg")


def test_each_channel_has_a_colour_and_a_note_names_it(package) -> None:
    media = package.manifest.pictures[0].media
    assert [medium.transfer for medium in media] == [f"stain-{number}" for number in range(1, 5)]
    (said,) = [item.reason for item in package.manifest.plan if item.name == "first look"]
    assert said.startswith("recognised as channels, stain-1 in cyan, stain-2 in yellow, ")


def test_each_channel_is_seen_in_its_colour_where_it_is(package) -> None:
    box = package.manifest.box
    matrix = view_of(box, "anterior")
    with Renderer(package, target="rgba32f") as renderer:
        picture = renderer.render(matrix, (96, 96))
    matter = picture[..., 3] > 0.1
    columns = np.flatnonzero(matter.any(axis=0))
    parts = np.split(columns, np.flatnonzero(np.diff(columns) > 1) + 1)
    assert len(parts) == 4
    colours = [picture[:, part][matter[:, part]][:, :3].mean(axis=0) for part in parts]
    wanted = np.array([[0.0, 0.63, 1.0], [1.0, 0.63, 0.0], [1.0, 0.01, 0.53], [0.12, 0.22, 1.0]])
    shares = np.array([colour / colour.max() for colour in colours])
    assert min(np.abs(np.array(order) - wanted).max() for order in (shares, shares[::-1])) < 0.1


@pytest.mark.long
def test_the_default_picture_is_within_the_default_tolerance(package, tmp_path) -> None:
    assert validate(package, tmp_path / "report", picture_size=96).verdict.passed


@pytest.mark.parametrize(("count", "profile"), [(5, "gles3"), (2, "gles1")])
def test_more_channels_than_colours_or_a_device_without_shaders_need_a_choice(count, profile, tmp_path) -> None:
    with pytest.raises(VolprepError) as error:
        plan_build(request_for_source(write_stains(tmp_path / "cells.ome.tif", count), profile), Silent())
    assert (error.value.code, error.value.fields["count"]) == ("VP1221", count)
