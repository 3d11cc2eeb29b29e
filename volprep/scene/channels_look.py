"""Default look of a scan with several channels, such as stains under a microscope: a colour for each.

Each channel is a veil whose opacity rises from its background on.
"""

from collections.abc import Sequence

from volprep.scene.channels import with_listed_channels
from volprep.scene.fused_look import MeasuredScan, transfer_of, undecided
from volprep.scene.scene import Scene, TogetherSettings
from volprep.scene.transfer import SceneTransfer
from volprep.scene.values import values_of
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.source import ChannelSpec

_PICTURE = "all-channels"
_TWO = {"magenta": "#ff00ff", "green": "#00ff00"}
_MORE = {"cyan": "#00d0ff", "yellow": "#ffd000", "magenta": "#ff20c0", "blue": "#6080ff"}
_OPACITIES = (0.0, 0.01, 0.08)
"""At the background, at the median of what is brighter, and at the brightest voxels."""


def with_all_channels(scene: Scene, profile: DeviceProfile, error: VolprepError) -> Scene:
    """Return the scene of a scan with all channels in one picture, whose looks are decided when all are measured.

    Raises `error`, which says that the scan cannot be read as one volume, again if channels are not the reason, if
    there are more of them than colours, or if the device draws one volume alone.
    """
    if error.code != "VP1221" or error.fields["key"] != "channel" or not profile.has_shaders:
        raise error
    listed = with_listed_channels(scene.with_source(scene.source.model_copy(update={"channels": "all"})))
    names = [channel.name for channel in listed.source.channels or () if isinstance(channel, ChannelSpec)]
    if len(names) > len(_MORE):
        raise error
    colours = ", ".join(f"{name} in {colour}" for name, colour in zip(names, _colours(len(names)), strict=False))
    said = f"recognised as channels, {colours}; --channel NAME draws one, and a scene draws them in another way"
    together = TogetherSettings(name=_PICTURE)
    return listed.with_transfer(undecided(names)).model_copy(update={"together": together, "recognised": said})


def with_channel_looks(scene: Scene, scans: Sequence[MeasuredScan]) -> Scene:
    """Return the scene of several channels with the transfer functions that suit them."""
    looks = zip(scene.transfer, scans, _colours(len(scans)).values(), strict=False)
    return scene.with_transfer(tuple(_veil(transfer.name, scan, colour) for transfer, scan, colour in looks))


def _colours(count: int) -> dict[str, str]:
    return _TWO if count == len(_TWO) else _MORE


def _veil(name: str, scan: MeasuredScan, colour: str) -> SceneTransfer:
    values = values_of(scan.values)
    at = values.background, values.median, max(values.high, scan.statistics.maximum)
    return transfer_of(name, [(value, colour, opacity) for value, opacity in zip(at, _OPACITIES, strict=True)])
