"""A measurement of a device, as the page of volprep view writes it."""

import json
from copy import deepcopy

_RECORD = {
    "format": "volprep-device",
    "version": "1.1",
    "generator": "volprep 0.1.0",
    "package": {
        "name": "phantom",
        "manifest_sha256": "0" * 64,
        "profile": "gles3",
        "step_mm": 0.5,
        "sources": [{"channel": "scan", "sha256": "1" * 64}],
    },
    "device": {
        "gpu": "Adreno (TM) 750",
        "vendor": "Qualcomm",
        "api": "webgl2",
        "browser": "Chrome 156",
        "platform": "Android",
        "pixel_ratio": 3.0,
    },
    "probes": [{"name": "r8unorm", "passed": True, "note": ""}],
    "picture_size": 48,
    "timing": "fence",
    "programs": [
        {
            "program": "raycast-shell",
            "transfer": "shell",
            "level": 0,
            "views": [{"view": "anterior", "rmse": 0.002, "seen_rmse": 0.004, "maximum": 0.1}],
            "sweep_view": "anterior-left",
            "points": [
                {"level": 0, "step_mm": 0.25, "rmse": 0.001, "seen_rmse": 0.002, "maximum": 0.1,
                 "draw_ms": 80.0, "fastest_ms": 78.0, "slowest_ms": 82.0, "draws": 15},
                {"level": 0, "step_mm": 0.5, "rmse": 0.002, "seen_rmse": 0.004, "maximum": 0.1,
                 "draw_ms": 40.0, "fastest_ms": 39.0, "slowest_ms": 41.0, "draws": 15},
                {"level": 0, "step_mm": 1.0, "rmse": 0.005, "seen_rmse": 0.01, "maximum": 0.2,
                 "draw_ms": 20.0, "fastest_ms": 19.0, "slowest_ms": 34.0, "draws": 15},
                {"level": 1, "step_mm": 0.5, "rmse": 0.004, "seen_rmse": 0.008, "maximum": 0.2,
                 "draw_ms": 30.0, "fastest_ms": 29.5, "slowest_ms": 31.0, "draws": 15},
                {"level": 1, "step_mm": 1.0, "rmse": 0.007, "seen_rmse": 0.014, "maximum": 0.2,
                 "draw_ms": 15.0, "fastest_ms": 14.5, "slowest_ms": 15.5, "draws": 15},
            ],
            "levels": [
                {"level": 0, "form": "ray-casting, R8 3D texture", "upload_bytes": 90_000, "gpu_bytes": 90_000},
                {"level": 1, "form": "ray-casting, R8 3D texture", "upload_bytes": 40_000, "gpu_bytes": 40_000},
            ],
            "sizes": [
                {"size": 48, "draw_ms": 40.0, "fastest_ms": 39.0, "slowest_ms": 41.0, "draws": 15},
                {"size": 96, "draw_ms": 148.0, "fastest_ms": 145.0, "slowest_ms": 152.0, "draws": 15},
                {"size": 192, "draw_ms": 580.0, "fastest_ms": 570.0, "slowest_ms": 590.0, "draws": 10},
            ],
        }
    ],
    "throttling": {"first_ms": 40.0, "last_ms": 41.0},
    "left_out": [],
    "seconds": 21.5,
}  # fmt: skip


def device_record_text(**changes: object) -> str:
    """The JSON text of a measurement; changes replace fields of it or of its package."""
    record = deepcopy(_RECORD)
    for name, value in changes.items():
        place = record["package"] if name in record["package"] else record
        place[name] = value
    return json.dumps(record)
