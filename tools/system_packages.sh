#!/usr/bin/env bash
# Checks for what volprep needs from the system: the named things, or all. On Debian and its relatives it installs what is missing, as root or
# with sudo; anywhere else it says, one line for each missing thing, how to get it. Prints nothing if all is there.
#
# Usage: tools/system_packages.sh STAMP [THING...]; the file STAMP becomes newer when something was installed.
# Exit status: 0 all that must be is there; 1 the installation failed; 2 something is missing and cannot be installed
# from here.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1

compile() { "${CXX:-c++}" -x c++ -std=c++20 -fsyntax-only "$@" - >/dev/null 2>&1; }
has_library() { PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null | grep -F "$1 " >/dev/null; }

have_python() { tools/find_python.sh >/dev/null; }
have_compiler() { echo '#include <omp.h>' | compile -fopenmp; }
have_gles() { has_library libEGL.so.1 && has_library libGLESv2.so.2 && has_library libGLESv1_CM.so.1; }
have_mesa() {
    has_library libEGL_mesa.so.0 || return
    compgen -G '/usr/lib*/dri/swrast_dri.so' >/dev/null || compgen -G '/usr/lib/*/dri/swrast_dri.so' >/dev/null
}
have_gles_headers() { printf '#include <EGL/egl.h>\n#include <GLES3/gl3.h>\n' | compile; }
have_mingw() { command -v x86_64-w64-mingw32-gcc >/dev/null; }
have_glslang() { command -v glslangValidator >/dev/null; }
have_spirv_cross() { command -v spirv-cross >/dev/null; }
have_chromium() { command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null; }
have_firefox() { { command -v firefox-esr || command -v firefox; } >/dev/null && command -v Xvfb >/dev/null; }
have_mono() { command -v mcs >/dev/null && command -v mono >/dev/null; }
have_dcm2niix() { command -v dcm2niix >/dev/null; }
# Boost is asked for by name because Debian's libopenvdb-dev includes it without depending on it.
have_openvdb() {
    compile <<'EOF'
#if !__has_include(<openvdb/openvdb.h>) || !__has_include(<tbb/version.h>) || !__has_include(<boost/version.hpp>)
#error
#endif
EOF
}

# Each thing: its name above; what it is; its packages on Debian, Fedora, Arch and macOS ("-": not to be had there).
things=(
    "python|Python 3.11 to 3.13 with venv and C headers|python3 python3-venv python3-dev|python3.13 python3.13-devel|python313 (from the AUR)|python@3.13"
    "compiler|C++20 compiler with OpenMP|g++|gcc-c++|gcc|gcc"
    "gles|loader of EGL and OpenGL ES|libegl1 libgles2 libgles1|libglvnd-egl libglvnd-gles|libglvnd|-"
    "mesa|Mesa's software driver llvmpipe|libegl-mesa0 libgl1-mesa-dri|mesa-libEGL mesa-dri-drivers|mesa|-"
    "gles_headers|headers of EGL and OpenGL ES (only for tests)|libegl-dev libgles-dev|libglvnd-devel|libglvnd|-"
    "mingw|C compiler for Windows (only for a test of the C header)|gcc-mingw-w64-x86-64-win32|mingw64-gcc|mingw-w64-gcc|mingw-w64"
    "glslang|validator of shaders (only for tests)|glslang-tools|glslang|glslang|glslang"
    "spirv_cross|converter of shaders to HLSL (only for tests and tools/hlsl.py)|spirv-cross|-|spirv-cross|spirv-cross"
    "chromium|browser with WebGL (only for tests)|chromium|chromium|chromium|-"
    "firefox|Firefox, and a screen without a monitor (only for tests)|firefox-esr xvfb|firefox xorg-x11-server-Xvfb|firefox xorg-server-xvfb|-"
    "mono|C# compiler and runtime (only for a test of the reader for Unity)|mono-mcs mono-runtime|mono-core|mono|mono"
    "dcm2niix|another reader of DICOM, for comparison (only for tests)|dcm2niix|dcm2niix|dcm2niix (from the AUR)|dcm2niix"
    "openvdb|headers of OpenVDB, TBB and Boost (only for .vdb files)|libopenvdb-dev libtbb-dev libboost-dev|openvdb-devel tbb-devel boost-devel|openvdb onetbb boost|openvdb"
)

stamp=$1
mkdir -p "${stamp%/*}"
[ -e "$stamp" ] || touch "$stamp"
wanted=" ${*:2} "

# Sets `missing` to those of the wanted `things` that are not there.
look() {
    missing=()
    local thing
    for thing in "${things[@]}"; do
        [ "$wanted" = "  " ] || [[ $wanted == *" ${thing%%|*} "* ]] || continue
        "have_${thing%%|*}" || missing+=("$thing")
    done
}

# Says for each missing thing, after the words $1, the packages that are in field $2.
tell() {
    local thing field
    for thing in "${missing[@]}"; do
        IFS='|' read -ra field <<<"$thing"
        case ${field[$2]} in
            -) echo "volprep: missing: ${field[1]}. It is not to be had here; work in a Linux container." ;;
            *) echo "volprep: missing: ${field[1]}. $1 ${field[$2]}" ;;
        esac
    done >&2
    # All but the last nine must be there.
    case ${missing[0]} in
        gles_headers* | mingw* | glslang* | spirv_cross* | chromium* | firefox* | mono* | dcm2niix* | openvdb*) exit 0 ;;
    esac
    exit 2
}

install_on_debian() {
    local thing field package packages=() known=() sudo=()
    for thing in "${missing[@]}"; do
        IFS='|' read -ra field <<<"$thing"
        read -ra field <<<"${field[2]}"
        packages+=("${field[@]}")
    done
    if [ "$(id -u)" -ne 0 ]; then
        # Asks for a password where there is somebody to ask.
        if ! sudo -n true 2>/dev/null && ! { [ -t 0 ] && sudo -v; }; then
            tell "Neither root nor sudo here. Get it with: apt-get install --no-install-recommends" 2
        fi
        sudo=(sudo)
    fi
    echo "volprep: missing system packages: ${packages[*]}"
    tools/step.sh apt-update "reading Debian's package lists (usually 5 s)" "${sudo[@]}" apt-get -o Acquire::Retries=3 update || exit 1
    # Ubuntu has no firefox-esr: what apt does not know is told of later.
    for package in "${packages[@]}"; do
        apt-cache show "$package" >/dev/null 2>&1 && known+=("$package")
    done
    tools/step.sh apt-install "installing system packages (usually 15 to 40 s)" "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get -o Acquire::Retries=3 install --yes --no-install-recommends "${known[@]}" || exit 1
}

look
[ ${#missing[@]} -eq 0 ] && exit 0
if [ -r /etc/os-release ]; then
    # shellcheck source=/dev/null
    system=$(. /etc/os-release && echo "${ID:-} ${ID_LIKE:-}")
else
    system=$(uname -s)
fi
case " $system " in
    *" debian "*)
        install_on_debian
        touch "$stamp"
        look
        [ ${#missing[@]} -eq 0 ] || tell "This release has none that is new enough in its" 2
        ;;
    *" fedora "*) tell "Get it with: sudo dnf install" 3 ;;
    *" arch "*) tell "Get it with: sudo pacman -S" 4 ;;
    *" Darwin "*) tell "Get it with: brew install" 5 ;;
    *) tell "On Debian it is in:" 2 ;;
esac
