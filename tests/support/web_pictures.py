"""Pictures that a page draws with formats/js, and those of the reference renderer, side by side."""

import base64
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from browser import Browser
from web_server import WebServer

from volprep.parts.editing.inputs import FunctionEdit
from volprep.render.renderers import renderer_of
from volprep.truth.camera import standard_views
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction

SIZE = 48
TWO_STEPS = 2 / 255
"""Root mean square of what pictures may differ by."""


@dataclass
class WebPictures:
    """What a page drew."""

    pictures: list[np.ndarray]
    """[H, W, 4] each, premultiplied linear, row 0 on top."""
    said: dict[str, Any] = field(default_factory=dict)
    """What the renderer says of itself."""


def box_from_clip_of(package: Package) -> list[np.ndarray]:
    """Return the matrices of the nine standard views."""
    grid, render = package.manifest.grid, package.manifest.render
    assert grid is not None
    assert render is not None
    return [camera.box_from_clip(grid, 1.0) for camera in standard_views(grid, render.projection).values()]


def drawn_in_page(browser: Browser, server: WebServer, path: Path, matrices: list[np.ndarray], **how: object) -> Any:
    """Return what the page draws of the package at `path`; `how` is what `pictures` of page.mjs takes."""
    server.folders["package"] = path.parent
    if not browser.run("return location.href").startswith(server.url):
        browser.open(f"{server.url}/")
    how["matrices"] = [matrix.T.ravel().tolist() for matrix in matrices]
    script = 'return (await import("/support/page.mjs")).pictures(...given)'
    said = browser.run(script, f"/package/{path.name}", how)
    texts = said.pop("pictures")
    pixels = [np.frombuffer(base64.b64decode(text), "<f4").reshape(SIZE, SIZE, 4) for text in texts]
    return WebPictures(pixels, said)


def drawn_by_reference(
    package: Package, matrices: list[np.ndarray], edit: TransferFunction | None = None, **what: Any
) -> list[np.ndarray]:
    """Return what the reference renderer draws, after an edit or without; `what` are the arguments of `renderer_of`."""
    with renderer_of(package, edit=edit and FunctionEdit(edit), **what) as renderer:
        return [renderer.render(matrix, (SIZE, SIZE)) for matrix in matrices]


def rmse(one: np.ndarray, other: np.ndarray) -> float:
    """Root mean square difference over pixels and channels."""
    return float(np.sqrt(np.mean((one.astype(np.float64) - other) ** 2)))
