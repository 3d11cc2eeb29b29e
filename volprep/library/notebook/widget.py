"""The widget: a package in a notebook, with traits that Python and the browser share.

`anywidget` runs it in JupyterLab, VS Code, Colab and marimo (https://anywidget.dev).
"""

import base64
import io
import re
import struct
import textwrap
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Self

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from pydantic import Field, ValidationError, model_validator

from volprep.truth.camera import STANDARD_VIEWS
from volprep.view.bundle import bundle
from volprep.view.site import PAGE, page_modules, page_style
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Vector
from volprep_formats.installation import how_to_add
from volprep_formats.javascript import stripped
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.record import Record, problems
from volprep_formats.runtime import runtime_modules

_LETTERS = 38
_LINE = 15
_MARGIN = 6
_MOST_PIXELS = 2**24
"""Most pixels of a preview that is shown. It may be of a package of anyone: 0.5 MB unpack to 500."""


def captioned(picture: bytes, words: str) -> bytes | None:
    """Return the PNG file of `picture` with `words` in lines below it: viewers show one form of an output, not two.

    None for a picture that is no PNG, damaged or too large.
    """
    if picture[:8] != b"\x89PNG\r\n\x1a\n" or len(picture) < 24:
        return None
    width, height = struct.unpack(">II", picture[16:24])
    if width * height > _MOST_PIXELS:
        return None
    try:
        shown = Image.open(io.BytesIO(picture), formats=["PNG"]).convert("RGB")
    except (OSError, SyntaxError, ValueError):  # as Pillow raises them for damaged files
        return None
    lines = textwrap.wrap(words, _LETTERS)
    sheet = Image.new("RGB", (shown.width, shown.height + len(lines) * _LINE + 2 * _MARGIN), "white")
    sheet.paste(shown)
    draw = ImageDraw.Draw(sheet)
    # Pillow's own font lacks ×.
    font = ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf", 11)
    for number, line in enumerate(lines):
        draw.text((_MARGIN, shown.height + _MARGIN + number * _LINE), line, fill="black", font=font)
    file = io.BytesIO()
    sheet.save(file, "PNG")
    return file.getvalue()


_ENTRY = "widget.js"
_CSS = """.volprep-slices { display: flex; gap: 2px; }
.volprep-slices .slice { display: block; flex: 1; height: 240px; }
.volprep-segments { max-height: 240px; overflow-y: auto; }
.volprep-segments label { display: block; }
"""


@cache
def widget_module() -> str:
    """Return the text of the module: the custom element with all that it imports, and `render` as default export."""
    modules = {f"runtime/{name}": text for name, text in runtime_modules().items()}
    modules |= {f"{PAGE}/{name}": text for name, text in page_modules().items()}
    modules[_ENTRY] = Path(__file__).with_name(_ENTRY).read_text(encoding="utf-8")
    return stripped(bundle(modules, _ENTRY, default="widget"))


@cache
def widget_style() -> str:
    """Return the rules of the page for slices, and the rules of their row and of the list of segments."""
    rules = re.findall(r"^\.slice[^{]*\{[^}]*\}\n", page_style(), re.MULTILINE)
    return "".join([*rules, _CSS])


try:
    import anywidget
    import traitlets
except ModuleNotFoundError as error:
    raise VolprepError("VP7090", module=error.name, how=how_to_add("notebook")) from error


class Sight(Record):
    """Direction of sight, and how large the volume is."""

    forward: Vector
    """Direction in which the viewer looks, in the patient's space (LPS)."""
    up: Vector
    """Up direction of the picture."""
    zoom: Annotated[float, Field(gt=0.0)] = 1.0
    """Size of the volume relative to the standard views."""

    @model_validator(mode="after")
    def _is_a_direction(self) -> Self:
        if not np.cross(self.forward, self.up).any():
            msg = "forward and up are parallel, or one of them is 0"
            raise ValueError(msg)
        return self


