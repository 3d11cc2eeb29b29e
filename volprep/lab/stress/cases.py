"""Numerically hard small scans: stiff light, thin features, and numbers at the ends of their types.

Each case names its difficulty, and the largest error of its pictures against the truth. Samples can miss a feature that
is thinner than their distance, whatever the arithmetic: for it "lookup" has no limit and its error is only reported;
"preintegrated", which integrates between samples, has a limit.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.scene.points import ScenePoint
from volprep.truth.phantoms import Field, constant, distance, sampled
from volprep_formats.arrays import Float32Array
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import ClassificationName, CompositingName

Voxels = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.int16] | Float32Array
Limits = Mapping[ClassificationName, Tolerance | None]

CLASSIFICATIONS: tuple[ClassificationName, ...] = ("lookup", "preintegrated")
"""Settings for drawing each case."""

COMPOSITING: CompositingName = "emission-absorption"
"""Compositing of each case."""

_USUAL = dict.fromkeys(CLASSIFICATIONS, Tolerance())
# Rounding of the target, half a step of 8 bits, plus the opacity that early termination leaves out, 0.002.
_EXACT = dict.fromkeys(CLASSIFICATIONS, Tolerance(rmse=0.004, maximum=0.004))
# A feature sharper than an entry of the table lies somewhere within it: pixels on silhouettes may show its neighbour.
_SILHOUETTES = dict.fromkeys(CLASSIFICATIONS, Tolerance(rmse=0.06, maximum=1.0))
_BETWEEN_SAMPLES: Limits = {**_SILHOUETTES, "lookup": None}

_SIZE = 24
_WHITE = "#ffffff"


@dataclass(frozen=True)
class StressCase:
    """One scan, and one transfer function."""

    name: str
    """Name; lower-case letters, digits and -."""
    hard: str
    """Description of the difficulty."""
    voxels: Callable[[], Voxels]
    """Makes the scan [z, y, x]."""
    points: tuple[ScenePoint, ...]
    """Control points of the transfer function."""
    limits: Limits
    """Largest error by classification; None if samples cannot resolve the feature."""
    spacing_mm_zyx: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Distance between voxel centres."""
    lit: bool = False
    """Whether a headlight lights it."""
    fainter: str | None = None
    """Name of the case that is the same with less extinction, and must be no more opaque."""
    profile: str | None = None
    """Class of devices that it is for, whatever is asked; None for any."""
    techniques: bool = True
    """Whether other techniques and coarser levels are drawn, too; not where that takes minutes and says no more."""
    silhouettes: bool = False
    """Whether the feature is so dense, and so sharp, that the places of layers decide where its silhouette is; see
    `StressDrawing.common_planes`."""
    refused: str | None = None
    """Error code of the expected refusal; None if it must be drawn."""


def _point(value: float, extinction_per_mm: float, colour: str = _WHITE) -> ScenePoint:
    return ScenePoint(value=value, colour=colour, extinction_per_mm=extinction_per_mm)


