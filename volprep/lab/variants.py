"""Variants of a scene: packages that differ from it in some keys, each built once, from the same scan."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import ValidationError

from volprep.parts.ablation import Changes
from volprep.pipeline.build import build
from volprep.scene.channels import SceneChannel, drawn_channels
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep.validation.subjects.scan import Judge
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.record import problems


@dataclass(frozen=True)
class Made:
    """A variant."""

    package: Package
    """Its package."""
    seconds: float
    """Duration of the build."""


class Workshop:
    """Builds variants of one scene in a folder."""

    def __init__(self, request: Request, folder: Path) -> None:
        """Take the scene with its profile, and an empty folder."""
        self.scene = request.scene
        self._request = request
        self._folder = folder
        self._made: dict[str, Made] = {}

    def make(self, changes: Changes, profile: Changes | None = None) -> Made:
        """Build the scene with some changes, also of the profile; a variant that was already built is reused.

        Raises the errors of a build.
        """
        scene = with_changes(self.scene, changes)
        devices = self._request.profile
        if profile is not None and devices is not None:
            devices = devices.model_copy(update=dict(profile))
        key = f"{scene.model_dump_json()} {devices}"
        if key not in self._made:
            target = self._folder / f"{len(self._made)}.volpkg"
            began = time.perf_counter()
            build(replace(self._request, scene=scene, profile=devices), target, Silent())
            self._made[key] = Made(Package.open(target), time.perf_counter() - began)
        return self._made[key]


def first_channel(manifest: Manifest, judge: Judge, no_shaders: str, what: str) -> tuple[Scene, SceneChannel]:
    """Return the scene of the first channel of a package alone, and the channel.

    Raises the code `no_shaders` for devices without shaders, and VP3046 for `what` of a volume in colour.
    """
    if not manifest.programs:
        raise VolprepError(no_shaders, profile=manifest.profile.name)
    if judge.scene.colour is not None:
        raise VolprepError("VP3046", what=what)
    channel = drawn_channels(judge.scene)[0]
    return judge.scene.with_source(channel.spec).with_transfer(channel.transfer), channel


def with_changes(scene: Scene, changes: Changes) -> Scene:
    """Return the scene with keys changed: tables are merged, other values replaced. Raises VP3003 if it is invalid."""
    try:
        return Scene.model_validate(merged(scene.model_dump(), changes))
    except ValidationError as error:
        raise VolprepError("VP3003", path=scene.name, problems=problems(error)) from error


def merged(table: Mapping[str, object], changes: Changes) -> dict[str, object]:
    """Return a table with changes, tables in it merged."""
    result = dict(table)
    for key, value in changes.items():
        before = result.get(key)
        result[key] = merged(before, value) if isinstance(before, Mapping) and isinstance(value, Mapping) else value
    return result
