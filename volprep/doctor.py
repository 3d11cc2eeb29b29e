"""Check this machine for everything that volprep needs: one fact for each requirement."""

import os
import platform
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Literal, get_args

from volprep.render.probe_results import ProfileProbes
from volprep.scene.profiles import ProfileFile, class_names, device_names, load_profile, load_sheet, profile_names
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import EXTRAS, generator, how_to_add, missing_module
from volprep_formats.package.api import ContextApi, graphics_api
from volprep_formats.record import Record

Topic = Literal["machine", "volprep", "OpenGL ES", "profile", "device", "drawing", "DICOM", "files", "extra"]
_NEEDED_APIS = ("es2.0", "es3.0")
_NEEDED_PROFILES = ("gles2-2048", "gles3")
# Building the package of a 384-slice head MR peaks below this.
_COMFORTABLE_BYTES = 1_500_000_000


class Fact(Record):
    """One requirement, and whether this machine meets it."""

    topic: Topic
    """Group of the fact."""
    name: str
    """Name of the thing checked."""
    found: bool = True
    """Whether it is there."""
    needed: bool = False
    """Whether building or drawing a package fails without it. Extras are never needed."""
    detail: str
    """Version, driver or number that was found, or why nothing was found."""
    remedy: str = ""
    """How to fix it; empty if it was found."""


class Examination(Record):
    """All facts about a machine."""

    ready: bool
    """Whether this machine can build a package and draw it."""
    facts: tuple[Fact, ...]
    """One for each requirement, always in the same order; one more for each format, filter or size drawn wrong."""
    probes: tuple[ProfileProbes, ...]
    """Probe results for each profile whose OpenGL ES context could be created."""
    profiles: tuple[ProfileFile, ...]
    """The profiles that come with volprep, with the source of each of their numbers."""


def examine() -> Examination:
    """Run all checks. Missing things never raise."""
    probes: list[ProfileProbes] = []
    facts = (*_machine(), *_volprep(), *_opengl_es(), *_profiles(probes), *_devices(), *_dicom(), *_files(), *_extras())
    return Examination(
        ready=all(fact.found for fact in facts if fact.needed),
        facts=facts,
        probes=tuple(probes),
        profiles=tuple(load_sheet(name, Path()) for name in profile_names()),
    )


def _machine() -> Iterator[Fact]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    yield Fact(topic="machine", name="Python", needed=True, detail=platform.python_version())
    yield Fact(topic="machine", name="cores", detail=f"{cores} ({platform.machine()})")
    available = _available_bytes()
    if available is None:
        yield Fact(topic="machine", name="memory", detail="this system does not say")
        return
    enough = available >= _COMFORTABLE_BYTES
    remedy = "" if enough else f"A head MR needs up to {_COMFORTABLE_BYTES / 1e9:.1f} GB: close other programs."
    yield Fact(topic="machine", name="memory", found=enough, detail=f"{available / 1e9:.1f} GB free", remedy=remedy)


def _refused(topic: Topic, name: str, error: VolprepError, *, needed: bool) -> Fact:
    return Fact(topic=topic, name=name, found=False, needed=needed, detail=error.summary, remedy=error.remedy)


