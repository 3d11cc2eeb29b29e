"""What Zstandard would save of the textures of real scans, and what its decoding costs a reader.

Each texture of a package is compressed as a whole, as a KTX 2 file with supercompression scheme 2 has it. Beside it
stands gzip, which many servers and all browsers have anyhow. Times are those of the C libraries on this machine: a
decoder in JavaScript is several times slower. They are told against SHA-256 of the same texels, which readers compute.
"""

import gzip
import hashlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import imagecodecs
import numpy as np
from rich.console import Console
from rich.table import Table

from volprep_formats.textures import ktx2

from .real_scans import SCANS, PlannedDraft, have_scans, planned_draft

LEVELS = (3, 12)
"""How hard the encoder tries, of 1 to 22."""
_TRANSFER = "surface"
_POINTS = ((60.0, 0.0), (120.0, 0.1), (220.0, 0.5))
_REPEATS = 3


@dataclass(frozen=True)
class TransportRow:
    """All textures of one scan, at one level of the encoder."""

    scan: str
    """Which scan."""
    level: int
    """How hard the encoder tries."""
    texel_bytes: int
    """Size of the texels."""
    ratio: float
    """Size of the texels, divided by what they are compressed to."""
    gzip_ratio: float
    """The same for gzip at its level 6."""
    decode_to_sha256: float
    """Time of decoding, divided by that of SHA-256 of the texels."""
    gzip_to_sha256: float
    """The same for gzip."""
    pays_below_mbit_s: float
    """Speed of a connection on which decoding takes as long as what is saved."""


def measure_transport(console: Console) -> list[TransportRow]:
    """Measure six real scans; nothing where there are none."""
    if not have_scans():
        console.print("transport: VOLPREP_TEST_DATA names no scans", style="dim")
        return []
    rows: list[TransportRow] = []
    for scan in SCANS:
        console.print(f"measuring transport, {scan}", style="dim")
        with planned_draft(scan, {_TRANSFER: _POINTS}) as made:
            texels = list(_texels(made))
        rows += (_row(scan, level, texels) for level in LEVELS)
    return rows


def transport_table(rows: list[TransportRow]) -> Table:
    """Show them."""
    table = Table(
        "scan", "level", "texels MB", "smaller", "by gzip", "decode ÷ SHA-256", "gzip ÷ SHA-256", "pays below Mbit/s"
    )
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        table.add_row(
            row.scan,
            str(row.level),
            f"{row.texel_bytes / 1e6:.1f}",
            f"{row.ratio:.2f} ×",
            f"{row.gzip_ratio:.2f} ×",
            f"{row.decode_to_sha256:.2f}",
            f"{row.gzip_to_sha256:.2f}",
            f"{row.pays_below_mbit_s:.0f}",
        )
    return table


def _texels(made: PlannedDraft) -> Iterator[bytes]:
    """Texels of each level of each texture of the draft of a package."""
    package = made.package()
    for file in dict.fromkeys(texture.file for texture in package.manifest.textures):
        for level in ktx2.decode(package.read_bytes(file), file).levels:
            yield np.ascontiguousarray(level).tobytes()


def _row(scan: str, level: int, texels: list[bytes]) -> TransportRow:
    packed = [imagecodecs.zstd_encode(each, level=level) for each in texels]
    zipped = [gzip.compress(each, 6) for each in texels]
    decode_s = _least_s(lambda: [imagecodecs.zstd_decode(each) for each in packed])
    gzip_s = _least_s(lambda: [gzip.decompress(each) for each in zipped])
    digest_s = _least_s(lambda: [hashlib.sha256(each).digest() for each in texels])
    size, packed_size = sum(map(len, texels)), sum(map(len, packed))
    return TransportRow(
        scan=scan,
        level=level,
        texel_bytes=size,
        ratio=size / packed_size,
        gzip_ratio=size / sum(map(len, zipped)),
        decode_to_sha256=decode_s / digest_s,
        gzip_to_sha256=gzip_s / digest_s,
        pays_below_mbit_s=(size - packed_size) * 8e-6 / decode_s,
    )


def _least_s(work: Callable[[], object]) -> float:
    """Least processor time of several runs: a busy machine makes all of them longer."""
    times = []
    for _ in range(_REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)
