"""The cache of plans and slow stages gives what they give, and only where nothing that they depend on differs."""

from pathlib import Path

import pytest
import remembered_stages
from phantom_scene import write_phantom_scene
from remembered_stages import kept_in, remember
from scene_builds import built, planned

from volprep.parts.levels import stage


@pytest.fixture
def runs(monkeypatch) -> list[str]:
    """Each run of the stage that makes levels."""
    begun: list[str] = []
    levels = stage.LevelInput
    monkeypatch.setattr(stage, "LevelInput", lambda *given: begun.append("levels") or levels(*given))
    return begun


def contents(scene: Path, old: str = "", new: str = "") -> dict[str, bytes]:
    scene.write_text(scene.read_text().replace(old, new))
    target = scene.with_suffix(".volpkg")
    built(scene, target)
    return {str(path.relative_to(target)): path.read_bytes() for path in target.rglob("*") if path.is_file()}


@pytest.mark.long
def test_levels_are_made_again_only_if_what_they_depend_on_differs(tmp_path, runs) -> None:
    scene = write_phantom_scene(tmp_path)
    with remember(tmp_path / "cache"):
        first = contents(scene)
        assert contents(scene) == first
        assert runs == ["levels"]
        contents(scene, "[pyramid]", "[grid]\nsize = 16\n[pyramid]")
        assert runs == ["levels"]
        assert contents(scene, '"box"', '"maximum"') != first
        assert runs == ["levels"] * 2
        raw = tmp_path / "phantom.raw"
        raw.write_bytes(raw.read_bytes()[::-1])
        contents(scene)
        assert runs == ["levels"] * 3
        with remember(tmp_path / "cache", whole_plan=True):
            contents(scene)
            contents(scene)
        assert runs == ["levels"] * 4


def test_a_plan_is_made_again_only_if_what_it_follows_from_differs(tmp_path, monkeypatch) -> None:
    made: list[str] = []
    plan = remembered_stages._plan
    monkeypatch.setattr(remembered_stages, "_plan", lambda *given: made.append("plan") or plan(*given))
    scenes = []
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        scenes.append(write_phantom_scene(tmp_path / name, "gles2-2048", "box"))
    with remember(tmp_path / "cache"):
        first, second = (planned(scene) for scene in scenes)
        assert first == second
        assert made == ["plan"]
        scenes[0].write_text(scenes[0].read_text().replace("value = 600.0", "value = 610.0"))
        assert planned(scenes[0]) != first
        assert made == ["plan"] * 2
        raw = tmp_path / "other" / "phantom.raw"
        raw.write_bytes(raw.read_bytes()[::-1])
        planned(scenes[1])
        assert made == ["plan"] * 3


def test_the_cache_of_another_version_is_removed(tmp_path) -> None:
    (tmp_path / "0123456789abcdef").mkdir()
    assert list(tmp_path.iterdir()) == [tmp_path / "0123456789abcdef"]
    kept = kept_in(tmp_path)
    assert list(tmp_path.iterdir()) == [kept]
