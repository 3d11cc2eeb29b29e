// Draws as the Android sample does, without a window: PACKAGE PIXELS SIDE ACROSS DOWN; writes sRGB bytes, row 0 below.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <vector>

#include "viewer.h"
#include "volpkg.h"
// Follows volpkg.h.
#include "example_offscreen.h"

int main(int, char** words) {
    const int side = std::atoi(words[3]), width = side + 10;
    volpkg_mapping file;
    volpkg_error error;
    if (volpkg_map(words[1], &file, &error)) fail(words[1], error.text);
    open_context(3);
    GLuint screen, colour;
    glGenRenderbuffers(1, &colour);
    glBindRenderbuffer(GL_RENDERBUFFER, colour);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, side);
    glGenFramebuffers(1, &screen);
    glBindFramebuffer(GL_FRAMEBUFFER, screen);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour);
    try {
        viewer_open(file.data, file.size);
        viewer_resize(width, side);
        glBindFramebuffer(GL_FRAMEBUFFER, screen);
        viewer_draw();
        viewer_turn(static_cast<float>(std::atof(words[4])), static_cast<float>(std::atof(words[5])));
        viewer_draw();
    } catch (const std::exception& thrown) {
        fail("viewer", thrown.what());
    }
    std::vector<unsigned char> pixels(4 * static_cast<std::size_t>(side) * side);
    glReadPixels(5, 0, side, side, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    if (glGetError() != GL_NO_ERROR) fail("OpenGL ES", "an error while drawing");
    FILE* out = std::fopen(words[2], "wb");
    std::fwrite(pixels.data(), 1, pixels.size(), out);
    std::fclose(out);
    return 0;
}
