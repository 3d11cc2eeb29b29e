"""Normals: how long kernels and codes take, how many bytes they need, and how far off they are.

Speed is measured beside scipy's three Sobel passes with normalisation, and a plain copy. The limit is what must cross
the memory bus, bytes read and bytes written, at the speed of the copy.

A core with AVX2 (EPYC, 3.1 GHz) spends 1.1 ns on a voxel of bytes with the thesis' kernel and three bytes a code. Sums
of differences take 0.35 of them, loads and stores rather than arithmetic; encoding takes 0.75, 30 vector operations and
8 cycles of the divider for eight voxels. Of the 1.5 ns for uint16, summed in float32 and so half as many at a time,
sums take 0.75 and encoding 0.6. 30 % of the bandwidth would allow 0.7 to 0.9 ns. Without the divider (the CPU's guess
of 1 / √x, a Newton step, and the exact way only for what lies near a half) encoding takes as long: that keeps the
multipliers busy instead.
"""

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray
from rich.console import Console, Group
from rich.table import Table

from volprep.kernels import _native
from volprep.truth.normal_codes import DIRECTION_BYTES, decoded
from volprep_formats.package.parts.normals.record import GradientKernel, NormalCode

from .bandwidth import copy_all

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from normal_fields import (
    EVEN,
    WHOLE,
    AnalyticField,
    angles,
    coded,
    directions,
    marschner_lobb,
    positions,
    sphere,
    torus,
    wave_gradients,
)

SHAPE = (224, 512, 512)
SIDE = 64
NOISE = 0.02
KERNELS: tuple[GradientKernel, ...] = get_args(GradientKernel)
CODES: tuple[NormalCode, ...] = get_args(NormalCode)


@dataclass(frozen=True)
class NormalsSpeed:
    """One kernel and code on a volume of 58.7 million voxels."""

    kernel: str
    code: str
    voxels: str
    """Type of a voxel."""
    ms: float
    """Best time, on all threads."""
    bytes_a_voxel: int
    """Bytes written for each voxel."""
    share_of_bandwidth: float
    """Bytes read and written at the speed of a plain copy, over our time."""
    times_scipy: float
    """How many times faster than three passes of scipy.ndimage.sobel and a normalisation in float32."""


@dataclass(frozen=True)
class NormalsError:
    """Degrees that one kernel and code are off on one field."""

    field: str
    noise: float
    """Standard deviation of the noise, of a field from 0 to 1."""
    kernel: str
    code: str
    """Code, or float32 for the gradient itself."""
    mean: float
    p99: float
    largest: float


@dataclass(frozen=True)
class NormalsRows:
    """Everything about normals in bench.json."""

    copy_gb_per_s: float
    """Plain copy: bytes read and bytes written."""
    speed: tuple[NormalsSpeed, ...]
    errors: tuple[NormalsError, ...]


def measure_normals(console: Console) -> Iterator[NormalsRows]:
    """Measure speed, then errors."""
    console.print("measuring normals", style="dim")
    copy_gb_per_s, speed = _speed()
    yield NormalsRows(copy_gb_per_s, speed, (*_waves(), *_code_errors(), *_field_errors()))


def normals_tables(measured: list[NormalsRows]) -> Group:
    """Tables for people."""
    (rows,) = measured
    speed = Table("normals, 224×512×512", "code", "voxels", "ms", "bytes", "bandwidth", "scipy sobel")
    for row in rows.speed:
        cells = (f"{row.ms:.0f}", str(row.bytes_a_voxel), f"{row.share_of_bandwidth:.0%}", f"{row.times_scipy:.0f} ×")
        speed.add_row(row.kernel, row.code, row.voxels, *cells)
    errors = Table("normals of", "noise", "kernel", "code", "mean °", "99 % °", "largest °")
    for error in rows.errors:
        numbers = (f"{error.mean:.3f}", f"{error.p99:.3f}", f"{error.largest:.3f}")
        errors.add_row(error.field, f"{error.noise:.0%}", error.kernel, error.code, *numbers)
    return Group(speed, errors)


