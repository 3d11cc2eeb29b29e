"""`python -m tests.strangers.beside`: first pictures of volprep beside those of NiiVue, out/strangers/beside.png.

Takes the scans that `make strangers` built and that NiiVue opens: single files, and DICOM series through dcm2niix. Both
programs draw what they show first in three dimensions. NiiVue comes from npm and runs in headless Chromium.
"""

import argparse
import base64
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

_ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(_ROOT / "tests" / "support"))

from browser import Browser  # noqa: E402 - found by the path above
from npm_package import npm_package  # noqa: E402
from web_server import WebServer  # noqa: E402

from .__main__ import Outcome, read_outcomes  # noqa: E402
from .corpus import Input, inputs  # noqa: E402
from .sheet import write_sheet  # noqa: E402

_VERSION = "0.69.0"
_SUFFIXES = (".nii", ".nii.gz", ".nrrd", ".mgz", ".mha")
_COLUMNS = 8
"""Four pairs in a row."""
_DRAW = """
const [url] = given;
document.body.innerHTML = "<canvas width=256 height=256 style='width:256px;height:256px'></canvas>";
const canvas = document.querySelector("canvas");
const viewer = new niivue.Niivue({ isResizeCanvas: false, show3Dcrosshair: false, loadingText: "" });
await viewer.attachToCanvas(canvas);
await viewer.loadVolumes([{ url }]);
viewer.setSliceType(viewer.sliceTypeRender);
await new Promise((resolve) => setTimeout(resolve, 300));
viewer.drawScene();
return canvas.toDataURL("image/png");
"""
_LOAD = """
const [url] = given;
await new Promise((resolve, reject) => {
  const script = document.createElement("script");
  Object.assign(script, { src: url, onload: resolve, onerror: () => reject(new Error("NiiVue does not load")) });
  document.head.append(script);
});
"""


def main() -> int:
    """Draw the first scans of the table, as many as are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=_ROOT / "out/strangers", help="folder of `make strangers`")
    parser.add_argument("--most", type=int, default=20, help="number of scans")
    asked = parser.parse_args()
    found = {(each.origin, each.name): each for each in inputs()}
    built = [each for each in read_outcomes(asked.out / "outcomes.jsonl") if each.picture and not each.option]
    with tempfile.TemporaryDirectory() as scratch:
        chosen = _chosen(built, found, Path(scratch), asked.most)
        pairs = _drawn(chosen, asked.out, Path(scratch))
    write_sheet(asked.out / "beside.png", pairs, _COLUMNS)
    print(f"{len(pairs) // 2} pairs, volprep on the left, NiiVue {_VERSION} on the right: {asked.out / 'beside.png'}")
    return 0


def _chosen(
    built: Sequence[Outcome], found: dict[tuple[str, str], Input], scratch: Path, most: int
) -> list[tuple[Outcome, Path]]:
    """Return outcomes, each with a file that NiiVue opens; one outcome of each kind of picture comes first."""
    chosen: list[tuple[Outcome, Path]] = []
    for number, outcome in enumerate(built):
        given = found.get((outcome.origin, outcome.name))
        if given is None or len(chosen) == most or ("orient48" in outcome.name and "AIL" not in outcome.name):
            continue
        if given.path.name.endswith(_SUFFIXES):
            chosen.append((outcome, given.path))
        elif given.path.is_dir():
            made = _converted(given.path, scratch / str(number))
            if made is not None:
                chosen.append((outcome, made))
    return chosen


def _converted(series: Path, folder: Path) -> Path | None:
    """Return the NIfTI file that dcm2niix makes of a series; None if it makes none."""
    program = shutil.which("dcm2niix")
    if program is None:
        return None
    folder.mkdir()
    subprocess.run([program, "-z", "n", "-f", "scan", "-o", folder, series], capture_output=True, check=False)
    return next(iter(sorted(folder.glob("*.nii"))), None)


def _drawn(chosen: Sequence[tuple[Outcome, Path]], out: Path, scratch: Path) -> list[tuple[str, Path]]:
    """Draw each with NiiVue. Return names and pictures, those of volprep first in each pair."""
    pairs: list[tuple[str, Path]] = []
    script = npm_package("@niivue/niivue", _VERSION) / "node_modules/@niivue/niivue/dist"
    served = {str(index): path.parent for index, (_, path) in enumerate(chosen)}
    with WebServer({"niivue": script} | served) as server, Browser(scratch / "profile") as browser:
        for index, (outcome, path) in enumerate(chosen):
            browser.open(f"{server.url}/page.html")
            browser.run(_LOAD, f"{server.url}/niivue/niivue.umd.js")
            data = browser.run(_DRAW, f"{server.url}/{index}/{path.name}", timeout=300.0)
            target = out / f"niivue-{index:02}.png"
            target.write_bytes(base64.b64decode(data.partition(",")[2]))
            pairs += [(outcome.name, out / str(outcome.picture)), ("NiiVue", target)]
            print(outcome.name, flush=True)
    return pairs


if __name__ == "__main__":
    sys.exit(main())
