"""Reading packages that others made: only whole files that the manifest names, and never one outside the package."""

import errno
import json
import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.manifest_json import MAX_MANIFEST_BYTES
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft

Change = Callable[[dict], object]


def edit(package: Path, change: Change) -> None:
    manifest = json.loads((package / "manifest.json").read_text())
    change(manifest)
    (package / "manifest.json").write_text(json.dumps(manifest))


def refused(package: Path) -> str:
    with pytest.raises(VolprepError) as caught:
        Package.open(package)
    assert caught.value.status is ExitStatus.PACKAGE
    return str(caught.value)


def test_a_sealed_package_gives_its_manifest_and_its_files(sealed: Path) -> None:
    package = Package.open(sealed)
    assert package.path == sealed
    assert package.manifest.name == "shells"
    assert package.read_bytes("textures/bone.ktx2") == (sealed / "textures/bone.ktx2").read_bytes()
    assert package.read_text("shaders/raycast.frag") == "void main() {}\n"


def test_a_package_that_is_reached_through_a_link_is_read(tmp_path: Path, sealed: Path) -> None:
    (tmp_path / "link").symlink_to(sealed)
    assert Package.open(tmp_path / "link").read_text("shaders/raycast.frag")


def test_a_draft_is_read_only_on_request(draft: Draft) -> None:
    assert refused(draft.folder).startswith("VP4005")
    assert Package.open(draft.folder, allow_draft=True).manifest == draft.manifest


def test_what_is_no_package_is_refused(tmp_path: Path) -> None:
    assert refused(tmp_path / "none").startswith("VP4001")
    assert "it has no manifest.json" in refused(tmp_path)
    (tmp_path / "file").write_text("")
    assert "it is neither a folder nor a sound zip" in refused(tmp_path / "file")


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is not JSON"),
        (b"{", "is not JSON"),
        (b"\xff\xfe{}", "is not JSON"),
        (b"[" * 100_000, "is not JSON"),
        (b'{"a":' * 100_000, "is not JSON"),
        (b'{"format": "volpkg", "format": "volpkg"}', "occurs twice"),
        (b'{"format": "volpkg", "x": NaN}', "NaN"),
        (b'{"format": "volpkg", "x": -Infinity}', "Infinity"),
        (b'{"x": ' + b"9" * 5000 + b"}", "is not JSON"),
        (b"[]", '"format": "volpkg"'),
        (b"{}", '"format": "volpkg"'),
        (b'{"format": "zip"}', '"format": "volpkg"'),
        (b'{"format": "volpkg"}', "no version"),
        (b'{"format": "volpkg", "version": 1.0}', "no version"),
        (b'{"format": "volpkg", "version": "1"}', "no version"),
        (b'{"format": "volpkg", "version": "1.0.0"}', "no version"),
        (b" " * (MAX_MANIFEST_BYTES + 1), "is larger than"),
    ],
)
def test_a_manifest_that_is_none_is_refused(tmp_path: Path, data: bytes, says: str) -> None:
    (tmp_path / "manifest.json").write_bytes(data)
    message = refused(tmp_path)
    assert message.startswith("VP4002")
    assert says in message


def test_a_manifest_far_above_the_limit_is_not_read_to_its_end(tmp_path: Path) -> None:
    with (tmp_path / "manifest.json").open("wb") as file:
        file.truncate(1 << 40)
    assert "is larger than" in refused(tmp_path)


@pytest.mark.parametrize("version", ["2.0", "0.9", "10.0"])
def test_another_version_is_refused_before_its_keys_are_looked_at(sealed: Path, version: str) -> None:
    edit(sealed, lambda manifest: manifest.update(version=version, unknown=1))
    assert refused(sealed).startswith("VP4003")
    assert version in refused(sealed)


