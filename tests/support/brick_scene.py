"""A small scene with bricks on demand, and a page that draws its package."""

import base64

import numpy as np
from browser import Browser
from web_server import WebServer

PIXELS = 64
TRANSFER = """
[pyramid]
filter = "box"
coarsest_longest_axis = 20
[[transfer]]
name = "skin"
points = [
    { value = 40.0, colour = "#c07050", extinction_per_mm = 0.0 },
    { value = 120.0, colour = "#ffc0a0", extinction_per_mm = 0.1 },
    { value = 220.0, colour = "#4060ff", extinction_per_mm = 0.6 },
]
"""
ON_DEMAND = "[on_demand]\nsize = 8\n"
DRAW = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const { drawOnDemand } = await import("/js/on_demand.js");
const { toBase64 } = await import("/support/page.mjs");
const gl = new OffscreenCanvas(64, 64).getContext("webgl2");
const pack = await openPackage(given[0]);
const renderer = await createRenderer(gl, pack, { level: 2 });
const failed = [];
const bricks = await drawOnDemand(renderer, { target: 0, onError: (error) => failed.push(error.message), ...given[2] });
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const rest = async (boxFromClip) => {
  renderer.draw({ boxFromClip });
  const seen = [];
  for (let still = 0; still < 4; ) {
    await wait(100);
    const now = JSON.stringify(bricks.state);
    if (now === seen[seen.length - 1]) still++;
    else [still] = [0, seen.push(now)];
    renderer.draw({ boxFromClip });
  }
  return { ...bricks.state, bounds: seen.map((each) => JSON.parse(each).bound),
    picture: toBase64(renderer.readPixels().pixels), error: gl.getError() };
};
const found = [];
let said = null;
for (const matrix of given[1]) found.push(await rest(matrix));
THEN
bricks.dispose();
renderer.dispose();
pack.close();
return { found, failed, said };
"""


def voxels(shape: tuple[int, int, int] = (37, 30, 43)) -> np.ndarray:
    """Return blobs, a thin rod and noise: some bricks are empty, some lose much in a coarser level."""
    rng = np.random.default_rng(5)
    z, y, x = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    volume = np.zeros(shape)
    for centre, radius, value in (((12, 10, 12), 8, 150), ((26, 20, 30), 7, 220)):
        inside = sum((a - c) ** 2 for a, c in zip((z, y, x), centre, strict=True)) < radius**2
        volume[inside] = value + 30 * rng.standard_normal(shape)[inside]
    volume[18, 4:28, 21] = 250
    return np.clip(volume, 0, 255).astype(np.uint8)


def drawn(
    browser: Browser, server: WebServer, address: str, matrices: list[np.ndarray], then: str = "", **options: object
) -> dict:
    """Draw a package at rest with each camera, and run more of the page's script, which may set `said`."""
    browser.open(f"{server.url}/")
    columns = [matrix.T.ravel().tolist() for matrix in matrices]
    found = browser.run(DRAW.replace("THEN", then), address, columns, options, timeout=60)
    for each in found["found"]:
        each["picture"] = np.frombuffer(base64.b64decode(each["picture"]), "<f4").reshape(PIXELS, PIXELS, 4)
    return found
