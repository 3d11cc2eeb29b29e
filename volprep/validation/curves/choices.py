"""Every choice that has a curve: one entry of a list for each. A new choice is one more entry.

A variant is the scene with some keys changed. What a package has of a choice is read from its manifest, for variants
and for the package on trial alike, so that no name stands here twice.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import get_args

from volprep.compositing import COMPOSITINGS
from volprep.parts.compression.decision import FORMATS
from volprep.scene.scene import Scene
from volprep.validation.altered import with_common_tables
from volprep.validation.curves.records import Cost
from volprep.validation.variants import Changes
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.normals.record import GradientKernel, NormalCode
from volprep_formats.package.parts.proxy.record import ProxyForm
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.program import NormalsFrom
from volprep_formats.package.reader import Package

_ALONE: Changes = {"pyramid": {"coarsest_longest_axis": 100_000}}
"""No coarser levels: they take most of the time of a build."""
_LEVELS = 3
_STEPS = (4.0, 2.0, 1.0, 0.5, 0.25)
_FILTERS = (
    "box",
    "two-step-bilinear",
    "binomial",
    "gaussian",
    "lanczos3",
    "median",
    "feature-preserving",
    "least-squares",
    "appearance",
)
_CUTOFFS = (0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.9995, 0.9999)
_BLOCKS = (2, 4, 8, 16)
_TABLES = ("lookup", "preintegrated")
"""Classifications with tables, of which a level may have its own."""


@dataclass(frozen=True)
class Variant:
    """One way to make and to draw a package."""

    wanted: str
    """What is wanted, for people, where it cannot be had."""
    changes: Changes = field(default_factory=dict)
    """What differs from the scene."""
    level: int = 0
    """Level that is drawn."""
    steps: tuple[float, ...] = (1.0,)
    """Steps, as multiples of the one that the package has for this level."""
    altered: Callable[[Package], Package] | None = None
    """What is done to the package, where no key of a scene makes the variant."""


@dataclass(frozen=True)
class Choice:
    """One thing that is chosen."""

    name: str
    """What it is."""
    question: str
    """What its curve answers."""
    cost: Cost
    """What its variants cost."""
    variants: Callable[[Scene], Sequence[Variant]]
    """Its variants, for a scene; none where it does not come up."""
    named: Callable[[Manifest], str]
    """What a package has of it."""
    item: Callable[[Manifest], str]
    """How the name of the item begins that says in the plan why the package has it."""
    whatever_it_costs: bool = False
    """Whether variants are made that the plan would refuse for their error: the tolerance is wide, step and bits are
    those of the scene."""
    compared_at: int = 0
    """Level at which variants are compared with the package on trial."""
    absent: str = "the scene does not have it"
    """Why there may be no variants."""


def _classifications(scene: Scene) -> list[Variant]:
    names = sorted(COMPOSITINGS[scene.render.compositing].classifications)
    return [
        Variant(
            name if level == 0 else f"{name} at level {level}",
            {"render": {"classification": name}, **(_ALONE if level == 0 else {})},
            level,
            _STEPS[1:4],
        )
        for name in names
        for level in (0, 1)
    ]


def _normals(scene: Scene) -> list[Variant]:
    if scene.render.lighting == "none":
        return []
    return [
        Variant(f"{kernel}, {code}", {"normals": {"kernel": kernel, "code": code}, **_ALONE})
        for kernel in get_args(GradientKernel)
        for code in get_args(NormalCode)
    ]


def _gradients(scene: Scene) -> list[Variant]:
    if scene.render.lighting == "none":
        return []
    return [
        Variant(name, {"normals": scene.normals if name == "volume" else None, "lighting": {"normals": name}, **_ALONE})
        for name in get_args(NormalsFrom)
    ]


def _tables(scene: Scene) -> list[Variant]:
    compositing = COMPOSITINGS[scene.render.compositing]
    if scene.source.labels or compositing.level_filter or scene.render.classification not in _TABLES:
        return []
    return [
        Variant(f"{tables}, {name}", {"render": {"classification": tables}}, level, (2.0, 1.0), altered)
        for tables in _TABLES
        for level in (1, 2)
        for name, altered in (("own table", None), ("common table", with_common_tables))
    ]


def _skips(scene: Scene) -> list[Variant]:
    kinds = [Variant(kind, {"skip": {"kind": kind}, **_ALONE}) for kind in ("none", *get_args(SkipKind))]
    blocks = [
        Variant(f"{kind}, blocks of {n}", {"skip": {"kind": kind, "block": n}, **_ALONE})
        for kind in get_args(SkipKind)
        for n in _BLOCKS
    ]
    return [] if scene.source.labels and scene.editable else [*kinds, *blocks]


def _proxies(_: Scene) -> list[Variant]:
    forms = [Variant(form, {"proxy": {"form": form}, **_ALONE}) for form in get_args(ProxyForm)]
    return [Variant("none", {"proxy": None, **_ALONE}), *forms]


def _filters(scene: Scene) -> list[Variant]:
    if scene.source.labels or scene.render.classification == "preclassified":
        return []
    return [Variant(name, {"pyramid": {"filter": name}}, 1) for name in _FILTERS]


def _compressions(scene: Scene) -> list[Variant]:
    forms = ("none", *FORMATS) if not scene.source.labels and scene.bricks is None else ()
    return [Variant(form, {"textures": {"compression": form}, **_ALONE}) for form in forms]


def _classification_name(manifest: Manifest) -> str:
    return manifest.programs[0].classification


def _skip_name(manifest: Manifest) -> str:
    tables = manifest.skipping.tables if manifest.skipping else ()
    return f"{tables[0].kind}, blocks of {tables[0].block}" if tables else "none"


def _proxy_name(manifest: Manifest) -> str:
    meshes = [mesh for mesh in (manifest.proxy.meshes if manifest.proxy else ()) if mesh.file is not None]
    return meshes[0].form if meshes else "none"


def _form_name(manifest: Manifest) -> str:
    kept = [form.format for form in manifest.compression if form.kept]
    return next((name for name, texels in FORMATS.items() if texels in kept), "none")


def _normals_name(manifest: Manifest) -> str:
    found = [texture.normals for texture in manifest.textures if texture.normals is not None]
    return f"{found[0].kernel}, {found[0].code}" if found else "none"


def _gradients_name(manifest: Manifest) -> str:
    return manifest.programs[0].normals_from if manifest.programs[0].lighting != "none" else "none"


def _tables_name(manifest: Manifest) -> str:
    own = any(each.role in {"transfer", "preintegrated"} and each.level is not None for each in manifest.textures)
    return f"{_classification_name(manifest)}, {'own' if own else 'common'} table"


def _filter_name(manifest: Manifest) -> str:
    return next((level.filter for level in manifest.levels if level.index == 1), "none")


def _bits_name(manifest: Manifest) -> str:
    return f"{manifest.quantization.bits} bits" if manifest.quantization else "none"


def _cutoff_name(manifest: Manifest) -> str:
    cutoff = None if manifest.render is None else manifest.render.opacity_cutoff
    return "rays run to their end" if cutoff is None else f"opacity {cutoff:g}"


CHOICES: tuple[Choice, ...] = (
    Choice(
        "step and level",
        "Is a coarser level, or a longer step, the better way to be faster?",
        "milliseconds",
        lambda _: [Variant(f"level {level}", {}, level, _STEPS) for level in range(_LEVELS)],
        lambda _: "",
        lambda _: "step of level",
    ),
    Choice(
        "classification",
        "How do values become colours, with how many samples?",
        "milliseconds",
        _classifications,
        _classification_name,
        lambda manifest: {"lookup": "lookup table", "preintegrated": "pre-integrated table", "palette": "palette"}.get(
            _classification_name(manifest), "voxels classified"
        ),
    ),
    Choice(
        "bits of a voxel",
        "What do 16 bits gain over 8?",
        "bytes",
        lambda _: [Variant(f"{bits} bits", {"quantize": {"bits": bits}, **_ALONE}) for bits in (8, 16)],
        _bits_name,
        lambda manifest: _bits_name(manifest).replace(" bits", "-bit values"),
    ),
    Choice(
        "compressed texels",
        "What does each texel format lose, and what does it save?",
        "bytes",
        _compressions,
        _form_name,
        lambda _: "compress",
        whatever_it_costs=True,
        absent="labels and bricks are not compressed",
    ),
    Choice(
        "normals",
        "Which kernel and which code do normals need?",
        "bytes",
        _normals,
        _normals_name,
        lambda _: "normals",
        absent="the scene has no lighting",
    ),
    Choice(
        "where normals come from",
        "Is a volume of normals worth its bytes, or may the shader take differences?",
        "milliseconds",
        _gradients,
        _gradients_name,
        lambda _: "normals",
        absent="the scene has no lighting",
    ),
    Choice(
        "tables of levels",
        "What does a table of its own gain a level?",
        "milliseconds",
        _tables,
        _tables_name,
        lambda _: "lookup table",
        absent="levels of this scene have no tables of their own",
        compared_at=1,
    ),
    Choice(
        "early ray termination",
        "At which opacity may a ray end?",
        "milliseconds",
        lambda _: [
            Variant(f"opacity {cutoff:g}", {"render": {"opacity_cutoff": cutoff}, **_ALONE})
            for cutoff in (*_CUTOFFS, 1.0)
        ],
        _cutoff_name,
        lambda _: "early ray termination",
    ),
    Choice(
        "empty-space skipping",
        "Which table, with which blocks, lets rays jump furthest?",
        "milliseconds",
        _skips,
        _skip_name,
        lambda _: "skip table",
    ),
    Choice(
        "proxy geometry",
        "Where should rays begin?",
        "milliseconds",
        _proxies,
        _proxy_name,
        lambda _: "proxy",
    ),
    Choice(
        "filter of levels",
        "Which filter makes the best level 1, and how long does that take?",
        "seconds",
        _filters,
        _filter_name,
        lambda _: "level 1",
        compared_at=1,
        absent="labels and classified voxels have filters of their own",
    ),
)
"""Every choice."""