def _set(*path: str | int, to: object) -> Change:
    def change(manifest: dict) -> None:
        inner = manifest
        for part in path[:-1]:
            inner = inner[part]
        inner[path[-1]] = to

    return change


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda manifest: manifest["channels"][0].pop("source"), "channels.0.source: is missing"),
        (_set("state", to="ready"), "state"),
        (_set("name", to=7), "name"),
        (_set("textures", 0, "level", to="0"), "textures.0.level"),
        (_set("channels", 0, "levels", 0, "grid", "shape_zyx", 0, to=0), "channels.0.levels.0.grid.shape_zyx.0"),
        (
            _set("channels", 0, "levels", 0, "grid", "spacing_mm_zyx", 0, to=-1.0),
            "channels.0.levels.0.grid.spacing_mm_zyx.0",
        ),
        (_set("channels", 0, "levels", 0, "grid", "direction", 0, 0, to=1e308), "orthonormal"),
        (_set("files", 0, "size_bytes", to=-1), "files.0.size_bytes"),
        (_set("files", 0, "sha256", to="F" * 64), "files.0.sha256"),
        (_set("files", 0, "path", to="../secret"), "files.0.path"),
        (_set("files", 0, "path", to="/etc/passwd"), "files.0.path"),
        (_set("files", 0, "path", to="a/../../secret"), "files.0.path"),
        (_set("files", 0, "path", to="a\\..\\secret"), "files.0.path"),
        (_set("files", 0, "path", to="./shaders/raycast.frag"), "files.0.path"),
        (_set("files", 0, "path", to="shaders/raycast.frag/."), "files.0.path"),
        (_set("files", 0, "path", to="Shaders/raycast.frag"), "files.0.path"),
        (_set("files", 0, "path", to="shaders/RAYCAST.FRAG"), "files.0.path"),
        (_set("files", 0, "path", to="shaders/r\u0430ycast.frag"), "files.0.path"),  # a Cyrillic letter
        (_set("files", 0, "path", to="shaders/raycast.frag."), "files.0.path"),
        (_set("files", 0, "path", to="shaders/raycast.frag:stream"), "files.0.path"),
        (_set("files", 0, "path", to="c:/secret"), "files.0.path"),
        (_set("files", 0, "path", to="shaders/raycast.frag\n"), "files.0.path"),
        (_set("textures", 0, "file", to="../secret"), "textures.0.file"),
        (_set("preview", to="../secret"), "preview"),
    ],
)
def test_a_manifest_that_breaks_the_schema_is_refused(sealed: Path, change: Change, says: str) -> None:
    edit(sealed, change)
    message = refused(sealed)
    assert message.startswith("VP4004")
    assert says in message


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (_set("grid", "shape_zyx", 0, to=10**400), "a number has more than 256 digits"),
        (_set("files", 0, "size_bytes", to=2**53), "an integer is beyond 9007199254740991"),
        (_set("files", 0, "path", to="shaders/raycast.frag\0"), "a string has a zero character"),
        (_set("generator", to="\ud800"), "half of a surrogate pair"),
        (_set("extras", to=json.loads("[" * 31 + "]" * 31)), ""),
        (_set("extras", to=json.loads("[" * 32 + "]" * 32)), "nests more than 32 deep"),
        (_set("extras", to=dict.fromkeys(map(str, range(257)))), "an object has more than 256 keys"),
    ],
)
def test_values_that_parsers_read_differently_are_refused(sealed: Path, change: Change, says: str) -> None:
    edit(sealed, change)
    if not says:
        Package.open(sealed)
        return
    message = refused(sealed)
    assert message.startswith("VP4002")
    assert says in message


def test_an_integer_may_be_written_with_a_fraction(sealed: Path) -> None:
    before = Package.open(sealed).manifest
    text = (sealed / "manifest.json").read_text()
    (sealed / "manifest.json").write_text(re.sub(r'("index": |"bits": )([0-9]+)', r"\1\2.0", text))
    assert Package.open(sealed).manifest == before


def test_of_many_problems_the_first_twelve_are_told(sealed: Path) -> None:
    edit(sealed, lambda manifest: manifest.update({f"key{number}": 1 for number in range(18)}))
    (finding,) = check(sealed)
    assert finding.summary.count("unknown key") == 12
    assert "and 6 more" in finding.summary


