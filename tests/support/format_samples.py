"""The sample packages of formats/samples, with the pictures that readers must draw."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO

from volprep_formats.package.reader import Package
from volprep_formats.srgb import linear_of_srgb

FOLDER = Path(__file__).parents[2] / "formats" / "samples"
SIDE = 48
"""Width and height of the pictures."""
LARGEST = 0.01
"""Largest difference of a component in linear light: targets and pictures of 8 bits round by half of that."""


@dataclass(frozen=True)
class Sample:
    """A picture of a package."""

    package: Path
    picture: Path
    clip_from_world: np.ndarray
    point: int | None
    frame: int

    @property
    def box_from_clip(self) -> np.ndarray:
        manifest = Package.open(self.package).manifest
        grid = manifest.pictures[0].grid or manifest.grid
        assert grid is not None
        return np.linalg.inv(self.clip_from_world @ grid.world_from_box)

    def pixels(self) -> np.ndarray:
        """Pixels [row, column, RGB] of the picture."""
        return read_pixels(self.picture)


def read_pixels(path: Path) -> np.ndarray:
    """Pixels [row, column, RGB] of a PNG file."""
    picture = OpenImageIO.ImageInput.open(str(path))
    pixels = np.asarray(picture.read_image("uint8"), int)[..., :3]
    picture.close()
    return pixels


SAMPLES = {
    entry["picture"].removesuffix(".png"): Sample(
        FOLDER / entry["package"],
        FOLDER / entry["picture"],
        np.array(entry["clip_from_world"]),
        entry.get("point"),
        entry.get("frame", 0),
    )
    for entry in json.loads((FOLDER / "samples.json").read_text(encoding="utf-8"))
}
"""Each picture by its name."""


def differing(found: np.ndarray, sample: Sample) -> float:
    """Return the largest difference in linear light of sRGB bytes from the picture of a sample, which is not black."""
    wanted = sample.pixels()
    assert wanted.max() > 60
    linear = np.array([linear_of_srgb(byte / 255) for byte in range(256)])
    return float(np.abs(linear[found[..., :3].astype(int)] - linear[wanted]).max())
