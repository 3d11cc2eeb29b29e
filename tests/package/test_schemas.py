"""The committed JSON Schemas say what the models say, and tell a good file from a bad one."""

import importlib.util
import json
import tomllib
from pathlib import Path
from types import ModuleType

import jsonschema
import pytest
from pydantic import ValidationError

import volprep
from volprep.scene.scene import Scene

ROOT = Path(__file__).parents[2]
SCHEMAS = ROOT / "formats" / "schemas"


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_schemas", ROOT / "tools" / "make_schemas.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "tools")
        spec.loader.exec_module(module)
    return module


def validator(name: str) -> jsonschema.Draft202012Validator:
    schema = json.loads((SCHEMAS / name).read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_the_committed_schemas_are_those_of_the_models(generator: ModuleType) -> None:
    assert {path.name for path in SCHEMAS.iterdir()} == set(generator.MODELS)
    for name, model in generator.MODELS.items():
        text = (SCHEMAS / name).read_text(encoding="utf-8")
        assert text == generator.schema_text(model), f"{name} is old: run python tools/make_schemas.py"


def test_every_field_of_a_schema_is_described(generator: ModuleType) -> None:
    for name in generator.MODELS:
        schema = json.loads((SCHEMAS / name).read_text(encoding="utf-8"))
        records = schema.get("$defs", {})
        for title, record in {"the file": schema, **records}.items():
            for field, content in record.get("properties", {}).items():
                # Where the field and its record are described by the same words, they stand at the record.
                record_of_field = records.get(content.get("$ref", "").removeprefix("#/$defs/"), {})
                assert "description" in content | record_of_field, f"{name}: {title}.{field}"


def test_the_manifest_of_a_package_is_valid(sealed: Path, sealed_mosaic: Path) -> None:
    for package in (sealed, sealed_mosaic):
        validator("manifest.schema.json").validate(json.loads((package / "manifest.json").read_text()))


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "change",
    [
        {"colour": 1},
        {"version": "2.0"},
        {"state": "ready"},
        {"name": 7},
        {"preview": "../secret"},
        {"files": [{"path": "a", "role": "texture", "size_bytes": -1, "sha256": "0" * 64}]},
    ],
)
def test_a_manifest_that_the_model_refuses_is_invalid(sealed: Path, change: dict) -> None:
    manifest = json.loads((sealed / "manifest.json").read_text()) | change
    assert not validator("manifest.schema.json").is_valid(manifest)


def test_the_built_in_profiles_are_valid() -> None:
    profiles = list((Path(volprep.__file__).parent / "scene" / "profiles").glob("*.toml"))
    assert profiles
    for path in profiles:
        validator("profile.schema.json").validate(tomllib.loads(path.read_text(encoding="utf-8")))


def test_a_scene_is_valid_and_one_with_a_misspelt_key_is_not() -> None:
    point = {"value": 1.0, "colour": "#ffffff", "extinction_per_mm": 0.5}
    scene = {"name": "head", "source": {"path": "scan"}, "transfer": [{"name": "skin", "points": [point]}]}
    assert Scene.model_validate(scene)
    validator("scene.schema.json").validate(scene)
    misspelt = scene | {"tolerence": {}}
    assert not validator("scene.schema.json").is_valid(misspelt)
    with pytest.raises(ValidationError):
        Scene.model_validate(misspelt)


def tool(name: str, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    return importlib.import_module(name)


def test_the_schema_of_the_javascript_reader_is_that_of_the_models(monkeypatch: pytest.MonkeyPatch) -> None:
    module = tool("make_js_schema", monkeypatch)
    assert module.TARGET.read_text(encoding="utf-8") == module.schema_text(), "run python tools/make_js_schema.py"


def test_the_records_of_the_csharp_reader_are_those_of_the_models(monkeypatch: pytest.MonkeyPatch) -> None:
    module = tool("make_cs_schema", monkeypatch)
    assert module.TARGET.read_text(encoding="utf-8") == module.records_text(), "run python tools/make_cs_schema.py"


def test_the_structs_and_tables_of_the_c_header_are_those_of_the_models(monkeypatch: pytest.MonkeyPatch) -> None:
    module = tool("make_c_schema", monkeypatch)
    text = module.TARGET.read_text(encoding="utf-8")
    assert text == module.header_text(text), "run python tools/make_c_schema.py"


def test_a_field_that_the_c_header_cannot_read_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    header = tool("make_c_schema", monkeypatch).Header()
    for field in (
        {"type": "integer", "minimum": 0},
        {"type": "string", "pattern": "^x$"},
        {"type": "string", "maxLength": 9},
    ):
        with pytest.raises(ValueError, match=r"integer|string"):
            header.member("Level.filter", field)
