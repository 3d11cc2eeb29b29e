"""Classes of devices, and single devices, a TOML file each. Users may name one of these or give the path of their own.

A file has the fields of a profile, and may have a table [sources] that says for each where its number comes from. The
profiles of volprep have one for every number, with a note where no source is published.
"""

from pathlib import Path

from pydantic import Field, ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.record import problems
from volprep_formats.textures.texel_formats import TextureFormat
from volprep_formats.toml_file import read_toml_file

_FOLDER = Path(__file__).parent
_SOURCES = "sources"


class ProfileFile(DeviceProfile):
    """A file of a profile: its limits, and where they come from."""

    texture_formats: tuple[TextureFormat, ...]
    """Formats that can be uploaded and filtered linearly."""
    sources: dict[str, str] = Field(default_factory=dict)
    """Where each number comes from, by the name of its key. No part of a package."""

    @property
    def profile(self) -> DeviceProfile:
        """The profile, as packages have it."""
        return DeviceProfile.model_validate(self.model_dump(exclude={_SOURCES}, exclude_unset=True))


def class_names() -> tuple[str, ...]:
    """Names of the built-in classes of devices, in alphabetical order."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def device_names() -> tuple[str, ...]:
    """Names of the built-in devices, and kinds of devices, whose limits have been published, in alphabetical order."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("devices/*.toml")))


def profile_names() -> tuple[str, ...]:
    """Names of all built-in profiles: classes, then devices."""
    return (*class_names(), *device_names())


def load_profile(name_or_path: str, base: Path) -> DeviceProfile:
    """Read a profile: a built-in one by its name, or a TOML file whose relative path starts at the folder `base`.

    Whatever ends in ".toml" is a path. Raises VP3010 for an unknown name, VP3011 for a file that cannot be read
    and VP3012 for one that is wrong in a key or value.
    """
    return load_sheet(name_or_path, base).profile


def load_sheet(name_or_path: str, base: Path) -> ProfileFile:
    """Read a profile with its sources. Raises the errors of `load_profile`."""
    if name_or_path.endswith(".toml"):
        path = base / name_or_path
    elif name_or_path in class_names():
        path = _FOLDER / f"{name_or_path}.toml"
    elif name_or_path in device_names():
        path = _FOLDER / "devices" / f"{name_or_path}.toml"
    else:
        raise VolprepError("VP3010", name=name_or_path, known=", ".join(profile_names()))
    try:
        table = read_toml_file(path)
    except OSError as error:
        raise VolprepError("VP3011", path=path, error=error.strerror) from error
    except ValueError as error:
        raise VolprepError("VP3011", path=path, error=error) from error
    try:
        sheet = ProfileFile.model_validate(table)
    except ValidationError as error:
        raise VolprepError("VP3012", path=path, problems=problems(error)) from error
    unknown = sorted(sheet.sources.keys() - DeviceProfile.model_fields.keys())
    if unknown:
        raise VolprepError("VP3012", path=path, problems=f"{_SOURCES}.{unknown[0]}: there is no such key to source")
    return sheet
