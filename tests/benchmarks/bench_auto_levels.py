"""What the choice of levels costs: builds of one scan with `filter = "auto"` and with `"box"`, in turns.

    python -m tests.benchmarks.bench_auto_levels --size 1000 --rounds 3

The scan has `size`³ voxels of 16 bits: soft lumps, thin vessels and noise. Each build is a process of its own;
processor seconds are those of all its threads, which other programs disturb less than the clock. `--scan PATH` builds a
scan in place of that.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

FILTERS = ("box", "auto")
_PERIOD_VOXELS = 37.0
"""Distance of the vessels."""


@dataclass(frozen=True)
class BuildCost:
    """One build."""

    wall_s: float
    """By the clock."""
    processor_s: float
    """Of all threads, user and system."""


def main() -> None:
    """Build in turns, and print medians and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=384, help="voxels along an edge")
    parser.add_argument("--rounds", type=int, default=3, help="builds with each filter")
    parser.add_argument("--scan", type=Path, help="build this scan in place of a volume of --size")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenes = {each: _scene(folder, each, asked.size, asked.scan) for each in FILTERS}
        if asked.scan is None:
            _write_scan(folder / "scan.raw", asked.size)
        costs: dict[str, list[BuildCost]] = {each: [] for each in FILTERS}
        for _ in range(asked.rounds):
            for each, scene in scenes.items():
                costs[each].append(_built(scene, folder / f"{each}.volpkg"))
    table = Table("filter", "processor s", "wall s")
    medians = {}
    for each, found in costs.items():
        medians[each] = statistics.median(cost.processor_s for cost in found)
        wall_s = statistics.median(cost.wall_s for cost in found)
        table.add_row(each, f"{medians[each]:.2f}", f"{wall_s:.2f}")
    console = Console()
    console.print(table)
    console.print(f"auto takes {medians['auto'] / medians['box']:.2f} times the processor time of box")


def _scene(folder: Path, name: str, size: int, scan: Path | None) -> Path:
    path = folder / f"{name}.toml"
    source = f'path = "{scan.resolve()}"\n' if scan else f'path = "scan.raw"\n{_layout(size)}'
    path.write_text(
        f'name = "{name}"\nprofile = "gles3"\n[source]\n{source}[pyramid]\nfilter = "{name}"\n'
        '[[transfer]]\nname = "thing"\npoints = [\n'
        '  { value = 12000.0, colour = "#402010", extinction_per_mm = 0.0 },\n'
        '  { value = 24000.0, colour = "#c08060", extinction_per_mm = 0.05 },\n'
        '  { value = 60000.0, colour = "#fff0e0", extinction_per_mm = 2.0 },\n]\n'
    )
    return path


def _layout(size: int) -> str:
    return f'[source.raw]\nshape_zyx = [{size}, {size}, {size}]\ndtype = "uint16"\nspacing_mm_zyx = [0.5, 0.5, 0.5]\n'


def _write_scan(path: Path, size: int) -> None:
    """Write lumps in a ball, vessels along z, and noise, slice by slice."""
    generator = np.random.default_rng(7)
    y, x = np.meshgrid(*[np.arange(size, dtype=np.float32) - size / 2] * 2, indexing="ij")
    with path.open("wb") as file:
        for k in range(size):
            z = k - size / 2
            inside = np.sqrt(x**2 + y**2 + z**2) < 0.42 * size
            lumps = 18000 + 6000 * np.sin(x / 19) * np.sin(y / 23) * np.sin(z / 29)
            bent = x + 6 * np.sin(z / 31)
            aside = np.hypot(bent % _PERIOD_VOXELS - _PERIOD_VOXELS / 2, y % _PERIOD_VOXELS - _PERIOD_VOXELS / 2)
            values = np.where(inside, np.where(aside < 1.2, 52000.0, lumps), 3000.0)
            noisy = values + generator.normal(scale=900.0, size=values.shape)
            file.write(np.clip(noisy, 0, 65535).astype("<u2").tobytes())


def _built(scene: Path, package: Path) -> BuildCost:
    command = [Path(sys.executable).with_name("volprep"), "build", str(scene), "-o", str(package), "--force", "--quiet"]
    before, began = os.times(), time.perf_counter()
    subprocess.run(command, check=True)
    after = os.times()
    processor_s = after.children_user + after.children_system - before.children_user - before.children_system
    return BuildCost(time.perf_counter() - began, processor_s)


if __name__ == "__main__":
    main()
