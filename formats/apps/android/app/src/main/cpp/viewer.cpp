#include "viewer.h"

#include <GLES3/gl3.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>

[[noreturn]] static void fail(const char* what, const char* why) {
    throw std::runtime_error(std::string(what) + ": " + why);
}

#define VOLPKG_IMPLEMENTATION
#include "volpkg.h"
// Follows volpkg.h.
#include "example_gl.h"

namespace {

// The picture is linear light; screens take sRGB.
const char kVertex[] = R"(#version 300 es
in vec2 a_ndc;
void main() {
  gl_Position = vec4(a_ndc, 0.0, 1.0);
}
)";
const char kFragment[] = R"(#version 300 es
precision highp float;
uniform sampler2D u_picture;
uniform vec3 u_place;
out vec4 colour;
void main() {
  vec3 light = clamp(texture(u_picture, (gl_FragCoord.xy - u_place.xy) * u_place.z).rgb, 0.0, 1.0);
  colour = vec4(mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light)), 1.0);
}
)";

struct Viewer {
    std::unique_ptr<void, decltype(&std::free)> arena{nullptr, std::free};
    const volpkg_package* package = nullptr;
    volpkg_drawing drawing;
    double box_from_clip[16];
    scene drawn;
    GLuint present = 0;
    int x = 0, y = 0, side = 0;
} viewer;

// Rotate the camera around the middle of the volume, about an axis of length 1 in box space.
void rotate(const double axis[3], double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    for (int column = 0; column < 4; ++column) {
        double* at = viewer.box_from_clip + 4 * column;
        double from[3], along = 0;
        for (int i = 0; i < 3; ++i) {
            from[i] = at[i] - at[3] * viewer.drawing.grid->extent_mm_zyx[2 - i] / 2;
            along += axis[i] * from[i];
        }
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            const double across = axis[j] * from[k] - axis[k] * from[j];
            at[i] += c * from[i] + s * across + (1 - c) * along * axis[i] - from[i];
        }
    }
}

}  // namespace

void viewer_open(const void* data, std::size_t bytes) {
    volpkg_input input = {};
    volpkg_error error;
    input.data = static_cast<const unsigned char*>(data);
    input.size = bytes;
    const std::size_t needed = volpkg_input_arena_bytes(&input, &error);
    if (needed == 0) fail("package", error.text);
    viewer.arena.reset(std::malloc(needed));
    if (!viewer.arena) fail("package", "no memory");
    viewer.package = volpkg_open_input(&input, viewer.arena.get(), needed, &error);
    if (viewer.package == nullptr || volpkg_check_files(viewer.package, &error)) fail("package", error.text);
    if (viewer.package->profile.api != VOLPKG_API_ES3_0) fail("package", "it is not for OpenGL ES 3");
    if (volpkg_choose_frame(viewer.package, nullptr, -1, 0, &viewer.drawing, &error)) fail("package", error.text);
    volpkg_view(viewer.package, viewer.drawing.grid, "anterior-left", 1.0, viewer.box_from_clip);
}

void viewer_resize(int width, int height) {
    const volpkg_text vertex = {"present.vert", kVertex, sizeof kVertex - 1};
    const volpkg_text fragment = {"present.frag", kFragment, sizeof kFragment - 1};
    viewer.side = std::min(width, height);
    viewer.x = (width - viewer.side) / 2, viewer.y = (height - viewer.side) / 2;
    viewer.present = link_program(&vertex, &fragment);
    prepare(&viewer.drawn, &viewer.drawing, viewer.side);
}

void viewer_turn(float across, float down) {
    const double* right = viewer.box_from_clip;
    const double length = std::sqrt(right[0] * right[0] + right[1] * right[1] + right[2] * right[2]);
    const double side[3] = {right[0] / length, right[1] / length, right[2] / length};
    double head[3];  // of the patient, in box space
    for (int i = 0; i < 3; ++i) head[i] = viewer.drawing.grid->direction[2][i];
    rotate(side, -down);
    rotate(head, -across);
}

void viewer_draw() {
    const volpkg_drawing* drawing = &viewer.drawing;
    volpkg_error error;
    GLint screen = 0;
    glGetIntegerv(GL_FRAMEBUFFER_BINDING, &screen);
    if (volpkg_begin_frame(drawing, viewer.box_from_clip, volpkg_step_mm(drawing), viewer.side, viewer.side,
                           &viewer.drawn.frame, &error))
        fail("picture", error.text);
    draw_program(&viewer.drawn);
    glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(screen));
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glViewport(viewer.x, viewer.y, viewer.side, viewer.side);
    glUseProgram(viewer.present);
    glActiveTexture(GL_TEXTURE0 + VOLPKG_MAX_UNITS - 1);
    glBindTexture(GL_TEXTURE_2D, viewer.drawn.picture.texture);
    glUniform1i(glGetUniformLocation(viewer.present, "u_picture"), VOLPKG_MAX_UNITS - 1);
    glUniform3f(glGetUniformLocation(viewer.present, "u_place"), static_cast<float>(viewer.x),
                static_cast<float>(viewer.y), 1.0f / static_cast<float>(viewer.side));
    static const float corners[6] = {-1, -1, 3, -1, -1, 3};
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, corners);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glBindTexture(GL_TEXTURE_2D, 0);
}