def _available_bytes() -> int | None:
    """Memory that a program could get without swapping (Linux)."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:")), None)


def _volprep() -> Iterator[Fact]:
    rebuild = "Build it: make test in a checkout, or pip install with a C++20 compiler."
    yield _imported("volprep", "native core", _native, needed=True, remedy=rebuild)
    yield _imported(
        "volprep",
        "OpenVDB",
        _openvdb,
        needed=False,
        remedy="Install libopenvdb-dev, libtbb-dev and libboost-dev (Debian), then build volprep again.",
    )


def _native() -> str:
    return f"{generator()}, {import_module('volprep.kernels._native').max_threads()} threads"


def _openvdb() -> str:
    return f"{import_module('volprep_formats._vdb').library_version()}"


def _imported(topic: Topic, name: str, detail: Callable[[], str], *, needed: bool, remedy: str) -> Fact:
    """Check that something can be imported, and give the version that it reports."""
    try:
        return Fact(topic=topic, name=name, needed=needed, detail=detail())
    except (ImportError, OSError) as error:
        reason = str(error).splitlines()[0]
        return Fact(topic=topic, name=name, found=False, needed=needed, detail=reason, remedy=remedy)


def _opengl_es() -> Iterator[Fact]:
    try:
        from volprep.render.egl import context  # noqa: PLC0415 -- raises without EGL
    except VolprepError as error:
        yield _refused("OpenGL ES", "EGL", error, needed=True)
        return
    for api in get_args(ContextApi):
        needed = api in _NEEDED_APIS
        name = graphics_api(api).number
        try:
            with context(api) as opened:
                detail = str(opened.driver)
        except VolprepError as error:
            yield _refused("OpenGL ES", name, error, needed=needed)
        else:
            yield Fact(topic="OpenGL ES", name=name, needed=needed, detail=detail)
    yield from _filter()


def _filter() -> Iterator[Fact]:
    from volprep.render.probe import MOST_FILTER_STEPS, filter_steps  # noqa: PLC0415 -- raises without EGL

    try:
        steps = filter_steps()
    except VolprepError:
        # Already reported by the fact about OpenGL ES 3.0.
        return
    if steps is not None:
        number = f"{steps} or more" if steps == MOST_FILTER_STEPS else str(steps)
        yield Fact(topic="OpenGL ES", name="filter", detail=f"{number} steps between two texels")


def _profiles(probes: list[ProfileProbes]) -> Iterator[Fact]:
    """Check for each profile that everything its packages may need is drawn correctly; add the results to `probes`."""
    try:
        from volprep.render.probe import probe_profile  # noqa: PLC0415 -- raises without EGL
    except VolprepError:
        # Already reported by the fact about EGL.
        return
    for name in class_names():
        try:
            probed = probe_profile(load_profile(name, Path()))
        except VolprepError as error:
            yield _refused("profile", name, error, needed=name in _NEEDED_PROFILES)
            continue
        known = {f"{failure.api} {failure.capability}" for other in probes for failure in other.wrong}
        probes.append(probed)
        yield from _drawn(probed, known)


def _devices() -> Iterator[Fact]:
    """State the limits of each device that a package can be made for; --json also names their sources."""
    for name in device_names():
        device = load_profile(name, Path())
        volumes = f"3D {device.max_3d_texture_size}" if device.max_3d_texture_size else "no 3D"
        yield Fact(
            topic="device",
            name=name,
            detail=f"OpenGL ES {device.graphics.number}, textures 2D {device.max_texture_size}, {volumes}, "
            f"{device.texture_units} units, {device.max_texture_bytes / 1e6:.0f} MB",
        )


def _drawn(probed: ProfileProbes, known: set[str]) -> Iterator[Fact]:
    """State the probe results of a profile; each failure not in `known` from another profile has its own fact."""
    count, wrong = len(probed.results), probed.wrong
    # Most scans do without the largest sizes.
    only_sizes = bool(wrong) and all(failure.size is not None for failure in wrong)
    needed = probed.profile in _NEEDED_PROFILES and not only_sizes
    yield Fact(
        topic="profile",
        name=probed.profile,
        found=not wrong,
        needed=needed,
        detail=f"{count - len(wrong)} of {count} formats, filters and sizes drawn right",
        remedy=f"Wrong: {', '.join(failure.capability for failure in wrong)}." if wrong else "",
    )
    for failure in wrong:
        if f"{failure.api} {failure.capability}" not in known:
            yield Fact(
                topic="drawing",
                name=f"{failure.api} {failure.capability}",
                found=False,
                needed=needed and failure.size is None,
                detail=f"{failure.code} {failure.words}",
                remedy=failure.remedy,
            )


def _dicom() -> Iterator[Fact]:
    from volprep_formats.readers.dicom.codecs import codecs  # noqa: PLC0415 -- heavy

    for codec in codecs():
        yield Fact(
            topic="DICOM",
            name=codec.name,
            found=bool(codec.decoders),
            detail=", ".join(codec.decoders) or "no decoder",
            remedy="" if codec.decoders else f"pip install {' '.join(codec.missing)}",
        )


def _files() -> Iterator[Fact]:
    yield _imported("files", "pictures", _openimageio, needed=True, remedy="pip install OpenImageIO")


def _openimageio() -> str:
    return f"OpenImageIO {import_module('OpenImageIO').VERSION_STRING}"


def _extras() -> Iterator[Fact]:
    for extra, needed in EXTRAS.items():
        module = missing_module(extra)
        yield Fact(
            topic="extra",
            name=extra,
            found=module is None,
            detail=needed.purpose if module is None else f"{needed.purpose}: no module {module}",
            remedy="" if module is None else how_to_add(extra),
        )
