"""Two command lines for each verb, shown at the end of its help."""

EXAMPLES: dict[str, tuple[str, str]] = {
    "batch": ("volprep batch SCANS -o PACKAGES --dry-run", "volprep batch jobs.csv -o PACKAGES --validate"),
    "build": ("volprep build head.nii.gz -o head.volpkg", "volprep build scene.toml --profile gles2-2048 -o a.volpkg"),
    "cut": ("volprep cut a.volpkg --center 40,50,60 -o cut", "volprep cut a.volpkg --center 1,2,3 --world -o cut"),
    "doctor": ("volprep doctor", "volprep doctor --json"),
    "export": ("volprep export head.volpkg head.nrrd", "volprep export head.volpkg coarse.nii.gz --level 1"),
    "import": ("volprep import DICOM --list", "volprep import scene.toml -o draft.volpkg"),
    "inspect": ("volprep inspect head.volpkg", "volprep inspect head.volpkg --json"),
    "judge": (
        "volprep judge head.ome.zarr --look scene.toml",
        "volprep judge head.volpkg --look bone.toml -o bone.json",
    ),
    "look": ("volprep look head.nii.gz", "volprep look DICOM --series 203 -o look.png"),
    "plan": ("volprep plan scene.toml", "volprep plan head.nii.gz --profile gles2-2048"),
    "presets": ("volprep presets", "volprep presets head.nii.gz -o pictures"),
    "render": ("volprep render head.volpkg -o head.png", "volprep render head.volpkg --view left -o left.png"),
    "stage": ("volprep stage quantize draft.volpkg --bits 8", "volprep stage skip --help"),
    "study": ("volprep study curves head.volpkg -o curves", "volprep study stress"),
    "validate": ("volprep validate head.volpkg", "volprep validate head.volpkg --source scene.toml --json"),
    "view": ("volprep view head.volpkg", "volprep view head.volpkg -o head.html"),
    "zip": ("volprep zip head.volpkg", "volprep zip head.volpkg --texels zstd -o head.volpkg.zip"),
}
