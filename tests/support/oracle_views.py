"""Views of small volumes for the laws of the oracles: every compositing, with all that its record says it can draw."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from tiny_packages import function

from volprep.compositing import COMPOSITINGS, Compositing
from volprep.truth.camera import Camera
from volprep.truth.lit import Lit, Normals, ShaderSlopes
from volprep.truth.oracle import OraclePicture
from volprep.truth.volume import Medium, Volume
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.program import Light
from volprep_formats.package.transfer_function import TransferFunction

SHAPE_ZYX = (7, 8, 9)
BORDER = 2
"""Voxels around the volume that show nothing. Two, so that gradients of the padded volume are the same."""
UNIT = 27
"""Stored values are multiples: thirds of them along three axes are whole numbers."""
MOST = 100 * UNIT
SLOPE, INTERCEPT = 0.25, -7.0
SHAPE_HW = (7, 9)

HILLS = function(
    (60.0, (0.1, 0.2, 0.9), 0.0),
    (200.0, (0.9, 0.4, 0.1), 0.5),
    (350.0, (0.2, 0.8, 0.3), 0.1),
    (420.0, (0.2, 0.8, 0.3), 0.1),
    (420.0, (0.9, 0.9, 0.2), 0.4),
    (600.0, (0.3, 0.1, 0.9), 0.0),
).model_copy(update={"reference_mm": 2.0, "isovalue": 300.0, "intensities": (100.0, 560.0)})
"""Nothing is shown at either end; there is a jump."""
RAMP = function((-20.0, (0.1, 0.2, 0.9), 0.02), (700.0, (0.9, 0.4, 0.1), 0.6)).model_copy(
    update={"reference_mm": 2.0, "isovalue": 300.0, "intensities": (100.0, 560.0)}
)
"""No control point lies between the least and the greatest value."""


@dataclass(frozen=True)
class View:
    """A picture to draw."""

    compositing: Compositing
    media: tuple[Medium, ...]
    camera: Camera

    @property
    def grid(self) -> Grid:
        return self.media[0].volume.grid

    @property
    def normals(self) -> Normals:
        return self.media[0].volume.normals

    @property
    def nearest(self) -> bool:
        return self.media[0].volume.nearest

    def draw(self) -> OraclePicture:
        matrix = self.camera.box_from_clip(self.grid, SHAPE_HW[1] / SHAPE_HW[0])
        return self.compositing.oracle(self.media, matrix, SHAPE_HW)

    def with_volumes(self, change: Callable[[Volume], Volume]) -> "View":
        return replace(self, media=tuple(replace(each, volume=change(each.volume)) for each in self.media))

    def with_voxels(self, change: Callable[[NDArray[np.generic]], NDArray[np.generic]], grid: Grid) -> "View":
        """The same view of other voxels; normals of voxels, which are an array, stay as they are."""
        return self.with_volumes(
            lambda each: replace(each, stored=np.ascontiguousarray(change(each.stored)), grid=grid)
        )

    def with_normals(self, normals: Normals) -> "View":
        return self.with_volumes(lambda each: replace(each, normals=normals))

    def with_functions(self, change: Callable[[TransferFunction], TransferFunction]) -> "View":
        media = tuple(replace(each, transfer_function=change(each.transfer_function)) for each in self.media)
        return replace(self, media=media)

    @property
    def vectors(self) -> NDArray[np.float32] | None:
        source = self.normals.normals if isinstance(self.normals, Lit) else self.normals
        return source if isinstance(source, np.ndarray) else None

    def with_vectors(self, vectors: NDArray[np.float32]) -> "View":
        vectors = np.ascontiguousarray(vectors)
        lit = self.normals
        return self.with_normals(replace(lit, normals=vectors) if isinstance(lit, Lit) else vectors)


def _grid() -> Grid:
    turned = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]) @ np.diag([1.0, 1.0, -1.0])
    return Grid.of(SHAPE_ZYX, (1.25, 1.0, 0.75), (4.0, -3.0, 9.0), turned)


GRID = _grid()
MIDDLE = (GRID.world_from_box @ [*np.array(GRID.extent_mm_zyx[::-1]) / 2, 1.0])[:3]


def _camera(forward: Sequence[float], projection: str) -> Camera:
    direction = np.array(forward) / np.linalg.norm(forward)
    eye = MIDDLE - 14.0 * direction
    return Camera(tuple(eye), tuple(direction), (0.1, 0.2, 1.0), 9.0, 14.0, projection)


CAMERAS = {
    "orthographic": _camera((0.7, 1.0, -0.55), "orthographic"),
    "perspective": _camera((-1.0, 0.25, 0.4), "perspective"),
}
LIGHT = Light(place_mm_xyz=tuple(MIDDLE + np.array([9.0, -6.0, 7.0])))


def volume(background: int, seed: int = 1) -> Volume:
    """Random stored values within a border of one value."""
    inner = np.random.default_rng(seed).integers(0, 101, [n - 2 * BORDER for n in SHAPE_ZYX]) * UNIT
    return Volume(np.pad(inner, BORDER, constant_values=background).astype(np.uint16), GRID, SLOPE, INTERCEPT)


def normals_of(seed: int = 2) -> NDArray[np.float32]:
    vectors = np.random.default_rng(seed).integers(-60, 61, (*SHAPE_ZYX, 3)) * UNIT / 2048
    return vectors.astype(np.float32)


def background(compositing: Compositing, shown: TransferFunction) -> int | None:
    """The stored value, 0 or the greatest, that can change no picture, as the record says; None if both can."""
    visible = compositing.visible_table(Table.exact(shown)).extinction_per_mm
    return 0 if visible[0] == 0.0 else MOST if visible[-1] == 0.0 else None


def views(shown: TransferFunction) -> Iterator[tuple[str, View]]:
    """Everything that the oracles of the registered compositings can draw of one small volume, each with a name."""
    # back-to-front has the oracle of emission-absorption.
    of_oracles = {each.oracle: each for each in reversed(COMPOSITINGS.values())}
    for compositing in of_oracles.values():
        name = compositing.name
        found = background(compositing, shown)
        around = MOST // 2 if found is None else found
        medium = Medium(volume(around), shown)
        plain = View(compositing, (medium,), CAMERAS["orthographic"])
        yield name, plain
        yield f"{name} in perspective", replace(plain, camera=CAMERAS["perspective"])
        if compositing.labels:
            yield f"{name} of labels", plain.with_volumes(lambda each: replace(each, nearest=True))
        if compositing.several:
            other = replace(medium, volume=volume(around, 3))
            yield f"{name} of two", replace(plain, media=(medium, other))
        if compositing.lit:
            for what, normals in _lights().items():
                yield f"{name} {what}", plain.with_normals(normals)


def _lights() -> dict[str, Normals]:
    shadows = LIGHT.model_copy(update={"shadows": "rays"})
    return {
        "lit from the viewer": normals_of(),
        "lit by gradients": "sobel",
        "lit from a place": Lit(normals_of(), LIGHT),
        "lit with shadows": Lit(normals_of(), shadows, halfway=True),
        "lit by slopes of a shader": Lit(ShaderSlopes("central", 20.0)),
    }
