"""List of every choice that has a curve, one entry per choice. A new choice is one more entry.

A variant is the scene with some keys changed. The value that a package has is read from its manifest, for variants and
for the package under test, so that no name is written twice.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import get_args

from volprep.compositing import COMPOSITINGS
from volprep.lab.curves.records import Cost
from volprep.parts.ablation import Changes
from volprep.parts.registry import PARTS
from volprep.plan.item_kinds import LEVEL, TABLES
from volprep.plan.records import LookupPlan, PreintegratedPlan
from volprep.scene.scene import FORMATS, Scene
from volprep.techniques import TECHNIQUES
from volprep.validation.comparison.altered import with_common_tables
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.normals.record import GradientKernel, NormalCode
from volprep_formats.package.parts.proxy.record import ProxyForm
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.program import ClassificationName, NormalsFrom, Sampling
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
_SIZES = (0.5, 1.0, 2.0, 4.0)
_SAMPLINGS: dict[Sampling, str] = {
    "texture3d": "3D texture",
    "mosaic": "mosaic",
    "bricks": "bricks",
    "subvolumes": "sub-volumes",
}
_BLOCKS = (2, 4, 8, 16)
_TABLES = ("lookup", "preintegrated")
"""Classifications with tables; a level may have its own."""
_KINDS = {item.name: item.kind for part in PARTS for item in part.ablations}
"""Kind of the item of the plan, by the name that its part gives it."""
_CLASSIFICATION_KINDS: dict[ClassificationName, str] = {
    "lookup": TABLES[LookupPlan],
    "preintegrated": TABLES[PreintegratedPlan],
    "palette": "palette",
    "control-points": "control-points",
    "preclassified": "classified-voxels",
}
"""Kind of the item of the plan, for each classification."""


@dataclass(frozen=True)
class Variant:
    """One way to make and to draw a package."""

    wanted: str
    """Description of the wanted value, for a variant that cannot be built."""
    changes: Changes = field(default_factory=dict)
    """Changes to the scene."""
    level: int = 0
    """Level that is drawn."""
    steps: tuple[float, ...] = (1.0,)
    """Steps, as multiples of the package's step for this level."""
    altered: Callable[[Package], Package] | None = None
    """Change to the package, if no key of a scene makes the variant."""
    profile: Changes | None = None
    """Changes to the profile."""
    size: float = 1.0
    """Width and height of the picture, relative to the report's."""
    named: str = ""
    """Name of the variant, if the package is the same; if empty, the package's value."""


@dataclass(frozen=True)
class Choice:
    """One thing that is chosen."""

    name: str
    """Description of the choice."""
    question: str
    """Question that its curve answers."""
    cost: Cost
    """Kind of cost of its variants."""
    variants: Callable[[Scene], Sequence[Variant]]
    """Its variants, for a scene; empty if the choice does not apply."""
    named: Callable[[Manifest], str]
    """Reads the value that a package has."""
    item: Callable[[Manifest], str]
    """Kind of the item of the plan that gives the reason."""
    whatever_it_costs: bool = False
    """Whether to make variants that the plan would refuse for their error: the tolerance is then wide, and step and
    bits are the scene's."""
    compared_at: int = 0
    """Level where variants are compared with the package under test."""
    absent: str = "the scene does not have it"
    """Possible reason for having no variants."""


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


def _techniques(_: Scene) -> list[Variant]:
    return [Variant(name, {"render": {"technique": name}, **_ALONE}, steps=_STEPS[1:4]) for name in TECHNIQUES]


def _layouts(_: Scene) -> list[Variant]:
    # Without a kept border, bricks and whole textures hold the same voxels.
    return [
        Variant("3D texture", {"bricks": None, **_ALONE}, steps=_STEPS[1:4]),
        Variant("bricks", {"bricks": {}, **_ALONE}, steps=_STEPS[1:4]),
        Variant("mosaic", {"bricks": None, **_ALONE}, steps=_STEPS[1:4], profile={"max_3d_texture_size": 0}),
    ]


