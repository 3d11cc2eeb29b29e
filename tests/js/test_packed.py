"""The folder for npm, installed from its tarball: in bundlers, by a bare import map, in React, in TypeScript."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_line import ended
from npm_package import npm_package
from web_server import WebServer

ROOT = Path(__file__).parents[2]
JS = ROOT / "formats" / "js"
HEAD = "<!doctype html><meta charset=utf-8><title>app</title><link rel=icon href='data:,'>"
APP = """import { createRenderer, openPackage } from "volpkg";
import { Orbit } from "volpkg/camera";
import "volpkg/element";

const gl = document.createElement("canvas").getContext("webgl2");
const renderer = await createRenderer(gl, await openPackage("/package/p.volpkg"));
await renderer.ready;
renderer.draw({ boxFromClip: new Orbit(renderer.grid).boxFromClip(1) });
const { pixels } = renderer.readPixels();
const viewer = document.createElement("volume-viewer");
viewer.style.width = "64px";
viewer.setAttribute("controls", "");
viewer.setAttribute("src", "/package/p.volpkg.zip");
document.body.append(viewer);
await new Promise((resolve) => viewer.addEventListener("load", resolve));
await viewer.renderer.ready;
window.done = { level: renderer.level, seen: pixels.some((each) => each > 0.1), element: viewer.renderer.level };
"""
FIBER = """import * as React from "react";
import { createRoot, extend, useThree } from "@react-three/fiber";
import * as THREE from "three";
import { loadVolume } from "volpkg/three";

