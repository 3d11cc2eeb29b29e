"""The Android sample: its C++ draws the sample packages on this machine, and its Java compiles and calls it.

There is no NDK here: C++ is compiled by the compiler of this machine, Java against the few lines of Android below.
"""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from format_samples import LARGEST, SAMPLES, SIDE, Sample, differing

from volprep.render.renderer import Renderer
from volprep_formats.package.reader import Package

ROOT = Path(__file__).parents[2]
APP = ROOT / "formats" / "apps" / "android" / "app" / "src" / "main"
SOURCES = APP / "cpp"
FLAGS = ("-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-I", ROOT / "formats" / "c")
STUBS = {
    "android/os/Bundle": "public class Bundle {}",
    "android/content/Context": "public class Context {}",
    "android/app/Activity": """public class Activity extends android.content.Context {
        protected void onCreate(android.os.Bundle state) {}
        protected void onPause() {}
        protected void onResume() {}
        public void setContentView(android.view.View view) {}
        public android.content.res.AssetManager getAssets() { return null; } }""",
    "android/content/res/AssetManager": """public class AssetManager {
        public AssetFileDescriptor openFd(String name) throws java.io.IOException { return null; } }""",
    "android/content/res/AssetFileDescriptor": """public class AssetFileDescriptor implements java.io.Closeable {
        public java.io.FileDescriptor getFileDescriptor() { return null; }
        public long getStartOffset() { return 0; }
        public long getLength() { return 0; }
        public void close() throws java.io.IOException {} }""",
    "android/widget/Toast": """public class Toast {
        public static final int LENGTH_LONG = 1;
        public static Toast makeText(android.content.Context context, CharSequence text, int time) { return null; }
        public void show() {} }""",
    "android/util/Log": "public class Log { public static int e(String tag, String text) { return 0; } }",
    "android/view/MotionEvent": """public class MotionEvent {
        public static final int ACTION_MOVE = 2;
        public float getX() { return 0; }
        public float getY() { return 0; }
        public int getActionMasked() { return 0; } }""",
    "android/view/View": """public class View {
        public boolean onTouchEvent(MotionEvent event) { return false; }
        public int getWidth() { return 0; }
        public int getHeight() { return 0; } }""",
    "android/opengl/GLSurfaceView": """public class GLSurfaceView extends android.view.View {
        public static final int RENDERMODE_WHEN_DIRTY = 0;
        public GLSurfaceView(android.content.Context context) {}
        public void setEGLContextClientVersion(int version) {}
        public void setRenderer(Renderer renderer) {}
        public void setRenderMode(int mode) {}
        public void requestRender() {}
        public void queueEvent(Runnable work) {}
        public void onPause() {}
        public void onResume() {}
        public interface Renderer {
          void onSurfaceCreated(javax.microedition.khronos.opengles.GL10 gl,
              javax.microedition.khronos.egl.EGLConfig config);
          void onSurfaceChanged(javax.microedition.khronos.opengles.GL10 gl, int width, int height);
          void onDrawFrame(javax.microedition.khronos.opengles.GL10 gl); } }""",
    "javax/microedition/khronos/egl/EGLConfig": "public class EGLConfig {}",
    "javax/microedition/khronos/opengles/GL10": "public interface GL10 {}",
    "org/volprep/viewer/Host": """public class Host {
        public static void main(String[] names) throws Exception {
          for (String name : names)
            try (java.io.FileInputStream file = new java.io.FileInputStream(name)) {
              System.out.println("[" + Volume.open(file.getChannel().map(
                  java.nio.channels.FileChannel.MapMode.READ_ONLY, 0, file.getChannel().size())) + "]"); } } }""",
}


def ran(*command: object) -> str:
    environment = os.environ | {"EGL_PLATFORM": "surfaceless", "GALLIVM_PERF": "no_aos_sampling"}
    done = subprocess.run([*map(str, command)], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    if shutil.which("g++") is None:
        pytest.skip("there is no g++")
    target = tmp_path_factory.mktemp("android") / "viewer"
    sources = (SOURCES / "viewer.cpp", Path(__file__).with_name("android_host.cpp"))
    ran("g++", *FLAGS, "-I", SOURCES, *sources, "-o", target, "-lEGL", "-lGLESv2")
    return target


def pictured(program: Path, folder: Path, sample: Sample, across: float = 0.0, down: float = 0.0) -> np.ndarray:
    ran(program, sample.package, folder / "pixels", SIDE, across, down)
    return np.fromfile(folder / "pixels", np.uint8).reshape(SIDE, SIDE, 4)[::-1, :, :3].astype(int)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("name", ["scan", "segments", "two-channels", "colour", "baked-light", "proxy", "bricks"])
def test_the_app_draws_the_picture_of_a_sample(program: Path, name: str, tmp_path: Path) -> None:
    sample = SAMPLES[name]
    assert differing(pictured(program, tmp_path, sample), sample) <= LARGEST


def test_a_finger_turns_the_volume_around_the_head_and_the_right_hand(program: Path, tmp_path: Path) -> None:
    sample = SAMPLES["oblique"]
    package = Package.open(sample.package)
    grid = package.manifest.grid
    assert grid is not None
    across, down = 0.7, 0.4
    found = pictured(program, tmp_path, sample, across, down)

    def turned(axis: np.ndarray, angle: float) -> np.ndarray:
        """Return a rotation around the middle, in box space."""
        x, y, z = axis / np.linalg.norm(axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        middle = np.array(grid.extent_mm_zyx[::-1]) / 2
        matrix = np.eye(4)
        matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        matrix[:3, 3] = middle - matrix[:3, :3] @ middle
        return matrix

    view = turned(sample.box_from_clip[:3, 0], -down) @ sample.box_from_clip
    view = turned(grid.world_from_box[2, :3], -across) @ view
    with Renderer(package) as renderer:
        light = renderer.render(view, (SIDE, SIDE))[..., :3].clip(0, 1)
    wanted = 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(found - sample.pixels()).max() > 50
    assert np.abs(found - wanted).max() < 3


def test_java_compiles_against_android_and_opens_a_package(tmp_path: Path) -> None:
    javac = shutil.which("javac")
    if javac is None:
        pytest.skip("there is no Java compiler")
    include = Path(javac).resolve().parents[1] / "include"
    if not (include / "jni.h").is_file():
        pytest.skip("the Java here has no jni.h")
    for name, text in STUBS.items():
        path = tmp_path / "stubs" / f"{name}.java"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"package {Path(name).parent.as_posix().replace('/', '.')};\n{text}\n")
    sources = [*(APP / "java").rglob("*.java"), *(tmp_path / "stubs").rglob("*.java")]
    ran(javac, "-Xlint:all", "-Werror", "-d", tmp_path / "classes", *sources)
    library = tmp_path / "libvolume.so"
    headers = ("-I", include, "-I", include / "linux")
    ran("g++", *FLAGS, *headers, "-fPIC", "-shared", *SOURCES.glob("*.cpp"), "-o", library, "-lGLESv2")
    damaged = tmp_path / "damaged.zip"
    data = bytearray(SAMPLES["scan"].package.read_bytes())
    data[len(data) // 2] ^= 1
    damaged.write_bytes(data)
    told = ran(
        Path(javac).with_name("java"), f"-Djava.library.path={tmp_path}", "-cp", tmp_path / "classes",
        "org.volprep.viewer.Host", SAMPLES["scan"].package, damaged,
    )  # fmt: skip
    sound, refused = told.splitlines()
    assert sound == "[]"
    assert refused.startswith("[package: VP4")