def test_a_file_that_the_manifest_does_not_name_is_not_read(sealed: Path) -> None:
    package = Package.open(sealed)
    (sealed / "notes.txt").write_text("mine")
    for name in ("notes.txt", "manifest.json", "../shells.volpkg/notes.txt", "/etc/passwd", ""):
        with pytest.raises(VolprepError, match="VP4014"):
            package.read_bytes(name)


def test_a_file_that_is_damaged_is_not_given(sealed: Path) -> None:
    package = Package.open(sealed)
    path = sealed / "shaders" / "raycast.frag"
    good = path.read_bytes()
    for damaged, code in ((good + b" ", "VP4008"), (good[:-1], "VP4008"), (b"V" + good[1:], "VP4009")):
        path.write_bytes(damaged)
        with pytest.raises(VolprepError, match=code):
            package.read_bytes("shaders/raycast.frag")
    path.unlink()
    with pytest.raises(VolprepError, match=r"VP4007 .*shaders/raycast.frag: No such file"):
        package.read_bytes("shaders/raycast.frag")


def test_a_huge_declared_size_allocates_nothing(sealed: Path) -> None:
    edit(sealed, _set("files", 0, "size_bytes", to=2**53 - 1))
    with pytest.raises(VolprepError, match=f"VP4008 .*instead of {2**53 - 1}"):
        Package.open(sealed).read_bytes("preview.png")


def test_a_text_that_is_not_utf_8_is_refused(draft: Draft) -> None:
    draft.write("shaders/a.frag", "shader", b"\xff")
    draft.commit(draft.manifest.stages[0])
    with pytest.raises(VolprepError, match="VP4011"):
        Package.open(draft.folder, allow_draft=True).read_text("shaders/a.frag")


def test_links_are_not_followed(tmp_path: Path, sealed: Path) -> None:
    package = Package.open(sealed)
    secret = tmp_path / "secret"
    shader = sealed / "shaders" / "raycast.frag"
    secret.write_bytes(shader.read_bytes())
    shader.unlink()
    shader.symlink_to(secret)
    with pytest.raises(VolprepError, match="VP4007"):
        package.read_bytes("shaders/raycast.frag")
    outside = tmp_path / "outside"
    (sealed / "textures").rename(outside)
    (sealed / "textures").symlink_to(outside)
    with pytest.raises(VolprepError, match="VP4007"):
        package.read_bytes("textures/bone.ktx2")
    manifest = sealed / "manifest.json"
    manifest.rename(tmp_path / "manifest")
    manifest.symlink_to(tmp_path / "manifest")
    assert refused(sealed).startswith("VP4007")


@pytest.mark.timeout(20)
def test_a_pipe_or_a_folder_in_place_of_a_file_is_refused(sealed: Path) -> None:
    package = Package.open(sealed)
    shader = sealed / "shaders" / "raycast.frag"
    shader.unlink()
    os.mkfifo(shader)
    with pytest.raises(VolprepError, match=r"VP4007 .*not a regular file"):
        package.read_bytes("shaders/raycast.frag")
    shader.unlink()
    shader.mkdir()
    with pytest.raises(VolprepError, match="VP4007"):
        package.read_bytes("shaders/raycast.frag")


def test_every_prefix_of_a_manifest_gives_a_coded_error(sealed: Path) -> None:
    data = (sealed / "manifest.json").read_bytes()
    for length in range(0, len(data) - 1, 13):
        (sealed / "manifest.json").write_bytes(data[:length])
        assert refused(sealed).startswith("VP4002")


def test_a_folder_that_may_not_be_entered_is_not_called_one_without_a_manifest(sealed, monkeypatch) -> None:
    def refuse(path: Path) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "lstat", refuse)
    assert refused(sealed).startswith(f"VP4007 {sealed}: cannot read manifest.json: Permission denied")
