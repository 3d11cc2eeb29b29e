"""What a user asks for on the command line: a scene whose paths are resolved, and the profile it names."""

from dataclasses import dataclass
from pathlib import Path

from volprep.profiles import load_profile
from volprep.scene import Scene, load_scene
from volprep_formats.package.profile import DeviceProfile


@dataclass(frozen=True)
class Request:
    """A scene and a profile."""

    scene: Scene
    """The scene; the path of its source is absolute."""
    profile: DeviceProfile
    """Class of devices."""
    scene_path: Path
    """The scene file, absolute."""


def load_request(scene_path: Path, profile: str | None = None, source: Path | None = None) -> Request:
    """Read a scene and its profile. `profile` and `source`, if given, replace what the scene says.

    A relative path in the scene starts at the scene's folder, one given here at the current folder. Raises VP3001 to
    VP3003 for the scene, VP3010 to VP3012 for the profile.
    """
    scene = load_scene(scene_path)
    base = scene_path.resolve().parent
    where = source.absolute() if source is not None else base / scene.source.path
    resolved = scene.model_copy(update={"source": scene.source.model_copy(update={"path": str(where)})})
    device = load_profile(profile, Path.cwd()) if profile is not None else load_profile(scene.profile, base)
    return Request(scene=resolved, profile=device, scene_path=scene_path.resolve())
