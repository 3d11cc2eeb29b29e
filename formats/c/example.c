/*
 * Draws one view of a package with OpenGL ES 1.1, 2 or 3, without a window, and writes a PNG.
 *
 *     cc -std=c99 example.c -o example -lEGL -lGLESv1_CM -lGLESv2 -lm
 *     ./example head.volpkg.zip head.png --view left --size 512
 *
 * What an app does is the same but for the context and the picture: open, choose, compile, upload once; set uniforms
 * and draw for each frame. Exit status: 0 drawn, 1 refused, with one line that says why.
 */
#define VOLPKG_IMPLEMENTATION
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES/gl.h>
#include <GLES/glext.h>
#include <GLES3/gl3.h>

#include "volpkg.h"
/* Follow volpkg.h: a context without a window, and a PNG. */
#include "example_offscreen.h"
/* Drawing, for any app; slices, which OpenGL ES 1.1 draws. */
#include "example_gl.h"
#include "example_slices.h"

/* ---- drawing ---- */

static void read_picture(const scene* s, picture* made) {
    size_t count = 4 * (size_t)made->side * (size_t)made->side, i;
    unsigned char* bytes = (unsigned char*)made->rgba;
    int eight_bits = s->frame.drawing->program->target == VOLPKG_TARGET_RGBA8;
    draw_into(&s->picture);
    glReadPixels(0, 0, made->side, made->side, GL_RGBA, eight_bits ? GL_UNSIGNED_BYTE : GL_FLOAT, made->rgba);
    for (i = count; i-- > 0 && eight_bits;) made->rgba[i] = (float)bytes[i] / 255.0f; /* from the end: in place */
    if (glGetError() != GL_NO_ERROR) fail("OpenGL ES", "an error while drawing");
}

static void draw(const volpkg_package* package, volpkg_drawing* drawing, int point, const char* view, picture* made) {
    static scene s;
    double box_from_clip[16];
    volpkg_drawing from_mesh;
    volpkg_error error;
    if (volpkg_view(package, drawing->grid, view, 1.0, box_from_clip)) fail(view, "no standard view has this name");
    /* Rays that begin and end at a mesh are faster; the picture is the same. */
    if (point < 0 && !volpkg_choose_mesh(package, drawing->picture, drawing->level->index, &from_mesh, &error) &&
        !volpkg_planes_cut(&from_mesh, box_from_clip))
        *drawing = from_mesh;
    if (volpkg_begin_frame(drawing, box_from_clip, volpkg_step_mm(drawing), made->side, made->side, &s.frame, &error))
        fail(drawing->program->name, error.text);
    prepare(&s, drawing, made->side);
    draw_program(&s);
    read_picture(&s, made);
}

/* Hide a segment: only the table of looks and the skip table change. */
static void hide(volpkg_drawing* drawing, const char* name) {
    const volpkg_package* package = drawing->package;
    int32_t number = volpkg_find_segment(package, name);
    size_t bytes = volpkg_looks_bytes(drawing);
    void* room = malloc(bytes); /* until the end */
    volpkg_look* looks;
    if (number < 0) fail(name, "the package has no segment of this name");
    looks = (volpkg_look*)malloc((size_t)package->segments->segments.count * sizeof *looks);
    if (looks == NULL) fail(name, "no memory");
    volpkg_looks(package, looks);
    looks[number].visible = 0;
    if (volpkg_set_looks(drawing, looks, room, bytes)) fail(name, "its look cannot be changed");
    free(looks);
}

int main(int count, char** words) {
    static const char* const names[] = {"--view", "--transfer", "--hide", "--level", "--point", "--size", "--frame"};
    const char* chosen[] = {"anterior", NULL, NULL, "-1", "-1", "512", "0"};
    int level, point, i, k = 0;
    picture made = {NULL, 0};
    static char room[1 << 17];
    volpkg_mapping file;
    volpkg_folder folder = {NULL, 0};
    volpkg_input input;
    volpkg_error error;
    volpkg_drawing drawing;
    volpkg_slice_drawing slices;
    const volpkg_package* package;
    size_t bytes;
    void* arena;
    for (i = 3; i + 1 < count && k < 7; i += 2) {
        for (k = 0; k < 7 && strcmp(words[i], names[k]) != 0;) ++k;
        if (k < 7) chosen[k] = words[i + 1];
    }
    level = atoi(chosen[3]), point = atoi(chosen[4]), made.side = atoi(chosen[5]);
    if (count < 3 || i != count || k == 7 || made.side < 1 || made.side > 8192)
        fail("usage",
             "PACKAGE PICTURE.png [--view NAME] [--transfer NAME] [--level N] [--point N] [--frame N] [--hide SEGMENT] "
             "[--size N]");
    memset(&input, 0, sizeof input);
    if (volpkg_map(words[1], &file, &error) && volpkg_map_folder(words[1], room, sizeof room, &folder, &error))
        fail(words[1], error.text);
    input.data = file.data;
    input.size = file.size;
    input.files = folder.files, input.file_count = folder.count; /* none, if it is a zip */
    if ((bytes = volpkg_input_arena_bytes(&input, &error)) == 0) fail(words[1], error.text);
    arena = malloc(bytes);
    package = volpkg_open_input(&input, arena, bytes, &error);
    if (package == NULL || volpkg_check_files(package, &error)) fail(words[1], error.text);
    made.rgba = (float*)malloc((size_t)made.side * (size_t)made.side * 4 * sizeof(float));
    if (made.rgba == NULL) fail("picture", "no memory");
    open_context(package->profile.api == VOLPKG_API_ES1_1 ? 1 : package->profile.api == VOLPKG_API_ES2_0 ? 2 : 3);
    if (package->profile.api == VOLPKG_API_ES1_1) {
        if (volpkg_choose_slices(package, chosen[1], level, &slices, &error)) fail(words[1], error.text);
        draw_slices(package, &slices, chosen[0], &made);
    } else {
        if (point < 0 ? volpkg_choose_frame(package, chosen[1], level, atoi(chosen[6]), &drawing, &error)
                      : volpkg_choose_point(package, chosen[1], point, &drawing, &error))
            fail(words[1], error.text);
        if (chosen[2]) hide(&drawing, chosen[2]);
        draw(package, &drawing, point, chosen[0], &made);
    }
    write_png(words[2], &made);
    free(made.rgba);
    free(arena); /* the package is gone */
    volpkg_unmap(&file);
    volpkg_unmap_folder(&folder);
    return 0;
}
