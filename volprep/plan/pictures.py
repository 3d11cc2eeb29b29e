"""The pictures that a plan makes: what a user can choose, before anything is drawn."""

from collections.abc import Iterator

from volprep.plan.products import TogetherPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep_formats.grid import Grid
from volprep_formats.package.picture import Picture, PictureMedium


def pictures_of(plan: Plan) -> tuple[Picture, ...]:
    """Return the pictures of a plan, the default one first: that of several transfer functions, then each alone."""
    joint = plan.joint
    found: list[Picture] = []
    if joint is not None:
        unlit = joint.unlit if isinstance(joint, TogetherPlan) else ()
        media = [
            _medium(channel, name, unlit=name in unlit or None)
            for channel, name in zip(plan.drawn_together, joint.transfers, strict=True)
        ]
        found.append(Picture(name=joint.name, media=tuple(media), mixing=joint.mixing))
        if isinstance(joint, TogetherPlan) and joint.grid is not None:
            found[0] = _on_grids(found[0], joint, joint.grid)
    covered = () if joint is None else joint.transfers
    for channel in plan.channels:
        names = _alone(channel, covered)
        grid = None if channel.grid == plan.shared.grid else channel.grid
        found += [Picture(name=name, media=(_medium(channel, name),), grid=grid) for name in names]
    return tuple(found)


def _on_grids(picture: Picture, plan: TogetherPlan, grid: Grid) -> Picture:
    media = [
        medium if placed is None else medium.model_copy(update={"placed": tuple(x for row in placed for x in row)})
        for medium, placed in zip(picture.media, plan.placed, strict=True)
    ]
    return picture.model_copy(update={"grid": grid, "media": tuple(media)})


def _medium(channel: ChannelPlan, transfer: str, *, unlit: bool | None = None) -> PictureMedium:
    return PictureMedium(channel=channel.channel, transfer=transfer, unlit=unlit)


def _alone(channel: ChannelPlan, covered: tuple[str, ...]) -> Iterator[str]:
    """Yield the transfer functions that have a picture of their own."""
    drawn = {program.transfer for program in channel.programs}
    yield from (name for name in channel.transfers if name in drawn or name not in covered)
