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
/* Follow volpkg.h: a context without a window, targets to draw into, and a PNG; slices, which OpenGL ES 1.1 draws. */
#include "example_offscreen.h"
#include "example_slices.h"

/* ---- programs and textures ---- */

static GLuint compile(GLenum kind, const volpkg_text* text) {
    GLuint shader = glCreateShader(kind);
    GLint compiled = 0;
    char log[512] = "";
    glShaderSource(shader, 1, &text->at, &text->bytes); /* with its length: it does not end with a zero byte */
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    glGetShaderInfoLog(shader, sizeof log, NULL, log);
    if (!compiled) fail(text->path, log);
    return shader;
}

static GLuint link_program(const volpkg_text* vertex, const volpkg_text* fragment) {
    GLuint program = glCreateProgram();
    GLint linked = 0;
    char log[512] = "";
    glAttachShader(program, compile(GL_VERTEX_SHADER, vertex));
    glAttachShader(program, compile(GL_FRAGMENT_SHADER, fragment));
    glBindAttribLocation(program, 0, "a_ndc"); /* a shader has one of these */
    glBindAttribLocation(program, 0, "a_corner");
    glBindAttribLocation(program, 0, "a_slice");
    glBindAttribLocation(program, 0, "a_position");
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    glGetProgramInfoLog(program, sizeof log, NULL, log);
    if (!linked) fail(fragment->path, log);
    return program;
}

static void upload_level(const volpkg_texture* t, int level) {
    GLint internal = (GLint)t->gl.internal_format;
    GLsizei depth = t->shape_zyx[0], height = t->shape_zyx[1], width = t->shape_zyx[2];
    if (t->gl.format == 0)
        glCompressedTexImage2D(GL_TEXTURE_2D, level, t->gl.internal_format, width, height, 0, (GLsizei)t->texel_bytes,
                               t->texels);
    else if (t->gl.target == GL_TEXTURE_3D)
        glTexImage3D(GL_TEXTURE_3D, level, internal, width, height, depth, 0, t->gl.format, t->gl.type, t->texels);
    else
        glTexImage2D(GL_TEXTURE_2D, level, internal, width, height, 0, t->gl.format, t->gl.type, t->texels);
}

