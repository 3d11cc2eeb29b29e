"""Decide which channels are drawn into one picture, and their textures. Channels that show nothing are left out.

The light of several media in one place is the sum of what each emits, behind the sum of what all absorb (Max 1995): the
integral of sum(c_i tau_i) exp(-integral of sum(tau_i)). So no channel lies in front of another, and their order is
nothing.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

from volprep.parts.programs.decision import ray_casters, shader_files
from volprep.parts.skip.decision import KIND as SKIP_KIND
from volprep.parts.skip.decision import SkipInputs, skip_together
from volprep.parts.texture.mipmaps import chain_bytes
from volprep.parts.together.grids import Grids
from volprep.plan.decisions import Packed
from volprep.plan.item_kinds import BEYOND
from volprep.plan.products import SkipPlan, SkipTablePlan, TogetherPlan
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.textures.texel_formats import size_bytes

KIND = "together"
"""Kind of the items of a picture of several channels."""
_FLIP_OF_LINEAR = 0.05
"""FLIP up to which rounding of linear light may change a dark picture; 0.033 was seen."""
_EXACT = 4096
"""Number of entries used for a function that has no table."""


@dataclass(frozen=True)
class DrawnTogether:
    """The channels of a picture that show something."""

    transfers: dict[str, str]
    """Name of the transfer function of each channel, in the order of the scene."""
    items: tuple[PlanItem, ...]
    """The channels that were left out."""


def choose_together(plans: Sequence[ChannelPlan], measured: Sequence[Measured], scene: Scene) -> DrawnTogether:
    """Choose the channels of the picture that the scene wants; none where fewer than two show something.

    Raises VP1245 for channels that cannot be drawn together.
    """
    if scene.together is None:
        return DrawnTogether({}, ())
    names = scene.together.transfers or tuple(plan.transfer_functions[0].name for plan in plans)
    seen: dict[str, str] = {}
    items: list[PlanItem] = []
    for name in names:
        pairs = zip(plans, measured, strict=True)
        plan, found = next((plan, value) for plan, value in pairs if name in plan.transfers)
        if plan.channel in seen:
            _refuse(scene, f"{seen[plan.channel]} and {name} both draw channel {plan.channel}")
        function = plan.function(name)
        low, high = found.statistics.minimum, found.statistics.maximum
        if scene.colour is not None or Table.exact(function).largest_extinction(low, high) > 0:
            seen[plan.channel] = name
            continue
        reason = f"{name} shows none of its values, {low:g} to {high:g}"
        items.append(
            PlanItem(name=f"{scene.together.name}: channel {plan.channel}", kind=KIND, kept=False, reason=reason)
        )
    if len(seen) < 2:
        shown = ", ".join(seen.values()) or "none"
        reason = f"fewer than two channels show something: {shown}"
        return DrawnTogether({}, (*items, PlanItem(name=scene.together.name, kind=KIND, kept=False, reason=reason)))
    obstacle = next(_obstacles([plan for plan in plans if plan.channel in seen], scene), None)
    if obstacle is not None:
        _refuse(scene, obstacle)
    return DrawnTogether(seen, tuple(items))


def plan_together(
    plans: Sequence[ChannelPlan],
    measured: Sequence[Measured],
    drawn: DrawnTogether,
    packed: Packed,
    scene: Scene,
    *,
    grids: Grids | None,
) -> tuple[TogetherPlan | None, tuple[PlanItem, ...]]:
    """Return the programs of the picture, if there is one, and the decisions.

    `packed` says whether its channels share texels, `grids` where they lie if that is on several grids. Raises VP1245
    where the profile cannot hold them at one time.
    """
    if not drawn.transfers or scene.together is None:
        return None, drawn.items
    name = scene.together.name
    group = [plan for plan in plans if plan.channel in drawn.transfers]
    shares = bool(packed.volumes)
    if not shares and scene.colour is not None:
        _refuse(scene, f"light and extinction of a colour must share texels, but {packed.reason}")
    if not shares and group[0].volumes[0].mosaic is not None:
        _refuse(scene, f"mosaics are fetched once for all channels, which must share texels, but {packed.reason}")
    common = set.intersection(*({volume.level for volume in plan.volumes} for plan in group))
    levels = [volume for volume in group[0].volumes if volume.level in common and _fits(group, volume.level)]
    if not levels:
        profile = group[0].profile
        limit = f"{profile.texture_units} textures and {profile.max_texture_bytes} bytes"
        _refuse(scene, f"no level leaves enough {limit} of profile {profile.name} for all channels")
    programs = tuple(ray_casters(name, levels, scene))
    # Shaders that channels share with the picture are items of the channels.
    named = {path for plan in group for program in plan.programs for path in shader_files(program)}
    fetches = f"{'one fetch' if shares else f'{len(group)} fetches'} of values, and {len(group)} of colours"
    if scene.colour is not None:
        fetches = "one fetch, of light and extinction"
    if grids is not None:
        fetches += f"; {grids.text}"
    item = PlanItem(
        name=name,
        kind=KIND,
        transfer=name,
        kept=True,
        reason=f"the scene wants {', '.join(drawn.transfers.values())} in one picture; a sample takes {fetches}",
        files=tuple(dict.fromkeys(path for program in programs for path in shader_files(program) if path not in named)),
    )
    drawable = [level for level in group[0].levels if level.index in {volume.level for volume in levels}]
    founds = {plan.channel: _found(plan, measured, scene) for plan, measured in zip(plans, measured, strict=True)}
    if grids is None:
        tables, skipping = _skipping(group, founds, drawn, drawable, scene)
    else:
        tables, skipping = (), _skipping_apart(name, group, drawn, drawable)
    together = TogetherPlan(
        name=name,
        transfers=tuple(drawn.transfers.values()),
        programs=programs,
        skip_tables=tables,
        skips_apart=grids is not None and skipping.kept,
        grid=None if grids is None else grids.grid,
        placed=() if grids is None else grids.placed,
        unlit=_unlit(scene, drawn),
    )
    return together, (*drawn.items, item, skipping, *_dark_colours(group[0], scene))


def _unlit(scene: Scene, drawn: DrawnTogether) -> tuple[str, ...]:
    wanted = () if scene.together is None or scene.render.lighting == "none" else scene.together.unlit
    return tuple(name for name in drawn.transfers.values() if name in wanted)


def _dark_colours(plan: ChannelPlan, scene: Scene) -> Iterator[PlanItem]:
    """Warn of colours that a profile without textures in sRGB holds in 8 bits of linear light."""
    if scene.colour is None or plan.quantize.bits > 8 or scene.tolerance.flip >= _FLIP_OF_LINEAR:
        return
    yield PlanItem(
        name="dark colours",
        kind=BEYOND,
        kept=True,
        reason=f"profile {plan.profile.name} has no textures in sRGB, and 8 bits of linear light round dark colours by "
        f"up to six steps of a screen: dark pictures may have a FLIP of up to {_FLIP_OF_LINEAR:g}, and the tolerance "
        f"is {scene.tolerance.flip:g}; a profile of OpenGL ES 3 keeps them, or allow more in [tolerance]",
    )


def _skipping(
    group: Sequence[ChannelPlan],
    founds: Mapping[str, SkipInputs],
    drawn: DrawnTogether,
    levels: Sequence[LevelPlan],
    scene: Scene,
) -> tuple[tuple[SkipTablePlan, ...], PlanItem]:
    """Decide whether rays skip the space that is empty in all channels."""
    name = scene.together.name if scene.together else ""
    media = [(plan.function(drawn.transfers[plan.channel]), founds[plan.channel]) for plan in group]
    if scene.colour is not None:
        # Opacity, the last channel, scales light, too.
        media = media[-1:]
    tables, reason, size = skip_together(scene.skip, name, media, levels)
    if tables and not all(_fits(group, table.level, [math.prod(table.shape_zyx)]) for table in tables):
        tables, reason = (), "there is no room for it beside all channels"
    files = tuple(table.file for table in tables)
    item = PlanItem(
        name=f"skip table {name}",
        kind=SKIP_KIND,
        transfer=name,
        kept=bool(tables),
        reason=reason,
        files=files,
        size_bytes=size,
    )
    return tables, item


def _skipping_apart(
    name: str, group: Sequence[ChannelPlan], drawn: DrawnTogether, levels: Sequence[LevelPlan]
) -> PlanItem:
    """Decide whether each channel of several grids skips its empty space, by the tables of its own pictures."""
    planned = [plan.part(SkipPlan) for plan in group]
    sizes = {
        (table.transfer, table.level): math.prod(table.shape_zyx) for skip in planned if skip for table in skip.tables
    }
    shown = [transfer for transfer in drawn.transfers.values() if (transfer, levels[0].index) in sizes]
    reason = f"rays look at the tables of {', '.join(shown)}" if shown else "no channel has a table of its own"
    if not all(_fits(group, level.index, [sizes[name, level.index] for name in shown]) for level in levels):
        shown, reason = [], "there is no room for the tables of the channels beside all channels"
    return PlanItem(name=f"skip table {name}", kind=SKIP_KIND, transfer=name, kept=bool(shown), reason=reason)


def _found(plan: ChannelPlan, measured: Measured, scene: Scene) -> SkipInputs:
    """Inputs of a decision about the empty space of one channel."""
    return SkipInputs(
        profile=plan.profile,
        crop=plan.crop,
        grid=plan.grid,
        quantize=plan.quantize,
        entries=max((table.entries for table in plan.tables), default=_EXACT),
        levels=plan.levels,
        volumes=plan.volumes,
        measured=measured,
        editable=scene.editable,
        loops=TECHNIQUES[scene.render.technique].loops,
        clear_at_zero=scene.colour is not None,
    )


def _obstacles(group: Sequence[ChannelPlan], scene: Scene) -> Iterator[str]:
    if scene.render.lighting not in {"none", "headlight"}:
        yield f"light on several channels comes from the viewer, but render.lighting is {scene.render.lighting}"
    if scene.lit_normals is not None:
        yield "light on several channels takes differences of values: set lighting.normals to central or forward"
    if scene.render.classification not in {"lookup", "palette", "control-points", "colour"}:
        yield f"segments of several channels have no common table, but classification is {scene.render.classification}"
    labels = [plan.channel for plan in group if plan.quantize.labels]
    if labels:
        yield f"{', '.join(labels)} holds labels, which are not densities"
    if any(volume.bricks is not None for plan in group for volume in plan.volumes):
        yield "levels are bricks, which hold one channel"


def _refuse(scene: Scene, reason: str) -> NoReturn:
    name = scene.together.name if scene.together else ""
    raise VolprepError("VP1245", path=scene.name, name=name, reason=reason)


def _fits(group: Sequence[ChannelPlan], level: int, skip_bytes: Sequence[int] = ()) -> bool:
    """Return whether a device holds a level of all channels, their tables and skip tables at one time."""
    profile = group[0].profile
    # Channels that share texels have the same files.
    sizes = {
        volume.files: chain_bytes(plan.volumes, volume)
        for plan in group
        for volume in plan.volumes
        if volume.level == level
    }
    each = [[size_bytes(table.format, (1, 1, table.entries)) for table in plan.lookups] for plan in group]
    tables = [*(max(of_channel, default=0) for of_channel in each), *skip_bytes]
    units = sum(len(files) for files in sizes) + sum(1 for size in tables if size)
    return units <= profile.texture_units and sum(sizes.values()) + sum(tables) <= profile.max_texture_bytes
