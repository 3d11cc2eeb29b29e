"""Compressed DICOM slices: worker processes on all cores against the same decoders, one slice after the other, here."""

import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydicom.encaps import encapsulate
from pydicom.uid import UID, JPEG2000Lossless, JPEGLosslessSV1, JPEGLSLossless, RLELossless
from rich.console import Console
from rich.table import Table

from tests.support.dicom_files import encoded
from volprep_formats.isolation import available_cores, workers
from volprep_formats.readers.dicom.compressed import decode_compressed, decode_request
from volprep_formats.readers.dicom.header import EncodedPixels

SLICES, SIDE = 60, 512
ROUNDS = 3


@dataclass(frozen=True)
class DecodeRow:
    """One transfer syntax."""

    syntax: str
    """Its name."""
    serial_s: float
    """One slice after the other, in this process."""
    workers_s: float
    """In workers that run already."""
    first_s: float
    """In workers that have to be started."""
    ratio: float
    """How many times faster workers are that run already."""


def measure_decode(console: Console) -> Iterator[DecodeRow]:
    """Decode 60 slices of 512×512 pixels with 12 bits, the same ones in each syntax."""
    y, x = np.linspace(-1, 1, SIDE)[:, None], np.linspace(-1, 1, SIDE)
    noise = np.random.default_rng(1).normal(0, 12, (SIDE, SIDE))
    slices = [
        ((1000 + 600 * np.sin(9 * x + k / 9) * np.cos(7 * y) + noise) * (x**2 + y**2 < 0.8)).clip(0).astype(np.uint16)
        for k in range(SLICES)
    ]
    for syntax in (JPEGLosslessSV1, JPEG2000Lossless, JPEGLSLossless, RLELossless):
        console.print(f"measuring decoding of {syntax.name}", style="dim")
        with tempfile.TemporaryDirectory() as folder:
            yield _measure(syntax, [_encoded(Path(folder) / str(k), s, syntax) for k, s in enumerate(slices)])


def decode_table(rows: list[DecodeRow]) -> Table:
    """Table for people."""
    table = Table("60 slices of 512×512", "one by one s", "in workers s", "with their start s", "times faster")
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        times = (row.serial_s, row.workers_s, row.first_s)
        table.add_row(row.syntax, *(f"{seconds:.2f}" for seconds in times), f"{row.ratio:.2f} ×")
    return table


def _encoded(path: Path, pixels: NDArray[np.uint16], syntax: UID) -> EncodedPixels:
    path.write_bytes(encapsulate([encoded(pixels, syntax, 12)]))
    return EncodedPixels(
        path=path,
        transfer_syntax=syntax,
        rows=SIDE,
        columns=SIDE,
        bits_allocated=16,
        bits_stored=12,
        high_bit=11,
        signed=False,
        is_float=False,
        inverted=False,
        has_words=False,
        offset_bytes=0,
        size_bytes=path.stat().st_size,
    )


def _measure(syntax: UID, pictures: list[EncodedPixels]) -> DecodeRow:
    requests = [decode_request(picture) for picture in pictures]
    slab = np.empty((SLICES, SIDE, SIDE), np.uint16)

    def place(index: int, decoded: NDArray[np.generic]) -> None:
        slab[index] = decoded

    def serial() -> None:
        for k, picture in enumerate(pictures):
            slab[k] = decode_compressed(picture)

    def started() -> None:
        with workers() as pool:
            pool.run(requests, place)

    serial_s = running_s = first_s = float("inf")
    for _ in range(ROUNDS):
        first_s = min(first_s, _seconds(started))
        serial_s = min(serial_s, _seconds(serial))
        with workers() as pool:
            pool.run(requests[: available_cores()], place)
            running_s = min(running_s, _seconds(lambda pool=pool: pool.run(requests, place)))
    return DecodeRow(syntax.name, serial_s, running_s, first_s, serial_s / running_s)


def _seconds(run: Callable[[], None]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start