def _sizes(_: Scene) -> list[Variant]:
    return [
        Variant(f"{size:g}× the pixels along an edge", _ALONE, steps=_STEPS[1:4], size=size, named=f"{size:g}× size")
        for size in _SIZES
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
    if scene.render.lighting == "none" or scene.source.labels:
        return []
    return [
        Variant(name, {"normals": scene.normals if name == "volume" else None, "lighting": {"normals": name}, **_ALONE})
        for name in get_args(NormalsFrom)
    ]


def _tables(scene: Scene) -> list[Variant]:
    compositing = COMPOSITINGS[scene.render.compositing]
    if scene.source.labels or compositing.level_filters or scene.render.decided_classification not in _TABLES:
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


def _tables_name(manifest: Manifest) -> str:
    own = any(table.level is not None for table in manifest.textures_of("transfer", "preintegrated"))
    return f"{_classification_name(manifest)}, {'own' if own else 'common'} table"


def _cutoff_name(manifest: Manifest) -> str:
    cutoff = manifest.opacity_cutoff
    return "rays run to their end" if cutoff is None else f"opacity {cutoff:g}"


CHOICES: tuple[Choice, ...] = (
    Choice(
        "step and level",
        "Is a coarser level, or a longer step, the better way to be faster?",
        "milliseconds",
        lambda _: [Variant(f"level {level}", {}, level, _STEPS) for level in range(_LEVELS)],
        lambda _: "",
        lambda _: "step",
    ),
    Choice(
        "classification",
        "How do values become colours, with how many samples?",
        "milliseconds",
        _classifications,
        _classification_name,
        lambda manifest: _CLASSIFICATION_KINDS[manifest.programs[0].classification],
    ),
    Choice(
        "technique",
        "How should a program go through the volume?",
        "milliseconds",
        _techniques,
        lambda manifest: manifest.programs[0].technique,
        lambda _: "shaders",
    ),
    Choice(
        "layout",
        "What does it cost to keep voxels in bricks, or in a mosaic?",
        "milliseconds",
        _layouts,
        lambda manifest: _SAMPLINGS[manifest.programs[0].sampling],
        lambda _: LEVEL,
    ),
    Choice(
        "picture size",
        "How do time and error change with the size of the picture?",
        "milliseconds",
        _sizes,
        lambda _: "1× size",
        lambda _: "",
    ),
    Choice(
        "bits of a voxel",
        "What do 16 bits gain over 8?",
        "bytes",
        lambda _: [Variant(f"{bits} bits", {"quantize": {"bits": bits}, **_ALONE}) for bits in (8, 16)],
        lambda manifest: f"{manifest.quantization.bits} bits" if manifest.quantization else "none",
        lambda _: _KINDS["16-bit values"],
    ),
    Choice(
        "compressed texels",
        "What does each texel format lose, and what does it save?",
        "bytes",
        _compressions,
        _form_name,
        lambda _: _KINDS["compressed texels"],
        whatever_it_costs=True,
        absent="labels and bricks are not compressed",
    ),
    Choice(
        "normals",
        "Which kernel and which code do normals need?",
        "bytes",
        _normals,
        _normals_name,
        lambda _: _KINDS["normals"],
        absent="the scene has no lighting",
    ),
    Choice(
        "where normals come from",
        "Is a volume of normals worth its bytes, or may the shader take differences?",
        "milliseconds",
        _gradients,
        lambda manifest: manifest.programs[0].normals_from if manifest.programs[0].lighting != "none" else "none",
        lambda _: _KINDS["normals"],
        absent="the scene has no lighting",
    ),
    Choice(
        "tables of levels",
        "What does a table of its own gain a level?",
        "milliseconds",
        _tables,
        _tables_name,
        lambda _: TABLES[LookupPlan],
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
        lambda _: _KINDS["early ray termination"],
    ),
    Choice(
        "empty-space skipping",
        "Which table, and which block size, lets rays jump furthest?",
        "milliseconds",
        _skips,
        _skip_name,
        lambda _: _KINDS["skip table"],
    ),
    Choice(
        "proxy geometry",
        "Where should rays begin?",
        "milliseconds",
        _proxies,
        _proxy_name,
        lambda _: _KINDS["proxy mesh"],
    ),
    Choice(
        "filter of levels",
        "Which filter makes the best level 1, and how long does that take?",
        "seconds",
        _filters,
        lambda manifest: next((level.filter for level in manifest.levels if level.index == 1), "none"),
        lambda _: "level-filter",
        compared_at=1,
        absent="labels and classified voxels have filters of their own",
    ),
)
"""Every choice."""
