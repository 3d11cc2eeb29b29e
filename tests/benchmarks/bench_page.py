"""How soon the page of volprep view shows something of a package of 512³ voxels, at 10 Mbit/s, in a browser.

Everything comes over the network that the browser slows down: the page, its modules, the manifest, shaders and the
coarsest level. The machine draws in software, as Chromium does without a GPU.
"""

import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from volprep.pipeline.build import build
from volprep.scene.request import load_request
from volprep.view.server import ViewServer
from volprep.view.site import make_site, shown_with
from volprep_formats.package.digest import manifest_sha256
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

SIDE = 512
MBIT_S = 10.0
_RUNS = 3
_SCENE = """name = "large"
profile = "gles3"
[source]
path = "large.raw"
[source.raw]
shape_zyx = [{n}, {n}, {n}]
dtype = "uint8"
[render]
step_voxels = 1.0
[pyramid]
filter = "box"
[[transfer]]
name = "ball"
points = [
    {{ value = 60.0, colour = "#804020", extinction_per_mm = 0.0 }},
    {{ value = 250.0, colour = "#ffffff", extinction_per_mm = 0.2 }},
]
"""


@dataclass(frozen=True)
class PageRow:
    """One package, opened several times."""

    package_bytes: int
    """Size of the package."""
    first_picture_s: float
    """Median of the seconds from the request of the page to something in the middle of its picture."""
    slowest_s: float
    """The longest."""


def measure_page(console: Console) -> Iterator[PageRow]:
    """Build the package and open its page; nothing where there is no Chromium."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
    from browser import Browser
    from first_picture import first_picture

    with tempfile.TemporaryDirectory() as folder:
        package = _package(Path(folder))
        console.print("measuring the page", style="dim")
        site = make_site(shown_with(package, None, Path(folder) / "none"), takes_devices=False)
        times = []
        with ViewServer(site, manifest_sha256(package)) as server, Browser(Path(folder) / "profile") as browser:
            thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
            thread.start()
            for _ in range(_RUNS):
                times.append(first_picture(browser, server.url, MBIT_S)["ms"] / 1e3)
                browser.open("about:blank")
            server.shutdown()
            thread.join()
        size = sum(record.size_bytes for record in Package.open(package).manifest.files)
        yield PageRow(size, float(np.median(times)), max(times))


def page_table(rows: list[PageRow]) -> Table:
    """Show them."""
    table = Table("page", "package MB", f"first picture at {MBIT_S:.0f} Mbit/s, s", "slowest s")
    for row in rows:
        size = f"{row.package_bytes / 1e6:.0f}"
        table.add_row(f"{SIDE}³", size, f"{row.first_picture_s:.2f}", f"{row.slowest_s:.2f}")
    return table


def _package(folder: Path) -> Path:
    y, x = (each - SIDE / 2 for each in np.ogrid[:SIDE, :SIDE])
    with (folder / "large.raw").open("wb") as file:
        for z in range(SIDE):
            radius = np.sqrt(x**2 + y**2 + (z - SIDE / 2) ** 2)
            file.write(np.clip(255 - radius + 20 * np.sin(radius / 9), 0, 255).astype("u1").tobytes())
    (folder / "large.toml").write_text(_SCENE.format(n=SIDE))
    build(load_request(folder / "large.toml"), folder / "large.volpkg", Silent())
    return folder / "large.volpkg"