extend(THREE);
function Head() {
  const gl = useThree((state) => state.gl);
  const invalidate = useThree((state) => state.invalidate);
  const [volume, setVolume] = React.useState(null);
  React.useEffect(() => {
    let made = null;
    loadVolume(gl, "/package/p.volpkg").then((each) => {
      made = each;
      each.addEventListener("change", () => invalidate());
      setVolume(each);
    });
    return () => made?.dispose();
  }, [gl]);
  window.volume = volume;
  return volume && React.createElement("primitive", { object: volume });
}
const canvas = document.body.appendChild(document.createElement("canvas"));
const root = createRoot(canvas);
await root.configure({ gl: { preserveDrawingBuffer: true }, size: { width: 60, height: 60, top: 0, left: 0 }, dpr: 1 });
root.render(React.createElement(Head));
const wait = () => new Promise((resolve) => setTimeout(resolve, 30));
while (!window.volume) await wait();
await window.volume.renderer.ready;
const { camera, invalidate } = root.render(React.createElement(Head)).getState();
camera.position.set(0, 0, 4 * window.volume.radius);
camera.far = 5000;
camera.lookAt(0, 0, 0);
camera.updateProjectionMatrix();
const gl = canvas.getContext("webgl2");
const pixels = new Uint8Array(4 * 60 * 60);
for (let turn = 0; turn < 200 && !pixels.some((each, i) => i % 4 < 3 && each > 60); turn++) {
  invalidate();
  await wait();
  gl.readPixels(0, 0, 60, 60, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
}
window.done = { level: window.volume.renderer.level, seen: pixels.some((each, i) => i % 4 < 3 && each > 60) };
"""
WAIT = """
for (let turn = 0; turn < 600 && !window.done; turn++) await new Promise((resolve) => setTimeout(resolve, 50));
return window.done ?? null;
"""


@dataclass
class App:
    """A folder into which the tarball was installed."""

    folder: Path
    """With node_modules."""

    def run(self, *command: object, **environment: str) -> None:
        """Run a tool of node in the folder."""
        settings = {**os.environ, **environment}
        words = ["node", *map(str, command)]
        done = ended(words, cwd=self.folder, env=settings)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def app(tmp_path_factory) -> App:
    """The folder for npm with its types, packed and installed. Nothing is asked of the registry for it."""
    folder: Path = tmp_path_factory.mktemp("app")
    npm_package("typescript", "7.0.2")
    # The commands that the README tells a reader.
    text = (JS / "README.md").read_text()
    pack, install = re.search(r"^```sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)[1].strip().splitlines()
    pack = pack.replace("python ", f"{sys.executable} ").replace("out/volpkg", f"{folder}/out/volpkg")
    pack = pack.replace("--pack-destination out ./", f"--silent --pack-destination {folder} ")
    subprocess.run(["bash", "-c", pack], cwd=ROOT, check=True, timeout=120)
    tarball = re.search(r"out/(volpkg-[\d.]+\.tgz)", install)[1]
    assert (folder / tarball).is_file()
    shutil.rmtree(folder / "out")
    found = App(folder)
    npm = shutil.which("npm")
    (folder / "package.json").write_text('{"private": true, "type": "module"}')
    install = [
        npm,
        "install",
        "--offline",
        "--no-audit",
        "--no-fund",
        "--ignore-scripts",
        "--omit=peer",
        f"./{tarball}",
    ]
    subprocess.run(install, cwd=folder, check=True, capture_output=True, timeout=60)
    (folder / "app.js").write_text(APP)
    (folder / "index.html").write_text(f'{HEAD}<script type="module" src="./app.js"></script>')
    return found


def shown(browser, package: Path, folder: Path) -> object:
    """What a page says when it is done."""
    with WebServer({"app": folder, "package": package}) as server:
        browser.open(f"{server.url}/app/index.html")
        found = browser.run(WAIT)
        assert found is not None, browser.console
        return found


@pytest.fixture(scope="module")
def package(scene_package, app) -> Path:
    """Folder of a package and of its zip."""
    from volprep_formats.package.storage.files import MANIFEST
    from volprep_formats.package.storage.single_file import write_single_file
    from volprep_formats.progress import Silent

    found = scene_package("lit, skips by distance")
    names = [MANIFEST, *(record.path for record in found.manifest.files)]
    with (found.path.parent / "p.volpkg.zip").open("wb") as file:
        write_single_file(found.path, names, file, Silent())
    return Path(found.path.parent)


ALL = {"level": 0, "seen": True, "element": 0}


@pytest.mark.long
def test_a_bare_import_map_finds_everything(browser, app, package) -> None:
    site = app.folder / "bare"
    shutil.copytree(app.folder / "node_modules" / "volpkg", site / "volpkg")
    exports = json.loads((site / "volpkg" / "package.json").read_text())["exports"]
    names = {f"volpkg{name[1:]}": f"./volpkg{each['default'][1:]}" for name, each in exports.items()}
    listed = json.dumps({"imports": names})
    script = '<script type="module" src="./app.js"></script>'
    (site / "index.html").write_text(f'{HEAD}<script type="importmap">{listed}</script>{script}')
    (site / "app.js").write_text(APP)
    assert shown(browser, package, site) == ALL


@pytest.mark.long
def test_esbuild_bundles_it(browser, app, package) -> None:
    esbuild = npm_package("esbuild", "0.25.0") / "node_modules" / "esbuild" / "bin" / "esbuild"
    out = app.folder / "esbuild"
    options = ("--bundle", "--format=esm", "--splitting", "--minify", f"--outdir={out}")
    subprocess.run([esbuild, "app.js", *options], cwd=app.folder, check=True, capture_output=True, timeout=60)
    shutil.copy(app.folder / "index.html", out)
    assert shown(browser, package, out) == ALL


@pytest.mark.long
def test_vite_builds_it(browser, app, package) -> None:
    vite = npm_package("vite", "7.3.0") / "node_modules" / "vite" / "bin" / "vite.js"
    app.run(vite, "build", "--base", "./", "--outDir", "vite", "--logLevel", "error")
    assert list((app.folder / "vite" / "assets").glob("worker*")), "the worker is a file of its own"
    assert shown(browser, package, app.folder / "vite") == ALL


@pytest.mark.long
def test_react_three_fiber_draws_it(browser, app, package) -> None:
    modules = npm_package("@react-three/fiber", "9.4.0") / "node_modules"
    esbuild = npm_package("esbuild", "0.25.0") / "node_modules" / "esbuild" / "bin" / "esbuild"
    out = app.folder / "fiber"
    (app.folder / "fiber.js").write_text(FIBER)
    options = (
        "--bundle",
        "--format=esm",
        "--splitting",
        f"--outdir={out}",
        '--define:process.env.NODE_ENV="production"',
    )
    environment = {**os.environ, "NODE_PATH": str(modules)}
    done = ended([esbuild, "fiber.js", *options], cwd=app.folder, env=environment)
    assert done.returncode == 0, done.stderr
    (out / "index.html").write_text(f'{HEAD}<body><script type="module" src="./fiber.js"></script>')
    assert shown(browser, package, out) == {"level": 0, "seen": True}


TYPED = """import { openPackage, createRenderer, type Package, type Renderer } from "volpkg";
import { VolumeViewer } from "volpkg/element";
const pack: Package = await openPackage("head.volpkg");
const gl = document.createElement("canvas").getContext("webgl2")!;
const renderer: Renderer = await createRenderer(gl, pack);
const same: Package = renderer.package;
const first: number = renderer.points[0].value;
await renderer.setWindow({ level: first, width: 100 });
const target: EventTarget = renderer;
target.addEventListener("change", () => renderer.draw({ boxFromClip: new Array(16).fill(0) }));
const viewer = document.querySelector<VolumeViewer>("volume-viewer")!;
await viewer.open(new Blob());
const mm: number = (await renderer.slice({ plane: "axial" }))!.pixel_mm;
// @ts-expect-error a plane is one of three
await renderer.slice({ plane: "oblique" });
// @ts-expect-error a window has a width
await renderer.setWindow({ level: 3 });
export { mm, same };
"""

IN_A_SCENE = """
import * as THREE from "three";
import { Volume, loadVolume } from "volpkg/three";

const renderer = new THREE.WebGLRenderer();
const [scene, camera] = [new THREE.Scene(), new THREE.PerspectiveCamera()];
const volume: Volume = await loadVolume(renderer, "head.volpkg");
volume.addEventListener("change", () => renderer.render(scene, camera));
volume.material.opacity = 0.5;
const other: Volume = volume.clone();
scene.add(volume, other);
// @ts-expect-error there is no such event
volume.addEventListener("changed", () => {});
export {};
"""


@pytest.mark.long
def test_the_examples_of_the_readme_and_typed_apps_compile(app) -> None:
    tsc = npm_package("typescript", "7.0.2") / "node_modules" / "typescript" / "bin" / "tsc"
    types = npm_package("@types/three", "0.187.0") / "node_modules" / "@types"
    folder = app.folder / "typed"
    folder.mkdir()
    examples = re.findall(r"^ *```js\n(.*?)^ *```$", (JS / "README.md").read_text(), re.MULTILINE | re.DOTALL)
    assert len(examples) >= 3
    for i, text in enumerate(examples):
        # What readers have at hand in a line that is a part of a program.
        given = "declare const gl: any, pack: any, createRenderer: any;\n" if "draco" in text else ""
        (folder / f"readme{i}.ts").write_text(f"{given}{text}\nexport {{}};\n")
    (folder / "app.ts").write_text(TYPED)
    (folder / "scene.ts").write_text(IN_A_SCENE)
    (folder / "draco3d.d.ts").write_text('declare module "draco3d";\n')
    common = {"target": "es2022", "module": "es2022", "moduleResolution": "bundler", "noEmit": True, "types": []}
    paths = {"three": [str(types / "three")]}
    lib = ["es2022", "dom", "dom.iterable"]
    for name, files in (("app", ["app.ts", "scene.ts"]), ("readme", ["readme*.ts", "draco3d.d.ts"])):
        # Declarations are checked too, which is what TypeScript does unless it is told otherwise.
        options = {**common, "strict": True, "skipLibCheck": False, "paths": paths, "lib": lib}
        (folder / f"{name}.json").write_text(json.dumps({"compilerOptions": options, "include": files}))
        app.run(tsc, "-p", folder / f"{name}.json")