class VolumeWidget(anywidget.AnyWidget):
    """A package in a notebook. `volprep.show` makes one.

    Traits that both sides change: `view`, `camera`, `function`, `segments`, `clip`, and the flags of the tools. Assign
    to a trait to change the picture; use `observe` to follow what people do with it.
    """

    _esm = widget_module()
    _css = widget_style()

    package = traitlets.Bytes()
    """The package in its single-file form. The browser asks Python for it: the notebook holds no copy of the scan."""
    kept = traitlets.Bytes().tag(sync=True)
    """The package again if the state of the notebook keeps it, else nothing."""
    picture = traitlets.Bytes().tag(sync=True)
    """PNG file that is shown until the volume is drawn, and where it cannot be drawn."""
    view = traitlets.Enum(["", *STANDARD_VIEWS], "").tag(sync=True)
    """Name of a standard view; "" if the volume was turned by hand."""
    camera = traitlets.Dict(default_value=None, allow_none=True).tag(sync=True)
    """Direction of sight: `forward` and `up`, unit vectors in the patient's space (LPS), and `zoom`. It follows the
    picture; assign to it to turn the volume, and `view` becomes ""."""
    function = traitlets.Unicode("").tag(sync=True)
    """Name of the picture that is drawn, one of `functions`; "" for the first."""
    segments = traitlets.Dict({}).tag(sync=True)
    """Looks that differ from the package's, by the name of a segment: `visible`, `tint` (linear RGB) and `opacity`."""
    slices = traitlets.Bool(False).tag(sync=True)
    """Whether axial, coronal and sagittal slices with one crosshair are shown below the volume."""
    clip = traitlets.List(traitlets.Float(min=0.0, max=1.0), None, allow_none=True, minlen=6, maxlen=6).tag(sync=True)
    """Part of the box that is drawn, its low and its high corner (x, y, z) from 0 to 1; None for all of it."""
    points = traitlets.List(traitlets.Dict(), None, allow_none=True).tag(sync=True)
    """Points of an edited transfer function, with the keys of `functions`; None for the package's own. The package must
    be editable."""
    background = traitlets.Unicode("#000000").tag(sync=True)
    """Background colour, "#rrggbb"."""
    controls = traitlets.Bool(True).tag(sync=True)
    """Whether the volume can be turned and has a toolbar."""
    measuring = traitlets.Bool(False).tag(sync=True)
    """Whether clicks read out values and distances."""
    annotations = traitlets.Bool(False).tag(sync=True)
    """Whether letters of the patient's directions and a scale bar are drawn."""
    fidelity = traitlets.Bool(False).tag(sync=True)
    """Whether the known error of the picture is shown."""
    width = traitlets.Int(640, min=16).tag(sync=True)
    """Largest width on the page, in pixels; the height is three quarters of it."""
    label = traitlets.Unicode("The volume").tag(sync=True)
    """Name of the picture for screen readers, and text in place of it."""
    level = traitlets.Int(-1).tag(sync=True)
    """Level that is drawn; -1 until there is a picture. Set by the browser."""
    error = traitlets.Unicode("").tag(sync=True)
    """Message of the last error in the browser, with its code. Set by the browser."""

    def __init__(self, functions: dict[str, list[dict[str, Any]]], *, keep: bool = False, **traits: Any) -> None:
        """Use `volprep.show`."""
        super().__init__(**traits)
        self._keep = keep
        self.on_msg(self._answer)
        self.observe(self._give, "package")
        if keep:
            self.kept = self.package
        self.functions = functions
        """Points of each transfer function: value, colour (linear RGB), extinction_per_mm."""

    def _answer(self, _widget: object, content: object, _buffers: object) -> None:
        """Send the package to a browser that asks for it."""
        if content == {"wanted": "package"}:
            self.send({"given": "package"}, [self.package])

    def _give(self, _change: object) -> None:
        """Send another package."""
        if self._keep:
            self.kept = self.package
        else:
            self.send({"given": "package"}, [self.package])

    @traitlets.validate("camera")
    def _check_camera(self, proposal: dict[str, Any]) -> dict[str, Any] | None:
        if proposal["value"] is None:
            return None
        try:
            return Sight.model_validate(proposal["value"]).model_dump(mode="json")
        except ValidationError as error:
            raise traitlets.TraitError(f"camera: {problems(error)}") from error

    @traitlets.validate("background")
    def _check_background(self, proposal: dict[str, Any]) -> str:
        colour: str = proposal["value"]
        if not re.fullmatch(r"#[0-9A-Fa-f]{6}", colour):
            raise traitlets.TraitError(f"background: {colour!r} is not of the form #rrggbb")
        return colour

    @traitlets.validate("points")
    def _check_points(self, proposal: dict[str, Any]) -> list[dict[str, Any]] | None:
        points: list[dict[str, Any]] | None = proposal["value"]
        if points is None:
            return None
        try:
            checked = TransferFunction.model_validate({"name": "edited", "points": points})
        except ValidationError as error:
            raise traitlets.TraitError(f"points: {problems(error)}") from error
        return [point.model_dump(mode="json") for point in checked.points]

    def _repr_mimebundle_(self, **options: Any) -> tuple[dict[str, Any], dict[str, Any]] | None:
        """Return the live view, with a still picture and words for programs that do not run it."""
        found = super()._repr_mimebundle_(**options)
        data, metadata = ({}, {}) if found is None else found
        data = {**data, "text/plain": self.label}
        if self.picture and (picture := captioned(self.picture, self.label)):
            data["image/png"] = base64.b64encode(picture).decode()
            metadata = {**metadata, "image/png": {"alt": self.label}}
        return data, metadata
