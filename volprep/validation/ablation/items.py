"""What can be taken out of a package, or put into it: one entry of a list for each. A new item is one more entry.

Each says by which keys of a scene a package has it or not; whether a package has it is read from the manifest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from volprep.parts.programs.early_end import AUTO_CUTOFF
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep.techniques.record import Technique
from volprep.validation.variants import Changes
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.texture import Texture

_PLAIN = "ray-casting"

Gain = Literal["time", "memory", "truth", "wish"]
"""What keeping an item gains. time: pictures are drawn faster. memory: a device holds fewer bytes. truth: pictures are
nearer to the scan. wish: the scene asks for it, and without it the package is not what the scene says."""


@dataclass(frozen=True)
class Item:
    """One thing that a package may have or not."""

    name: str
    """What it is."""
    said_by: str
    """How the name of the item of the plan begins that says why."""
    gain: Callable[[Scene], Gain]
    """What it gains where it is kept."""
    has: Callable[[Manifest, str], bool | None]
    """Whether a package has it, for this transfer function; None where the question does not come up."""
    without: Changes
    """Keys of a scene that does not have it."""
    added: Callable[[Scene], Changes | None]
    """Keys of a scene that has it; None where no scene can have it that does not already."""
    chosen_by: Callable[[Scene], Literal["plan", "scene"]] = lambda _: "plan"
    """Who decides about it."""
    for_each_transfer: bool = False
    """Whether it is decided for each transfer function."""
    lossy: bool = False
    """Whether it trades accuracy: then the root mean square of a view's change counts, and else the largest one."""
    with_everything: bool = False
    """Whether the package with everything has it; of layouts that exclude each other none does."""


def _lit(scene: Scene) -> bool:
    return scene.render.lighting != "none"


def _time_or_wish(scene: Scene) -> Gain:
    """What may save nothing now, but will when users have edited their functions, is kept because the scene asks."""
    return "wish" if scene.editable else "time"


def _has_border(manifest: Manifest, _: str) -> bool | None:
    said = any(item.name == "empty border" for item in manifest.plan)
    return (
        manifest.grid is not None and manifest.grid.shape_zyx == manifest.source.info.grid.shape_zyx if said else None
    )


def _has_wide_codes(manifest: Manifest, _: str) -> bool | None:
    labels = any(texture.filter == "nearest" for texture in _volumes(manifest))
    return None if labels or manifest.quantization is None else manifest.quantization.bits == 16


def _has_skip_table(manifest: Manifest, transfer: str) -> bool:
    tables = manifest.skipping.tables if manifest.skipping is not None else ()
    return any(table.transfer == transfer for table in tables)


def _has_mesh(manifest: Manifest, transfer: str) -> bool:
    meshes = manifest.proxy.meshes if manifest.proxy is not None else ()
    return any(mesh.transfer == transfer for mesh in meshes)


def _has_ranges(manifest: Manifest, _: str) -> bool:
    return manifest.skipping is not None and bool(manifest.skipping.ranges)


def _has_early_end(manifest: Manifest, _: str) -> bool | None:
    said = any(item.name == "early ray termination" for item in manifest.plan)
    return manifest.render is not None and manifest.render.opacity_cutoff is not None if said else None


def _has_preintegrated(manifest: Manifest, _: str) -> bool | None:
    names = {program.classification for program in manifest.programs}
    return "preintegrated" in names if names <= {"lookup", "preintegrated"} else None


def _has_shadows(manifest: Manifest, _: str) -> bool | None:
    return any(each.light is not None and each.light.shadows != "none" for each in manifest.programs) or None


def _finds_the_same(technique: Technique) -> bool:
    """Return whether a technique takes the samples of ray casting, in another order or in several draws."""
    return technique.loops and technique.order is None and technique.name != _PLAIN


def _drawn_by(technique: Technique) -> Item:
    """Return the item of a technique in place of plain ray casting: an app asks for it, to show frames in between."""
    return Item(
        f"technique {technique.name}",
        f"technique {technique.name}",
        lambda _: "wish",
        lambda manifest, _: any(each.technique == technique.name for each in manifest.programs),
        without={"render": {"technique": _PLAIN}},
        added=lambda _: {"render": {"technique": technique.name}},
        chosen_by=lambda _: "scene",
        lossy=True,
    )


def _volumes(manifest: Manifest) -> list[Texture]:
    return [texture for texture in manifest.textures if texture.role == "volume"]


