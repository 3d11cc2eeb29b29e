"""The gallery of the documentation: one brain drawn in several ways, in `<volume-viewer>`, as a web page would have it.

Each entry is the scene sample_specs/brain-mr.toml with some lines more. Packages lie in build/gallery, and are built
only if they are missing or the scene has changed.
"""

import hashlib
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from fetch_scan import BRAIN, fetch

ROOT = Path(__file__).parents[1]
SCENE = ROOT / "sample_specs" / "brain-mr.toml"
MADE = ROOT / "build" / "gallery"
_SCRIPT = """\
<script type="module">
import "./js/element.js";
// A browser keeps few contexts of WebGL: a package is loaded when a reader comes to it.
const seen = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (isIntersecting) target.setAttribute("src", target.dataset.src);
    else target.removeAttribute("src");
  }
});
for (const viewer of document.querySelectorAll("volume-viewer")) seen.observe(viewer);
</script>"""


@dataclass(frozen=True)
class Entry:
    """A way to draw the brain."""

    name: str
    """Name of its files."""
    title: str
    caption: str
    lines: str
    """Lines of TOML that the scene gets."""

    @property
    def scene(self) -> str:
        """The text of the scene; the scan is named on the command line."""
        text = SCENE.read_text(encoding="utf-8").replace('format = "dicom"\n', "")
        return f"{text}\n{self.lines}\n"

    @property
    def package(self) -> Path:
        """The package, in one file."""
        return MADE / f"{self.name}-{hashlib.sha256(self.scene.encode()).hexdigest()[:12]}.volpkg.zip"


ENTRIES = (
    Entry("absorption", "Emission and absorption", "Each sample emits light and absorbs light from behind it.", ""),
    Entry(
        "photograph",
        "Baked light",
        "Light that is scattered many times, computed when the package is built and stored as one small texture.",
        '[lighting]\nbaked = "scattering"\nsky = [0.7, 0.7, 0.7]\nground = [0.35, 0.35, 0.35]\n'
        "suns = [{ direction = [-1.0, -1.5, 1.2], colour = [0.6, 0.6, 0.6], size_degrees = 20.0 }]",
    ),
    Entry(
        "headlight",
        "Headlight",
        "Diffuse light from where the viewer is, with normals from a second texture.",
        '[render]\nlighting = "headlight"',
    ),
    Entry("maximum", "Maximum", "The largest value along each ray.", '[render]\ncompositing = "maximum"'),
    Entry(
        "slices",
        "Slices across the view",
        "The volume as a stack of textured polygons, which also old devices draw.",
        '[render]\ntechnique = "view-slices"',
    ),
    Entry(
        "preintegrated",
        "Pre-integrated",
        "Each segment of a ray is classified by the integral of the transfer function, with steps twice as long.",
        '[render]\nclassification = "preintegrated"',
    ),
)


def write_gallery(folder: Path) -> None:
    """Write the page (README.md), its packages with a picture of each, and the modules that draw them to `folder`."""
    MADE.mkdir(parents=True, exist_ok=True)
    folder.mkdir()
    for entry in ENTRIES:
        if not entry.package.exists():
            _build(entry)
        shutil.copy(entry.package, folder / f"{entry.name}.volpkg.zip")
        shutil.copy(entry.package.with_suffix(".png"), folder / f"{entry.name}.png")
    (folder / "README.md").write_text(_page(), encoding="utf-8")
    shutil.copytree(ROOT / "formats" / "js", folder / "js", ignore=shutil.ignore_patterns("node_modules", "types"))


def _page() -> str:
    viewers = (
        f"## {entry.title}\n\n{entry.caption}\n\n"
        + (f"```toml\n{entry.lines}\n```\n\n" if entry.lines else "")
        + f'<volume-viewer data-src="{entry.name}.volpkg.zip" poster="{entry.name}.png" label="{entry.title}" controls>'
        "</volume-viewer>"
        for entry in ENTRIES
    )
    head = (
        "# Gallery\n\nThe MNI152 brain in several ways. Drag to turn it. Each box is a "
        "[`<volume-viewer>`](../formats/js/README.md) with a package that `volprep build` made; the lines above it are "
        "what its scene has in addition to `sample_specs/brain-mr.toml`."
    )
    return "\n\n".join((head, *viewers, _SCRIPT))


def _build(entry: Entry) -> None:
    scene, package = MADE / f"{entry.name}.toml", MADE / f"{entry.name}.volpkg"
    scene.write_text(entry.scene, encoding="utf-8")
    print(f"gallery: {entry.title}", flush=True)
    _volprep("build", scene, "--source", fetch(BRAIN), "-o", package, "--force")
    _volprep("render", package, "-o", entry.package.with_suffix(".png"), "--view", "anterior-left")
    _volprep("zip", package, "-o", entry.package, "--force")


def _volprep(*arguments: str | Path) -> None:
    subprocess.run([Path(sys.executable).with_name("volprep"), *arguments, "-q"], check=True)
