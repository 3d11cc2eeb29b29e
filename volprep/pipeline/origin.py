"""Where a package came from: a small file beside it, so that validation finds the source again.

It lies beside the package and not in it, because a path may name a patient.
"""

import json
from pathlib import Path

from pydantic import ValidationError

from volprep.plan.form_trial import FormTrial
from volprep.plan.level_choice import LevelChoice
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import write_file
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.record import Record, problems
from volprep_formats.regular_files import read_regular

_MOST_BYTES = 2**26


class Origin(Record):
    """The source and scene of a package."""

    scene_path: str | None
    """The scene file, absolute; none where the source was imported without a scene."""
    scene: Scene
    """The scene as it was then; the path of its source is absolute."""
    profile: DeviceProfile | None = None
    """Class of devices, which the command line may have chosen; none in origins of older versions."""
    levels: tuple[LevelChoice, ...] = ()
    """How each level was made, what else was tried, and how long that took; without the tables."""
    forms: tuple[FormTrial, ...] = ()
    """Compressed forms that were tried, and what encoding each took."""


def origin_path(package: Path) -> Path:
    """Return the path of the origin of a package: NAME.volpkg.origin.json beside NAME.volpkg or NAME.volpkg.zip."""
    return package.with_name(f"{package.name.removesuffix('.zip')}.origin.json")


def write_origin(package: Path, origin: Origin) -> None:
    """Write the origin beside where `package` is, or will be. Raises VP4020 where it cannot be written."""
    path = origin_path(package)
    text = json.dumps(origin.model_dump(mode="json"), indent=2, sort_keys=True) + "\n"
    write_file(path, text.encode())


def read_origin(package: Path) -> Origin | None:
    """Read the origin beside a package, None if it does not exist. Raises VP4043 for a file that is wrong."""
    path = origin_path(package)
    try:
        return Origin.model_validate_json(read_regular(path, _MOST_BYTES))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise VolprepError("VP4043", path=path, problem=error.strerror) from error
    except ValidationError as error:
        raise VolprepError("VP4043", path=path, problem=problems(error)) from error
