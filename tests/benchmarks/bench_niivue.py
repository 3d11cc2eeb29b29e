"""Coarse levels of a package against box means, drawn by an unmodified foreign viewer: niivue in headless Chromium.

    volprep export PACKAGE scan.ome.zarr
    python -m tests.benchmarks.bench_niivue PACKAGE scan.ome.zarr SHEET.png

niivue, from npm, draws level 0, coarse levels of the store and box means of level 0 at the same places with the
package's first transfer function as a colour map. Printed is the RMSE of RGB to its own picture of level 0 over the
pixels in which one of the two shows something; the sheet has the pictures side by side.
"""

import base64
import functools
import http.server
import json
import math
import shutil
import sys
import tempfile
import threading
from pathlib import Path

import nibabel
import numpy as np
import OpenImageIO
import zarr

from tests.benchmarks.bench_foreign_levels import box_mean
from tests.support.browser import Browser
from tests.support.npm_package import npm_package
from volprep_formats.package.reader import Package
from volprep_formats.srgb import srgb_of_linear

VERSION = "0.57.0"
SIZE = 384
VIEWS = ((0, 0), (90, 0), (135, 25), (220, -15), (0, 90))
"""Azimuth and elevation in degrees."""
SEEN = 0.5 / 255
PAGE = f"""<!doctype html><body style="margin:0"><canvas id="c" width="{SIZE}" height="{SIZE}"></canvas>
<script src="niivue.umd.js"></script>"""
DRAW = """
const [url, map, low, high, azimuth, elevation] = given;
if (!window.nv) {
  const plain = { show3Dcrosshair: false, isOrientCube: false, isColorbar: false, isAntiAlias: false };
  window.nv = new niivue.Niivue({ ...plain, backColor: [0, 0, 0, 1], isResizeCanvas: false });
  await nv.attachToCanvas(document.getElementById("c"));
  nv.addColormap("function", map);
}
if (window.shown !== url) await nv.loadVolumes([{ url, colormap: "function", cal_min: low, cal_max: high }]);
window.shown = url;
nv.setSliceType(nv.sliceTypeRender);
await nv.setVolumeRenderIllumination(0);
nv.setRenderAzimuthElevation(azimuth, elevation);
nv.drawScene();
const pixels = new Uint8Array(4 * nv.gl.drawingBufferWidth * nv.gl.drawingBufferHeight);
nv.gl.readPixels(0, 0, nv.gl.drawingBufferWidth, nv.gl.drawingBufferHeight, nv.gl.RGBA, nv.gl.UNSIGNED_BYTE, pixels);
let text = "";
for (let at = 0; at < pixels.length; at += 32768) text += String.fromCharCode(...pixels.subarray(at, at + 32768));
return btoa(text);
"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_words):
        pass


def colour_map(function):
    """The transfer function as niivue takes it: sRGB, opacity of a millimetre, places from 0 to 255 in the window."""
    low, high = function.points[0].value, function.points[-1].value
    rows = [
        (
            *(255 * np.asarray(srgb_of_linear(np.array(point.colour)))),
            255 * (1 - math.exp(-point.extinction_per_mm)),
            255 * (point.value - low) / (high - low),
        )
        for point in function.points
    ]
    return {name: [round(float(row[index])) for row in rows] for index, name in enumerate("RGBAI")}, low, high


def write_volume(path, values, scale, translation):
    affine = np.diag([*scale[::-1], 1.0])
    affine[:3, 3] = translation[::-1]
    nibabel.save(nibabel.Nifti1Image(np.ascontiguousarray(values.T.astype(np.float32)), affine), path)


def write_volumes(store, folder):
    """Write each level, and box means of level 0 at its places; give pairs of file names."""
    group = zarr.open_group(store, mode="r")
    levels = []
    for told in group.attrs["ome"]["multiscales"][0]["datasets"]:
        scale, translation = told["coordinateTransformations"]
        levels.append((told["path"], group[told["path"]][...], scale["scale"], translation["translation"]))
    _, finest, spacing, _ = levels[0]
    for number, values, scale, translation in levels:
        factors = [round(a / b) for a, b in zip(scale, spacing, strict=True)]
        write_volume(folder / f"package-{number}.nii", values, scale, translation)
        write_volume(folder / f"box-{number}.nii", box_mean(finest, factors), scale, translation)
    return [number for number, *_ in levels]


def drawn(browser, name, colours):
    shots = []
    for view in VIEWS:
        text = browser.run(DRAW, f"{name}.nii", *colours, *view, timeout=300)
        shots.append(np.frombuffer(base64.b64decode(text), np.uint8).reshape(SIZE, SIZE, 4)[::-1, :, :3])
    return shots


def rmse(found, expected):
    one, other = found / 255.0, expected / 255.0
    seen = np.maximum(one, other).max(axis=-1) > SEEN
    return math.sqrt(np.mean((one - other)[seen] ** 2))


def write_sheet(path, columns):
    sheet = np.ascontiguousarray(np.hstack([np.vstack(shots) for shots in columns]))
    output = OpenImageIO.ImageOutput.create(path)
    output.open(path, OpenImageIO.ImageSpec(sheet.shape[1], sheet.shape[0], 3, "uint8"))
    output.write_image(sheet)
    output.close()


def main(package, store, sheet):
    colours = colour_map(Package.open(Path(package)).manifest.transfer_functions[0])
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        script = npm_package("@niivue/niivue", VERSION) / "node_modules" / "@niivue" / "niivue" / "dist"
        shutil.copy(script / "niivue.umd.js", folder)
        (folder / "index.html").write_text(PAGE, encoding="utf-8")
        numbers = write_volumes(store, folder)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with Browser(folder / "profile") as browser:
            screen = {"width": SIZE, "height": SIZE, "deviceScaleFactor": 1, "mobile": False}
            browser.open(f"http://127.0.0.1:{server.server_port}/index.html", screen)
            truth = drawn(browser, f"package-{numbers[0]}", colours)
            columns = [truth]
            for number in numbers[1:]:
                for kind in ("package", "box"):
                    shots = drawn(browser, f"{kind}-{number}", colours)
                    columns.append(shots)
                    errors = [rmse(*pair) for pair in zip(shots, truth, strict=True)]
                    print(json.dumps({"level": number, "voxels": kind, "rmse": [round(each, 4) for each in errors]}))
        server.shutdown()
        write_sheet(sheet, columns)


if __name__ == "__main__":
    main(*sys.argv[1:])
