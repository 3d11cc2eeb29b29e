"""More than 2^31 voxels, built, drawn and judged: `python -m tests.benchmarks.huge_scan`. It takes 12 GB of disk.
`--shape 1000 1000 1000` takes a smaller scan.

The scan is a sparse file: zeros that no disk holds, and three smooth balls at its two ends and in the middle. The last
one lies where an index of 32 bits has overflowed. The package has levels and pieces of level 0; its verdict is the
proof. Not a part of `make bench`: it takes some minutes.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SHAPE_ZYX = (2049, 1024, 1024)
RADIUS = 90
_SCENE = """
name = "huge"
[source]
path = "huge.raw"
raw = {{ shape_zyx = [{}, {}, {}], dtype = "uint8", spacing_mm_zyx = [0.5, 0.5, 0.5] }}
[pyramid]
filter = "box"
[grid]
size = "auto"
[[transfer]]
name = "balls"
points = [
    {{ value = 20, colour = "#402010", extinction_per_mm = 0 }},
    {{ value = 120, colour = "#c09060", extinction_per_mm = 0.05 }},
    {{ value = 250, colour = "#ffffff", extinction_per_mm = 0.3 }},
]
"""
_COMMAND = (sys.executable, "-c", "from volprep_cli.main import main; main()")


def write_scan(path: Path, shape_zyx: tuple[int, int, int] = SHAPE_ZYX) -> None:
    """Write the sparse file."""
    axis = np.arange(-RADIUS, RADIUS) + 0.5
    away = np.sqrt(axis[:, None, None] ** 2 + axis[None, :, None] ** 2 + axis**2)
    ball = np.clip(255 * (1 - away / RADIUS), 0, 255).astype(np.uint8)
    corners = [tuple(round(part * (n - 2 * RADIUS)) for n in shape_zyx) for part in (0.0, 0.5, 1.0)]
    _, rows, columns = shape_zyx
    with path.open("wb") as file:
        file.truncate(int(np.prod(shape_zyx, dtype=np.int64)))
        for z, y, x in corners:
            for k, plane in enumerate(ball):
                for j, row in enumerate(plane):
                    file.seek(((z + k) * rows + y + j) * columns + x)
                    file.write(row.tobytes())


def run(*words: str) -> tuple[int, float, float]:
    """Run a command; give its exit status, seconds, and the peak of memory that maps no file, in GB."""
    started = time.monotonic()
    process = subprocess.Popen([*_COMMAND, *words])
    anonymous = 0.0
    while process.poll() is None:
        anonymous = max(anonymous, _anonymous_gb(process.pid))
        time.sleep(0.5)
    return process.returncode, time.monotonic() - started, anonymous


def _anonymous_gb(pid: int) -> float:
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1e6 for line in lines if line.startswith("RssAnon")), 0.0)


def main() -> None:
    """Build, validate, say how long it took and what memory beside mapped files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, help="where to work; a temporary folder if absent")
    parser.add_argument("--shape", type=int, nargs=3, default=SHAPE_ZYX, help="voxels along z, y and x")
    asked = parser.parse_args()
    depth, rows, columns = asked.shape
    with tempfile.TemporaryDirectory(dir=asked.folder) as name:
        folder = Path(name)
        write_scan(folder / "huge.raw", (depth, rows, columns))
        (folder / "huge.toml").write_text(_SCENE.format(*asked.shape), encoding="utf-8")
        before = 0.0
        commands = (
            ("build", str(folder / "huge.toml"), "--output", str(folder / "huge.volpkg")),
            ("validate", str(folder / "huge.volpkg"), "--report", str(folder / "report")),
        )
        for words in commands:
            status, seconds, anonymous = run(*words)
            times = os.times()
            spent = times.children_user + times.children_system
            print(
                f"{words[0]}: exit {status}, {seconds:.0f} s, {spent - before:.0f} s of processor, {anonymous:.2f} GB"
            )
            before = spent


if __name__ == "__main__":
    main()