ITEMS: tuple[Item, ...] = (
    Item(
        "empty border",
        "empty border",
        lambda _: "wish",
        _has_border,
        without={"crop": "auto"},
        added=lambda _: {"crop": "none"},
        with_everything=True,
    ),
    Item(
        "16-bit values",
        "16-bit values",
        lambda scene: "wish" if scene.quantize.bits == 16 else "truth",
        _has_wide_codes,
        without={"quantize": {"bits": 8}},
        added=lambda _: {"quantize": {"bits": 16}},
        chosen_by=lambda scene: "plan" if scene.quantize.bits == "auto" else "scene",
        lossy=True,
        with_everything=True,
    ),
    Item(
        "skip table",
        "skip table",
        _time_or_wish,
        _has_skip_table,
        without={"skip": {"kind": "none"}},
        added=lambda _: {"skip": {"kind": "distance"}},
        chosen_by=lambda scene: "plan" if scene.skip.kind == "auto" else "scene",
        for_each_transfer=True,
        with_everything=True,
    ),
    Item(
        "ranges of blocks",
        "ranges of blocks",
        lambda _: "wish",
        _has_ranges,
        without={"skip": {"ranges": False}, "editable": False},
        added=lambda scene: None if scene.editable else {"skip": {"ranges": True}},
        chosen_by=lambda _: "scene",
        with_everything=True,
    ),
    Item(
        "proxy mesh",
        "proxy geometry",
        lambda _: "time",
        _has_mesh,
        without={"proxy": None},
        added=lambda scene: None if scene.editable else {"proxy": {"form": "merged"}},
        chosen_by=lambda scene: "scene" if scene.proxy is None else "plan",
        for_each_transfer=True,
        with_everything=True,
    ),
    Item(
        "early ray termination",
        "early ray termination",
        _time_or_wish,
        _has_early_end,
        without={"render": {"opacity_cutoff": 1.0}},
        added=lambda _: {"render": {"opacity_cutoff": AUTO_CUTOFF}},
        chosen_by=lambda scene: "plan" if scene.render.opacity_cutoff == "auto" else "scene",
        lossy=True,
        with_everything=True,
    ),
    Item(
        "normals",
        "normals",
        lambda scene: "time" if _lit(scene) else "wish",
        lambda manifest, _: any(texture.role == "normals" for texture in manifest.textures),
        without={"normals": None, "lighting": {"normals": "central"}},
        added=lambda scene: {"lighting": {"normals": "volume"}} if _lit(scene) else {"normals": {"magnitude": True}},
        chosen_by=lambda _: "scene",
        lossy=True,
        with_everything=True,
    ),
    Item(
        "pre-integrated table",
        "pre-integrated table",
        lambda _: "truth",
        _has_preintegrated,
        without={"render": {"classification": "lookup"}},
        added=lambda scene: None if scene.editable else {"render": {"classification": "preintegrated"}},
        chosen_by=lambda _: "scene",
        lossy=True,
    ),
    Item(
        "bricks",
        "bricks",
        lambda _: "memory",
        lambda manifest, _: any(texture.bricks is not None for texture in _volumes(manifest)),
        without={"bricks": None},
        added=lambda _: {"bricks": {}},
        chosen_by=lambda _: "scene",
    ),
    Item(
        "mipmaps",
        "mipmaps",
        lambda _: "wish",
        lambda manifest, _: any(texture.mipmap is not None for texture in _volumes(manifest)),
        without={"textures": {"mipmaps": False}},
        added=lambda _: {"textures": {"mipmaps": True}},
        chosen_by=lambda _: "scene",
    ),
    Item(
        "compressed texels",
        "compress",
        lambda _: "memory",
        lambda manifest, _: any(form.kept for form in manifest.compression),
        without={"textures": {"compression": "none"}},
        added=lambda _: {"textures": {"compression": "auto"}},
        chosen_by=lambda scene: "plan" if scene.textures.compression == "auto" else "scene",
        lossy=True,
    ),
    Item(
        "sub-volumes",
        "sub-volumes",
        lambda _: "wish",
        lambda manifest, _: manifest.subvolumes is not None,
        without={"grid": None},
        added=lambda _: {"grid": {"size": 64}},
        chosen_by=lambda scene: "plan" if scene.grid is not None and scene.grid.size == "auto" else "scene",
        with_everything=True,
    ),
    Item(
        "what edits need",
        "joint histograms",
        lambda _: "wish",
        lambda manifest, _: manifest.editing is not None,
        without={"editable": False},
        # No filter may rest on a transfer function.
        added=lambda _: {"editable": True, "pyramid": {"filter": "box"}},
        chosen_by=lambda _: "scene",
        lossy=True,
    ),
    Item(
        "shadows",
        "shadows",
        lambda _: "wish",
        _has_shadows,
        without={"lighting": {"shadows": "none"}},
        # With them it is another picture.
        added=lambda _: None,
        chosen_by=lambda _: "scene",
    ),
    *(_drawn_by(technique) for technique in TECHNIQUES.values() if _finds_the_same(technique)),
)
"""Every item that keys of a scene bring or take away. Levels, their own tables, and what no program can draw without
are taken out of the package itself."""
