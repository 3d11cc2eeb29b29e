"""The pictures that a plan makes: what a user can choose, before anything is drawn."""

from collections.abc import Iterator

from volprep.plan.records import ChannelPlan, Plan
from volprep_formats.package.picture import Picture, PictureMedium


def pictures_of(plan: Plan) -> tuple[Picture, ...]:
    """Return the pictures of a plan, the default one first: that of several transfer functions, then each alone."""
    joint = plan.joint
    found: list[Picture] = []
    if joint is not None:
        media = [_medium(channel, name) for channel, name in zip(plan.drawn_together, joint.transfers, strict=True)]
        found.append(Picture(name=joint.name, media=tuple(media), mixing=joint.mixing))
    covered = () if joint is None else joint.transfers
    for channel in plan.channels:
        names = _alone(channel, covered)
        found += [Picture(name=name, media=(_medium(channel, name),)) for name in names]
    return tuple(found)


def _medium(channel: ChannelPlan, transfer: str) -> PictureMedium:
    return PictureMedium(channel=channel.channel, transfer=transfer)


def _alone(channel: ChannelPlan, covered: tuple[str, ...]) -> Iterator[str]:
    """Yield the transfer functions that have a picture of their own."""
    drawn = {program.transfer for program in channel.programs}
    yield from (name for name in channel.transfers if name in drawn or name not in covered)
