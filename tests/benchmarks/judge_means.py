"""Are means of blocks lossless where a pixel covers a voxel of their level? Ten scans, two looks, levels 1 and 2.

`python tests/benchmarks/judge_means.py FOLDER OUT` writes a table, and pictures side by side:
truth, level, five times the difference. Scans that the table has are left out.
"""

import json
import sys
from functools import cache, partial
from pathlib import Path

import numpy as np
from PIL import Image

from volprep.judge.measure import VIEWS, _judged, _picture
from volprep.truth.volume import Volume
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.path_text import path_text
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec
from volprep_formats.srgb import srgb_of_linear

SCANS = {
    "head, T1 (studyforrest)": "mr_t1_studyforrest/dicoms",
    "head, sagittal T1": "decubitus_hfp_sag/2_t1_fl2d_sag",
    "head, Colin 27": "nifti_ch2/ch2.nii.gz",
    "head, FLAIR": "flair_pair/FLAIR.nii.gz",
    "fly, micro-CT": "qim_microct/fly_150x256x256.tif",
    "shell, micro-CT": "qim_microct/shell_225x128x128.tif",
    "engine, CT": "engine_pair/png_stack",
    "head, FreeSurfer": "segments/norm.mgz",
    "smoke, simulated": "vdb/smoke.vdb",
    "phantom, MR": "orient48/nifti_space",
}


def means(values: np.ndarray) -> np.ndarray:
    padded = np.pad(values, [(0, n % 2) for n in values.shape], mode="edge")
    z, y, x = (n // 2 for n in padded.shape)
    return padded.reshape(z, 2, y, 2, x, 2).mean(axis=(1, 3, 5), dtype=np.float32)


def looks(values: np.ndarray) -> list[TransferFunction]:
    low, high = np.percentile(values[::2, ::2, ::2], [2, 99.5])
    places = {"surface": (0.3, 0.6, 0.5), "haze": (0.0, 1.0, 0.02)}

    def points(begin: float, end: float, extinction: float) -> tuple[TransferPoint, ...]:
        ends = ((begin, (0.6, 0.35, 0.25), 0.0), (end, (1.0, 0.95, 0.9), extinction))
        return tuple(
            TransferPoint(value=float(low + at * (high - low)), colour=colour, extinction_per_mm=each)
            for at, colour, each in ends
        )

    return [TransferFunction(name=name, points=points(*each)) for name, each in places.items()]


def main(folder: Path, out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    rows = json.loads((out / "means.json").read_text()) if (out / "means.json").exists() else []
    done = {row["scan"] for row in rows}
    for name, place in SCANS.items():
        if name in done:
            continue
        path = folder / place
        if place.startswith("orient48"):
            path = min(each for each in path.rglob("*") if each.is_file())
        with open_source(SourceSpec(path=path_text(path)), folder, Silent()) as source:
            info = source.info
            stored = source.read_slab(0, info.grid.shape_zyx[0]).astype(np.float32) * info.slope + info.intercept
        volumes = [Volume(np.ascontiguousarray(stored, np.float32), info.grid)]
        for level in (1, 2):
            volumes.append(Volume(means(volumes[-1].stored), info.grid.coarser((2**level,) * 3)))
        for function in looks(stored):
            truth_of = cache(partial(_picture, volumes[0], info.grid, function))
            for level in (1, 2):
                for each in _judged(volumes[level], level, info.grid, function, truth_of):
                    if each.pixels_per_voxel > 1:
                        continue
                    rows.append({"scan": name, **each.model_dump(mode="json")})
                    told = f"{each.rmse:.4f} kept {each.kept_contrast}"
                    print(name, function.name, level, each.pixels_per_voxel, each.pixels, told, flush=True)
            one = [row for row in rows if row["scan"] == name and row["look"] == function.name and row["level"] == 1]
            size = next((row["pixels"] for row in one if row["pixels_per_voxel"] == 1.0), None)
            if size:
                shown = [_picture(each, info.grid, function, VIEWS[0], size) for each in volumes[:2]]
                sheet = np.concatenate([*shown, np.abs(shown[0] - shown[1]) * 5], axis=1)[..., :3]
                file = f"{name.split(',')[0]}-{name.split()[-1].strip('()')}-{function.name}.png"
                encoded = np.rint(255 * srgb_of_linear(sheet.clip(0, 1))).astype(np.uint8)
                Image.fromarray(encoded).save(out / file)
        (out / "means.json").write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main(Path(sys.argv[1]).absolute(), Path(sys.argv[2]))