def _speed() -> tuple[float, tuple[NormalsSpeed, ...]]:
    rng = np.random.default_rng(1)
    source = rng.integers(0, 256, SHAPE, np.uint8)
    copied = np.empty(source.size, np.uint8)
    jobs = [(source, kernel, code) for kernel in KERNELS for code in CODES if "thesis" in kernel or "biased8" in code]
    wide = source.astype(np.uint16) * 257
    jobs.append((wide, "thesis", "biased8"))
    best = [float("inf")] * len(jobs)
    copy_s = float("inf")
    outputs = {width: np.empty((*SHAPE, width), np.uint8) for width in (2, 3)}
    for _ in range(7):
        copy_s = min(copy_s, _seconds(lambda: copy_all(source.reshape(-1), copied)))
        for number, (volume, kernel, code) in enumerate(jobs):
            output = outputs[DIRECTION_BYTES[code]]
            best[number] = min(best[number], _seconds(lambda: _run(volume, kernel, code, output)))  # noqa: B023
    # A tenth of the slices: scipy takes as long for each.
    scipy_s = min(_seconds(lambda: _with_scipy(source[:22])) for _ in range(2)) * SHAPE[0] / 22
    bytes_per_s = 2 * source.nbytes / copy_s
    rows = tuple(
        NormalsSpeed(
            kernel=kernel,
            code=code,
            voxels=str(volume.dtype),
            ms=seconds * 1e3,
            bytes_a_voxel=DIRECTION_BYTES[code],
            share_of_bandwidth=(volume.nbytes + volume.size * DIRECTION_BYTES[code]) / bytes_per_s / seconds,
            times_scipy=scipy_s / seconds,
        )
        for (volume, kernel, code), seconds in zip(jobs, best, strict=True)
    )
    return bytes_per_s / 1e9, rows


def _run(source: NDArray[np.generic], kernel: str, code: str, output: NDArray[np.uint8]) -> None:
    _native.normals(source, kernel, WHOLE, EVEN, code, output)


def _with_scipy(source: NDArray[np.uint8]) -> NDArray[np.float32]:
    values = source.astype(np.float32)
    vectors = np.stack([scipy.ndimage.sobel(values, axis) for axis in (2, 1, 0)], axis=-1)
    length = np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return np.divide(vectors, length, out=vectors, where=length > 0)


def _seconds(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def _error(field: str, noise: float, kernel: str, code: str, found: NDArray[np.float64]) -> NormalsError:
    p99 = float(np.percentile(found, 99))
    return NormalsError(field, noise, kernel, code, float(found.mean()), p99, float(found.max()))


def _waves() -> list[NormalsError]:
    waves = directions(20000) * np.pi / 4
    name = "plane waves, |k| = π/4"
    return [_error(name, 0, kernel, "float32", angles(wave_gradients(kernel, waves), waves)) for kernel in KERNELS]


def _code_errors() -> list[NormalsError]:
    vectors = directions(200_000)
    return [_error("all directions", 0, "exact", code, angles(coded(vectors, code), vectors)) for code in CODES]


def _field_errors() -> list[NormalsError]:
    at = positions(SIDE)
    fields = {
        "sphere of 24 voxels": sphere(24.0, 3.0),
        "torus of 20 and 7 voxels": torus(20.0, 7.0, 3.0),
        "Marschner-Lobb, 64³": marschner_lobb(SIDE / 2),
    }
    return [
        error
        for name, field in fields.items()
        for noise in (0.0, NOISE)
        for kernel in KERNELS
        for error in _on_field(name, field, at, noise, kernel)
    ]


def _on_field(
    name: str, field: AnalyticField, at: NDArray[np.float64], noise: float, kernel: GradientKernel
) -> list[NormalsError]:
    true = field.gradient(at)
    length = np.linalg.norm(true, axis=-1)
    # Where there is a surface, and not at the border, where differences are one-sided.
    seen = length > 0.5 * length.max()
    seen[[0, -1]] = seen[:, [0, -1]] = seen[:, :, [0, -1]] = False
    exact = field.value(at) + np.random.default_rng(2).normal(0, noise, at.shape[:3])
    values = np.rint((exact + 0.25) / 1.5 * 65535).clip(0, 65535).astype(np.uint16)
    vectors = np.empty((*values.shape, 3), np.float32)
    _native.gradient(values, kernel, WHOLE, EVEN, vectors)
    rows = [_error(name, noise, kernel, "float32", angles(vectors[seen].astype(np.float64), true[seen]))]
    for code in CODES:
        octets = np.empty((*values.shape, DIRECTION_BYTES[code]), np.uint8)
        _run(values, kernel, code, octets)
        rows.append(_error(name, noise, kernel, code, angles(decoded(octets[seen], code), true[seen])))
    return rows