def _field(
    field_of: Callable[[Grid], Field],
    shape_zyx: tuple[int, int, int] = (_SIZE, _SIZE, _SIZE),
    spacing_mm_zyx: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> Callable[[], Float32Array]:
    def voxels() -> Float32Array:
        grid = Grid.of(shape_zyx, spacing_mm_zyx)
        return sampled(field_of(grid), grid)

    return voxels


def _centred(grid: Grid) -> Field:
    x, y, z = (length / 2 for length in reversed(grid.extent_mm_zyx))
    return distance((x, y, z))


def _with_one(value: float) -> Callable[[], Float32Array]:
    def voxels() -> Float32Array:
        ones = np.ones((_SIZE, _SIZE, _SIZE), np.float32)
        ones.flat[99] = value
        return ones

    return voxels


def _waves() -> NDArray[np.uint8]:
    """Return four slices of 2048² voxels, which share their texels."""
    z, y, x = np.ogrid[:4, :2048, :2048]
    waves = 127.5 + 60.0 * np.sin(x / 9.0) + 60.0 * np.cos(y / 11.0 + z / 3.0)
    return np.rint(waves).astype(np.uint8)


def _comb(peaks: range, half_width: float, extinction_per_mm: float) -> tuple[ScenePoint, ...]:
    colours = ("#ff4040", "#40ff40", "#4080ff")
    return tuple(
        _point(peak + side * half_width, extinction_per_mm * (side == 0), colours[index % 3])
        for index, peak in enumerate(peaks)
        for side in (-1, 0, 1)
    )


def _ripples(count: int) -> tuple[ScenePoint, ...]:
    """Return points whose extinction changes by chance from one to the next, in colours that turn slowly."""
    chance = np.random.default_rng(5)
    values, extinctions = np.linspace(0.0, 25.0, count), chance.uniform(0.0, 0.3, count)
    colours = ("#ff8040", "#40a0ff", "#80ff60")
    return tuple(
        _point(float(value), float(extinction), colours[index * 3 // count])
        for index, (value, extinction) in enumerate(zip(values, extinctions, strict=True))
    )


def _depth(exponent: int, fainter: int | None) -> StressCase:
    return StressCase(
        name=f"depth-1e{exponent}",
        hard=f"a homogeneous cube with an optical depth of 1e{exponent} for each voxel",
        voxels=_field(lambda _: constant(100.0)),
        points=(_point(0, 10.0**exponent, "#ff8040"), _point(200, 10.0**exponent, "#ff8040")),
        limits=_EXACT,
        fainter=None if fainter is None else f"depth-1e{fainter}",
    )


_EXPONENTS = (-6, -4, -3, -2, -1, 0, 1, 2, 4, 6)
"""From far too faint to see, to opaque within a millionth of a voxel."""

CASES: tuple[StressCase, ...] = (
    *map(_depth, _EXPONENTS, (None, *_EXPONENTS)),
    StressCase(
        name="wall",
        hard="an opaque wall at a jump of the transfer function, behind a haze of extinction 0.02/mm",
        voxels=_field(_centred),
        points=(
            _point(0, 1e9, "#4060ff"),
            _point(6, 1e9, "#4060ff"),
            _point(6, 0.02, "#ffc080"),
            _point(30, 0.02, "#ffc080"),
        ),
        limits=_SILHOUETTES,
        silhouettes=True,
    ),
    StressCase(
        name="thin-shells",
        hard="four shells, each a fiftieth of a voxel thick and opaque to a half",
        voxels=_field(_centred),
        points=_comb(range(3, 10, 2), 0.02, 35.0),
        limits=_BETWEEN_SAMPLES,
        silhouettes=True,
    ),
    StressCase(
        name="thousand-points",
        hard="a transfer function of 1000 points, each higher or lower than the one before, twenty of them in a voxel",
        voxels=_field(_centred),
        points=_ripples(1000),
        limits=_BETWEEN_SAMPLES,
    ),
    StressCase(
        name="jumps",
        hard="a transfer function of eight steps, each an edge that no sample sees",
        voxels=_field(_centred),
        points=tuple(
            _point(1.5 * k + side * 1.5, 0.4 * (k % 2), ("#ff8000", "#0080ff")[k // 2 % 2])
            for k in range(8)
            for side in (0, 1)
        ),
        limits=_USUAL,
    ),
    StressCase(
        name="faint-layers",
        hard="two hundred layers behind each other, each of them too faint for a step of 8 bits",
        voxels=lambda: np.broadcast_to(np.arange(400)[:, None, None] % 2, (400, 32, 32)).astype(np.float32),
        points=(_point(0, 0.0), _point(1, 0.015)),
        spacing_mm_zyx=(0.2, 2.0, 2.0),
        limits=_USUAL,
    ),
    StressCase(
        name="anisotropy",
        hard="three slices, a hundred times as far apart as their rows",
        voxels=_field(_centred, (3, 200, 200), (100.0, 1.0, 1.0)),
        points=(_point(40, 0.0), _point(70, 0.02, "#80c0ff"), _point(100, 0.0)),
        spacing_mm_zyx=(100.0, 1.0, 1.0),
        limits=_USUAL,
    ),
    StressCase(
        name="one-voxel",
        hard="a single voxel",
        voxels=_field(lambda _: constant(1.0), (1, 1, 1)),
        points=(_point(0, 0.0), _point(1, 2.0, "#40c0ff")),
        limits=_EXACT,
    ),
    StressCase(
        name="one-slice",
        hard="a single slice, and so no slope along z",
        voxels=_field(_centred, (1, _SIZE, _SIZE)),
        points=(_point(0, 1.0, "#ffd080"), _point(12, 0.0)),
        lit=True,
        limits=_USUAL,
    ),
    StressCase(
        name="no-gradient",
        hard="light on a scan without any slope",
        voxels=_field(lambda _: constant(1.0)),
        points=(_point(0, 0.05), _point(1, 0.05, "#80ff80")),
        lit=True,
        limits=_EXACT,
    ),
    StressCase(
        name="sixteen-bits",
        hard="values over all 16 bits, with a transfer function that shows a window of 100: a shell of 0.03 voxels",
        voxels=lambda: (_field(_centred)() * np.float32(3150)).astype(np.uint16),
        points=(_point(30000, 0.0), _point(30050, 20.0, "#ff60a0"), _point(30100, 0.0)),
        limits=_BETWEEN_SAMPLES,
        silhouettes=True,
    ),
    StressCase(
        name="negative",
        hard="values from -32768 to 32767",
        voxels=lambda: np.linspace(-32768, 32767, _SIZE**3).reshape(_SIZE, _SIZE, _SIZE).astype(np.int16),
        points=(_point(-32768, 0.2, "#4080ff"), _point(-1, 0.0), _point(0, 0.0), _point(32767, 0.2, "#ff8040")),
        limits=_USUAL,
    ),
    StressCase(
        name="denormals",
        hard="values that no float32 holds with all its digits",
        voxels=lambda: (_field(_centred)().astype(np.float64) * 1e-42).astype(np.float32),
        points=(_point(0, 0.3, "#c0ff40"), _point(1.2e-41, 0.0)),
        limits=_USUAL,
    ),
    StressCase(
        name="huge",
        hard="values whose square is infinite in float32",
        voxels=lambda: _field(_centred)() * np.float32(1e36),
        points=(_point(0, 0.3, "#c0ff40"), _point(1.2e37, 0.0)),
        limits=_USUAL,
    ),
    StressCase(
        name="sixty-decades",
        hard="values of 1e-30 and of 1e30 in one scan",
        voxels=lambda: np.where(np.indices((_SIZE, _SIZE, _SIZE)).sum(axis=0) % 16 < 8, 1e-30, 1e30).astype(np.float32),
        points=(_point(0, 0.02, "#4080ff"), _point(1e30, 0.2, "#ff8040")),
        limits=_USUAL,
    ),
    StressCase(
        name="faint-slices",
        hard="a faint block; slices blend it in 64 to 1024 layers, each fainter than a step of 8 bits",
        voxels=_field(lambda _: constant(100.0), (256, 16, 16), (0.25, 4.0, 4.0)),
        points=(_point(0, 0.011, "#ff8040"), _point(200, 0.011, "#ff8040")),
        spacing_mm_zyx=(0.25, 4.0, 4.0),
        limits=_EXACT,
    ),
    StressCase(
        name="wide-mosaic",
        hard="a mosaic of 2048² texels, where neighbours have equal 16-bit coordinates",
        voxels=_waves,
        points=(_point(90, 0.0, "#4080ff"), _point(200, 0.005, "#ff8040")),
        spacing_mm_zyx=(100.0, 1.0, 1.0),
        profile="gles2-2048",
        techniques=False,
        limits=_USUAL,
    ),
    StressCase(
        name="no-number",
        hard="a voxel that is NaN",
        voxels=_with_one(np.nan),
        points=(_point(0, 0.0), _point(1, 1.0)),
        refused="VP1090",
        limits=_USUAL,
    ),
    StressCase(
        name="infinity",
        hard="an infinite voxel",
        voxels=_with_one(np.inf),
        points=(_point(0, 0.0), _point(1, 1.0)),
        refused="VP1090",
        limits=_USUAL,
    ),
)
"""All cases, in the order of the report."""
