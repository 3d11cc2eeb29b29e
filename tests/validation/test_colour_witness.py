"""Product and witness read the same channels from pictures in colour, each with code of its own."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
from colour_scene import ball, write_colour_scene, write_pictures
from PIL import Image

from volprep.scene.scene import load_scene
from volprep.validation.witness.independent.colours import channel_of
from volprep.validation.witness.independent.scan import CannotWitnessError
from volprep.validation.witness.independent.scene import read_scene
from volprep.validation.witness.independent.sources import read_scan
from volprep_formats.readers.colour import channel_of_colours
from volprep_formats.source import ColourChannel

PIXELS = np.random.default_rng(2).integers(0, 256, (3, 4, 5, 4)).astype(np.uint8)
SHARES = ((0.0, 0.0), (0.25, 0.9), (1.0, 1.0))
KINDS: dict[str, dict[str, Any]] = {
    **{kind: {"opacity_of": kind} for kind in ("alpha", "luminance", "green")},
    "background": {"opacity_of": "background", "background": (0.2, 0.4, 0.9)},
}


@pytest.mark.parametrize("part", ["red", "green", "blue", "opacity"])
@pytest.mark.parametrize("kind", KINDS)
def test_product_and_witness_make_the_same_channel_of_pixels(kind: str, part: str) -> None:
    wanted = ColourChannel(part=part, shares=SHARES, **KINDS[kind])

    made = channel_of_colours(Path(), wanted, PIXELS[..., :3], PIXELS[..., 3])

    witnessed = channel_of(PIXELS, wanted.model_dump(mode="json"))
    assert np.abs(made / 65535 - witnessed).max() < 0.51 / 65535


def of_tiff(folder: Path) -> dict[str, Any]:
    write_pictures(folder / "pages.tif", PIXELS)
    return {"path": folder / "pages.tif", "stack": {"spacing_mm_zyx": [3.0, 2.0, 1.0]}}


def of_png(folder: Path) -> dict[str, Any]:
    (folder / "slices").mkdir()
    for z, place in enumerate((2, 9, 10)):
        Image.fromarray(PIXELS[z]).save(folder / "slices" / f"slice{place}.png")
    return {"path": folder / "slices", "stack": {"spacing_mm_zyx": [3.0, 2.0, 1.0]}}


def of_nifti(folder: Path) -> dict[str, Any]:
    texels = np.ascontiguousarray(PIXELS.transpose(2, 1, 0, 3)).view([(name, np.uint8) for name in "RGBA"])[..., 0]
    nibabel.save(nibabel.Nifti1Image(texels, np.diag([-1.0, -2.0, 3.0, 1.0])), folder / "colour.nii")
    return {"path": folder / "colour.nii"}


@pytest.mark.parametrize("write", [of_tiff, of_png, of_nifti])
def test_pictures_in_colour_are_read(write: Callable[[Path], dict[str, Any]], tmp_path: Path) -> None:
    wanted = {"part": "red", "opacity_of": "alpha", "shares": SHARES}

    found = read_scan({**write(tmp_path), "colour": wanted})

    assert np.array_equal(found.stored, channel_of(PIXELS, wanted))
    assert np.diag(found.world_from_index).tolist() == [1.0, 2.0, 3.0, 1.0]


def test_colours_that_alpha_has_multiplied_are_not_witnessed(tmp_path: Path) -> None:
    write_pictures(tmp_path / "pages.tif", PIXELS, "assocalpha")

    with pytest.raises(CannotWitnessError, match="multiplied"):
        read_scan({"path": tmp_path / "pages.tif", "stack": {}, "colour": {"part": "red"}})


def test_a_scene_in_colour_has_the_channels_and_functions_of_the_product(tmp_path: Path) -> None:
    path = write_colour_scene(tmp_path)
    scene, witnessed = load_scene(path), read_scene(tmp_path, path, tmp_path)

    for channel, function in zip(scene.source.channels, witnessed.functions, strict=True):
        assert channel.colour is not None
        own = {key: value for key, value in channel.colour.model_dump(mode="json").items() if key != "dtype"}
        assert witnessed.sources[channel.name]["colour"] == own | {"shares": [tuple(each) for each in own["shares"]]}
        made = scene.transfer[witnessed.functions.index(function)].resolved()
        assert [point.colour for point in made.points] == [tuple(colour) for colour in function.colours.tolist()]
        assert [point.extinction_per_mm for point in made.points] == function.extinctions_per_mm.tolist()
    assert ball().shape[:3] == read_scan(witnessed.sources["red"]).stored.shape
