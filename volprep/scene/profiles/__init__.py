"""Classes of devices, one TOML file each. Users may name one of these or give the path of their own."""

from pathlib import Path

from pydantic import ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.record import problems
from volprep_formats.toml_file import read_toml_file

_FOLDER = Path(__file__).parent


def profile_names() -> tuple[str, ...]:
    """Names of the built-in profiles, in alphabetical order."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def load_profile(name_or_path: str, base: Path) -> DeviceProfile:
    """Read a profile: a built-in one by its name, or a TOML file whose relative path starts at the folder `base`.

    Whatever ends in ".toml" is a path. Raises VP3010 for an unknown name, VP3011 for a file that cannot be read
    and VP3012 for one that is wrong in a key or value.
    """
    if not name_or_path.endswith(".toml"):
        if name_or_path not in profile_names():
            raise VolprepError("VP3010", name=name_or_path, known=", ".join(profile_names()))
        path = _FOLDER / f"{name_or_path}.toml"
    else:
        path = base / name_or_path
    try:
        table = read_toml_file(path)
    except OSError as error:
        raise VolprepError("VP3011", path=path, error=error.strerror) from error
    except ValueError as error:
        raise VolprepError("VP3011", path=path, error=error) from error
    try:
        return DeviceProfile.model_validate(table)
    except ValidationError as error:
        raise VolprepError("VP3012", path=path, problems=problems(error)) from error
