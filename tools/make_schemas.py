"""Write formats/schemas/*.json from the models that they describe. A test compares the files; run this when it fails.

python tools/make_schemas.py
"""

from pathlib import Path

from json_lines import json_lines
from pydantic import BaseModel
from scene_schema import scene_schema

from volprep.judge.records import StoreFidelity
from volprep.lab.ablation.records import Ablation
from volprep.lab.curves.records import CurvesReport
from volprep.lab.stress.records import StressReport
from volprep.lab.walk.study import WalkReport
from volprep.plan.device_records import DeviceRecord
from volprep.scene.profiles import ProfileFile
from volprep.scene.scene import Scene
from volprep.validation.results.report import Report
from volprep.validation.results.truth import TruthIndex
from volprep_formats.package.look import VolumeLooks
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid

FOLDER = Path(__file__).parent.parent / "formats" / "schemas"
MODELS: dict[str, type[BaseModel]] = {
    "ablation.schema.json": Ablation,
    "device.schema.json": DeviceRecord,
    "fidelity.schema.json": StoreFidelity,
    "looks.schema.json": VolumeLooks,
    "manifest.schema.json": Manifest,
    "profile.schema.json": ProfileFile,
    "curves.schema.json": CurvesReport,
    "report.schema.json": Report,
    "scene.schema.json": Scene,
    "stress.schema.json": StressReport,
    "subvolumes.schema.json": SubvolumeGrid,
    "truth.schema.json": TruthIndex,
    "walk.schema.json": WalkReport,
}

_OTHERS = {
    "extras": {"description": "Data of one application. Readers ignore it."},
    "extensions": {"type": "object", "description": "Data of extensions, by their names. Readers ignore unknown ones."},
}
_OPEN: tuple[type[BaseModel], ...] = (Manifest, SubvolumeGrid)
"""Records of packages: each of their objects may have `extras` and `extensions`."""


def schema_text(model: type[BaseModel]) -> str:
    """JSON Schema (2020-12) of what a reader accepts, keys sorted, without titles that repeat the names of fields."""
    own = scene_schema() if model is Scene else model.model_json_schema()
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **own}
    for record in (schema, *schema.get("$defs", {}).values()):
        for field in record.get("properties", {}).values():
            field.pop("title", None)
        if model in _OPEN:
            record["properties"] |= _OTHERS
    return "\n".join(json_lines(schema)) + "\n"


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for name, model in MODELS.items():
        (FOLDER / name).write_text(schema_text(model), encoding="utf-8")
        print(FOLDER / name)


if __name__ == "__main__":
    main()