/* Upload the texture of a unit. It stays bound to the unit. */
static void upload(const volpkg_drawing* drawing, int unit) {
    const volpkg_texture* t = &drawing->textures[unit];
    GLint linear = t->filter == VOLPKG_FILTER_LINEAR, filter = linear ? GL_LINEAR : GL_NEAREST, level;
    GLuint handle;
    glGenTextures(1, &handle);
    glActiveTexture(GL_TEXTURE0 + (GLenum)unit);
    glBindTexture(t->gl.target, handle);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexParameteri(t->gl.target, GL_TEXTURE_MAG_FILTER, filter);
    if (t->mipmap >= 0) {
        for (level = 0; level < t->mipmaps; ++level) upload_level(volpkg_mipmap(drawing->package, t, level), level);
        glTexParameteri(t->gl.target, GL_TEXTURE_MAX_LEVEL, t->mipmaps - 1);
        filter = linear ? GL_LINEAR_MIPMAP_LINEAR : GL_NEAREST_MIPMAP_NEAREST;
    } else {
        upload_level(t, 0);
    }
    glTexParameteri(t->gl.target, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(t->gl.target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(t->gl.target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    if (t->gl.target == GL_TEXTURE_3D) glTexParameteri(t->gl.target, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
}

/* ---- drawing ---- */

#define MOST_PASSES 17

typedef struct scene {
    volpkg_frame frame;
    GLuint program;
    int passes; /* the light_pass is the last one */
    target pass[MOST_PASSES], picture;
} scene;

static const volpkg_pass* pass_of(const volpkg_program* p, int number) {
    return number < p->before.count ? &p->before.at[number] : p->light_pass;
}

/* Use a program, and set its uniforms and samplers; a pass has only some of them. */
static void use(const scene* s, GLuint program, const volpkg_uniform_record* uniforms, int count, int draw) {
    const volpkg_program* p = s->frame.drawing->program;
    float value[16];
    int i;
    glUseProgram(program);
    for (i = 0; i < count; ++i) {
        GLint location = glGetUniformLocation(program, uniforms[i].name);
        volpkg_frame_uniform(&s->frame, &uniforms[i], draw, value);
        if (uniforms[i].type == VOLPKG_UNIFORM_TYPE_MAT4X4F) glUniformMatrix4fv(location, 1, GL_FALSE, value);
        if (uniforms[i].type == VOLPKG_UNIFORM_TYPE_VEC3F) glUniform3fv(location, 1, value);
        if (uniforms[i].type == VOLPKG_UNIFORM_TYPE_F32) glUniform1f(location, value[0]);
    }
    for (i = 0; i < p->samplers.count; ++i) glUniform1i(glGetUniformLocation(program, p->samplers.at[i]), i);
    for (i = 0; i < s->passes && program == s->program; ++i) {
        glActiveTexture(GL_TEXTURE0 + (GLenum)(p->samplers.count + i));
        glBindTexture(GL_TEXTURE_2D, s->pass[i].texture);
        glUniform1i(glGetUniformLocation(program, pass_of(p, i)->sampler), p->samplers.count + i);
    }
}

static void draw_corners(const scene* s, volpkg_geometry geometry, int draw, int for_light, const volpkg_blend* blend) {
    int size = volpkg_corner_size(geometry), count = volpkg_corners(&s->frame, geometry, draw, for_light, NULL, 0);
    float* corners = (float*)malloc((size_t)count * (size_t)size * sizeof(float) + 1);
    if (corners == NULL) fail("corners", "no memory");
    volpkg_corners(&s->frame, geometry, draw, for_light, corners, count);
    if (blend)
        glEnable(GL_BLEND), glBlendFuncSeparate(blend->colour[0], blend->colour[1], blend->alpha[0], blend->alpha[1]);
    glVertexAttribPointer(0, size, GL_FLOAT, GL_FALSE, 0, corners);
    glDrawArrays(GL_TRIANGLES, 0, count);
    glDisable(GL_BLEND);
    free(corners);
}

/* spec/proxy.md: the nearest faces into red and green, the farthest into blue and alpha. */
static void draw_mesh(const volpkg_mesh* mesh) {
    int farthest, i;
    glEnable(GL_DEPTH_TEST);
    for (farthest = 0; farthest < 2; ++farthest) {
        GLboolean near = farthest ? GL_FALSE : GL_TRUE;
        glColorMask(near, near, !near, !near);
        glClearDepthf(farthest ? 0.0f : 1.0f);
        glClear(GL_DEPTH_BUFFER_BIT);
        glDepthFunc(farthest ? GL_GREATER : GL_LESS);
        for (i = 0; i < mesh->parts.count; ++i) {
            glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, mesh->parts.at[i].positions);
            glDrawElements(GL_TRIANGLES, mesh->parts.at[i].index_count, GL_UNSIGNED_SHORT, mesh->parts.at[i].indices);
        }
    }
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDisable(GL_DEPTH_TEST);
}

/* The steps of a picture, as volpkg.h lists them beside volpkg_frame. */
static void draw_program(scene* s) {
    const volpkg_program* p = s->frame.drawing->program;
    int i;
    for (i = 0; i < p->before.count; ++i) {
        draw_into(&s->pass[i]);
        use(s, s->pass[i].program, p->before.at[i].uniforms.at, p->before.at[i].uniforms.count, 0);
        if (p->before.at[i].geometry == VOLPKG_GEOMETRY_MESH)
            draw_mesh(s->frame.drawing->mesh);
        else
            draw_corners(s, p->before.at[i].geometry, 0, 0, NULL);
    }
    for (i = 0; i < s->frame.draws; ++i) {
        const target* light = &s->pass[s->passes - 1];
        draw_into(&s->picture);
        use(s, s->program, p->uniforms.at, p->uniforms.count, i);
        draw_corners(s, p->geometry, i, 0, s->frame.light_behind ? &p->light_pass->behind : p->blend);
        if (p->light_pass == NULL) continue;
        draw_into(light);
        glActiveTexture(GL_TEXTURE0 + (GLenum)(p->samplers.count + s->passes - 1));
        glBindTexture(GL_TEXTURE_2D, 0); /* a pass must not read its own target */
        use(s, light->program, p->light_pass->uniforms.at, p->light_pass->uniforms.count, i);
        draw_corners(s, p->geometry, i, 1, &p->light_pass->blend);
    }
}

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
    int es3 = package->profile.api == VOLPKG_API_ES3_0, i;
    const volpkg_program* p;
    if (volpkg_view(package, drawing->grid, view, 1.0, box_from_clip)) fail(view, "no standard view has this name");
    /* Rays that begin and end at a mesh are faster; the picture is the same. */
    if (point < 0 && !volpkg_choose_mesh(package, drawing->picture, drawing->level->index, &from_mesh, &error) &&
        !volpkg_planes_cut(&from_mesh, box_from_clip))
        *drawing = from_mesh;
    p = drawing->program;
    if (volpkg_begin_frame(drawing, box_from_clip, volpkg_step_mm(drawing), made->side, made->side, &s.frame, &error))
        fail(p->name, error.text);
    s.passes = p->before.count + (p->light_pass != NULL);
    glDisable(GL_DITHER);
    glEnableVertexAttribArray(0);
    make_target(&s.picture, p->target, made->side, GL_NEAREST, es3, 0);
    for (i = 0; i < s.passes; ++i) {
        const volpkg_pass* pass = pass_of(p, i);
        make_target(&s.pass[i], pass->target, pass->size ? pass->size : made->side,
                    pass == p->light_pass ? GL_LINEAR : GL_NEAREST, es3, pass->geometry == VOLPKG_GEOMETRY_MESH);
        s.pass[i].program = link_program(&pass->vertex, &pass->fragment);
    }
    for (i = 0; i < drawing->units; ++i) upload(drawing, i);
    s.program = link_program(&p->vertex, &p->fragment);
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
