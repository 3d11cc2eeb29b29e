"""What Zstandard would save of the textures of real scans, and what its decoding costs a reader.

Each texture of a package becomes a row of frames, as `volprep zip --texels zstd` writes it. Beside it stands gzip,
which many servers and all browsers have anyhow. Times are those of the C libraries on this machine, and those of
formats/js in node. They are told against SHA-256 of the same texels by the same side, which readers compute.
"""

import gzip
import hashlib
import json
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from volprep_formats.textures import ktx2
from volprep_formats.textures.zstd_frames import compress, decompress

from .real_scans import SCANS, PlannedDraft, planned_draft

_TRANSFER = "surface"
_POINTS = ((60.0, 0.0), (120.0, 0.1), (220.0, 0.5))
_REPEATS = 3
_IN_NODE = Path(__file__).with_name("unpack.mjs")


@dataclass(frozen=True)
class TransportRow:
    """All textures of one scan."""

    scan: str
    """Which scan."""
    texel_bytes: int
    """Size of the texels."""
    ratio: float
    """Size of the texels, divided by that of the frames."""
    gzip_ratio: float
    """The same for gzip at its level 6."""
    decode_to_sha256: float
    """Time of decoding, divided by that of SHA-256 of the texels."""
    gzip_to_sha256: float
    """The same for gzip."""
    js_to_sha256: float
    """Time of the decoder of formats/js, divided by that of its SHA-256 of the texels."""
    pays_below_mbit_s: float
    """Speed of a connection on which formats/js takes as long to decode as the smaller file saves."""


def measure_transport(console: Console) -> Iterator[TransportRow]:
    """Measure six real scans."""
    for scan in SCANS:
        console.print(f"measuring transport, {scan}", style="dim")
        with planned_draft(scan, {_TRANSFER: _POINTS}) as made:
            yield _row(scan, list(_texels(made)))


def transport_table(rows: list[TransportRow]) -> Table:
    """Show them."""
    columns = ("texels MB", "smaller", "by gzip", "decode ÷ SHA-256", "gzip ÷ SHA-256", "JS ÷ JS", "pays below Mbit/s")
    table = Table("scan", *columns)
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        table.add_row(
            row.scan,
            f"{row.texel_bytes / 1e6:.1f}",
            f"{row.ratio:.2f} ×",
            f"{row.gzip_ratio:.2f} ×",
            f"{row.decode_to_sha256:.2f}",
            f"{row.gzip_to_sha256:.2f}",
            f"{row.js_to_sha256:.2f}",
            f"{row.pays_below_mbit_s:.0f}",
        )
    return table


def _texels(made: PlannedDraft) -> Iterator[bytes]:
    """Texels of each level of each texture of the draft of a package."""
    package = made.package()
    for file in dict.fromkeys(texture.file for texture in package.manifest.textures):
        for level in ktx2.decode(package.read_bytes(file), file).levels:
            yield np.ascontiguousarray(level).tobytes()


def _row(scan: str, texels: list[bytes]) -> TransportRow:
    packed = [b"".join(compress(memoryview(each))) for each in texels]
    zipped = [gzip.compress(each, 6) for each in texels]
    pairs = [(memoryview(each), len(whole)) for each, whole in zip(packed, texels, strict=True)]
    decode_s = _least_s(lambda: [decompress(*each) for each in pairs])
    gzip_s = _least_s(lambda: [gzip.decompress(each) for each in zipped])
    digest_s = _least_s(lambda: [hashlib.sha256(each).digest() for each in texels])
    size, packed_size = sum(map(len, texels)), sum(map(len, packed))
    js_s, js_digest_s = _in_node(b"".join(packed), size)
    return TransportRow(
        scan=scan,
        texel_bytes=size,
        ratio=size / packed_size,
        gzip_ratio=size / sum(map(len, zipped)),
        decode_to_sha256=decode_s / digest_s,
        gzip_to_sha256=gzip_s / digest_s,
        js_to_sha256=js_s / js_digest_s,
        # Fewer bytes are also digested faster.
        pays_below_mbit_s=(size - packed_size) * 8e-6 / max(js_s - js_digest_s * (1 - packed_size / size), 1e-9),
    )


def _in_node(packed: bytes, size: int) -> tuple[float, float]:
    """Seconds of decoding, and of SHA-256 of what it gives, in JavaScript."""
    with tempfile.NamedTemporaryFile() as file:
        file.write(packed)
        file.flush()
        command = ["node", str(_IN_NODE), file.name, str(size)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    decode_ms, digest_ms = json.loads(done.stdout)
    return decode_ms / 1e3, digest_ms / 1e3


def _least_s(work: Callable[[], object]) -> float:
    """Least processor time of several runs: a busy machine makes all of them longer."""
    times = []
    for _ in range(_REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)
