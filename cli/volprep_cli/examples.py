"""Two command lines for each verb, shown at the end of its help."""


def _stage(verb: str, more: str = "--json") -> dict[str, tuple[str, str]]:
    """Return the examples of the verb of a single stage."""
    return {verb: (f"volprep {verb} draft.volpkg", f"volprep {verb} draft.volpkg {more}")}


EXAMPLES: dict[str, tuple[str, str]] = {
    "batch": (
        "volprep batch SCANS -o PACKAGES --dry-run",
        "volprep batch jobs.csv -o PACKAGES --validate",
    ),
    **_stage("bricks"),
    "build": (
        "volprep build head.nii.gz -o head.volpkg",
        "volprep build scene.toml --profile gles2-2048 -o a.volpkg",
    ),
    "cut": ("volprep cut a.volpkg --center 40,50,60 -o cut", "volprep cut a.volpkg --center 1,2,3 --world -o cut"),
    "doctor": ("volprep doctor", "volprep doctor --json"),
    "export": ("volprep export head.volpkg head.nrrd", "volprep export head.volpkg coarse.nii.gz --level 1"),
    **_stage("grid", "--size 96"),
    "import": ("volprep import DICOM --list", "volprep import scene.toml -o draft.volpkg"),
    "inspect": ("volprep inspect head.volpkg", "volprep inspect head.volpkg --json"),
    "look": ("volprep look head.nii.gz", "volprep look DICOM --series 203 -o look.png"),
    **_stage("mosaic"),
    **_stage("normals", "--kernel central"),
    "plan": ("volprep plan scene.toml", "volprep plan head.nii.gz --profile gles2-2048"),
    "presets": ("volprep presets", "volprep presets head.nii.gz -o pictures"),
    **_stage("proxy", "--form convex"),
    **_stage("pyramid", "--filter box"),
    **_stage("quantize", "--bits 8"),
    "render": (
        "volprep render head.volpkg -o head.png",
        "volprep render head.volpkg --view left -o left.png",
    ),
    **_stage("seal"),
    **_stage("shaders"),
    **_stage("skip", "--kind distance"),
    **_stage("slices"),
    "stress": ("volprep stress", "volprep stress --json"),
    **_stage("texture"),
    **_stage("transfer"),
    "validate": ("volprep validate head.volpkg", "volprep validate head.volpkg --source scene.toml --json"),
    "view": ("volprep view head.volpkg", "volprep view head.volpkg -o head.html"),
    "walk": ("volprep walk head.volpkg walk.toml -o pictures", "volprep walk head.volpkg walk.toml -o pictures --json"),
    "zip": ("volprep zip head.volpkg", "volprep zip head.volpkg --texels zstd -o head.volpkg.zip"),
}
