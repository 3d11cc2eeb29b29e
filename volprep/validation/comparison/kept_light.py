"""The worst place of a level: where a thing keeps the least of its light, enlarged for the report."""

from volprep.validation.comparison.seen import place_picture
from volprep.validation.folder import PICTURES, ReportFolder
from volprep.validation.results.seen import FullSize, KeptLight, SeenNumbers
from volprep_formats.arrays import FloatArray


def kept_light(  # noqa: PLR0917 - a place, and how it is named
    folder: ReportFolder,
    program: str,
    level: int,
    view: str,
    seen: SeenNumbers | FullSize,
    drawn_and_truth: tuple[FloatArray, FloatArray],
    box: float | None,
) -> KeptLight | None:
    """Write the picture of the worst place of a view, and return the light kept there; None without things."""
    if seen.least_kept is None or seen.kept_light is None:
        return None
    name = f"{PICTURES}/{program}-kept-level{level}.png"
    folder.picture(name, place_picture(*drawn_and_truth, seen.least_kept))
    return KeptLight(level=level, view=view, kept_light=seen.kept_light, box=box, things=seen.things, picture=name)
