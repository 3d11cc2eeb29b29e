/*
 * Draws one view of a package with OpenGL ES 2 or 3, without a window, and writes a PNG.
 *
 *     cc -std=c99 example.c -o example -lEGL -lGLESv2 -lm
 *     ./example head.volpkg.zip head.png --view left --size 512
 *
 * What an app does is the same but for the context and the picture: open, choose, compile, upload once; set uniforms
 * and draw for each frame. Exit status: 0 drawn, 1 refused, with one line that says why.
 */
#define VOLPKG_IMPLEMENTATION
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

#include "volpkg.h"

typedef struct picture {
    unsigned char* rgba; /* row 0 at the bottom */
    int side;
} picture;

static void fail(const char* what, const char* why) {
    fprintf(stderr, "example: %s: %s\n", what, why);
    exit(1);
}

/* ---- a context without a window ---- */

static void open_context(int version) {
    EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES2_BIT, EGL_NONE};
    EGLint context_wanted[] = {EGL_CONTEXT_CLIENT_VERSION, 2, EGL_NONE}, count = 0;
    EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    EGLConfig config;
    EGLContext context;
    if (display == EGL_NO_DISPLAY) display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, NULL, NULL)) fail("EGL", "no display can be opened");
    if (version == 3) wanted[3] = EGL_OPENGL_ES3_BIT;
    context_wanted[1] = version;
    eglBindAPI(EGL_OPENGL_ES_API);
    if (!eglChooseConfig(display, wanted, &config, 1, &count) || count < 1) fail("EGL", "no configuration");
    context = eglCreateContext(display, config, EGL_NO_CONTEXT, context_wanted);
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) fail("EGL", "no context of this version");
}

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
    glBindAttribLocation(program, 0, "a_ndc");
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
    GLint linear = t->filter == VOLPKG_LINEAR, filter = linear ? GL_LINEAR : GL_NEAREST, level;
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

/* Use a program, and set its uniforms and samplers; the depth pass of a mesh has only some of them. */
static void use(GLuint program, const volpkg_drawing* drawing, const double box_from_clip[16]) {
    const volpkg_program* p = drawing->program;
    float value[16];
    int i;
    glUseProgram(program);
    for (i = 0; i < p->uniforms.count; ++i) {
        const volpkg_uniform_record* uniform = &p->uniforms.at[i];
        GLint location = glGetUniformLocation(program, uniform->name);
        volpkg_uniform(drawing, uniform, box_from_clip, volpkg_step_mm(drawing), value);
        if (uniform->type == VOLPKG_MAT4) glUniformMatrix4fv(location, 1, GL_FALSE, value);
        if (uniform->type == VOLPKG_VEC3) glUniform3fv(location, 1, value);
        if (uniform->type == VOLPKG_FLOAT) glUniform1f(location, value[0]);
    }
    for (i = 0; i < p->samplers.count; ++i) glUniform1i(glGetUniformLocation(program, p->samplers.at[i].name), i);
}

/* ---- drawing ---- */

static void attach_target(int side, int with_depth) {
    GLuint framebuffer, texture, depth;
    glGenFramebuffers(1, &framebuffer);
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, side, side, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    if (with_depth) {
        glGenRenderbuffers(1, &depth);
        glBindRenderbuffer(GL_RENDERBUFFER, depth);
        glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT16, side, side);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    }
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) fail("framebuffer", "not complete");
    glViewport(0, 0, side, side);
    glDisable(GL_DITHER);
    glClearColor(0, 0, 0, 0);
    glEnableVertexAttribArray(0);
}

static void draw_box(GLuint program, const volpkg_drawing* drawing, const double box_from_clip[16]) {
    static const float corners[] = {-1, -1, 3, -1, -1, 3};
    use(program, drawing, box_from_clip);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, corners);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

/* SPEC.md section 15: first depth alone, then only what has that depth. */
static void draw_mesh(GLuint program, GLuint depth, const volpkg_drawing* drawing, const double box_from_clip[16]) {
    int pass, i;
    glEnable(GL_DEPTH_TEST);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    for (pass = 0; pass < 2; ++pass) {
        GLboolean colour = pass == 1 ? GL_TRUE : GL_FALSE;
        glColorMask(colour, colour, colour, colour);
        glDepthMask(!colour);
        glDepthFunc(pass ? GL_EQUAL : GL_LESS);
        use(pass ? program : depth, drawing, box_from_clip);
        for (i = 0; i < drawing->mesh->parts.count; ++i) {
            const volpkg_mesh_part* part = &drawing->mesh->parts.at[i];
            glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, part->positions);
            glDrawElements(GL_TRIANGLES, part->index_count, GL_UNSIGNED_SHORT, part->indices);
        }
    }
}

static void draw(const volpkg_package* package, volpkg_drawing* drawing, int point, const char* view, picture* made) {
    double box_from_clip[16];
    volpkg_drawing from_mesh;
    volpkg_error error;
    GLuint program;
    int unit;
    if (volpkg_view(package, view, 1.0, box_from_clip)) fail(view, "no standard view has this name");
    /* Rays that begin at a mesh are faster; the picture is the same. */
    if (point < 0 &&
        !volpkg_choose_mesh(package, drawing->program->transfer, drawing->level->index, &from_mesh, &error) &&
        !volpkg_near_plane_cuts(&from_mesh, box_from_clip))
        *drawing = from_mesh;
    attach_target(made->side, drawing->mesh != NULL);
    for (unit = 0; unit < drawing->units; ++unit) upload(drawing, unit);
    program = link_program(&drawing->program->vertex, &drawing->program->fragment);
    if (drawing->mesh == NULL)
        draw_box(program, drawing, box_from_clip);
    else
        draw_mesh(program, link_program(&drawing->program->vertex, &package->proxy->depth), drawing, box_from_clip);
    glReadPixels(0, 0, made->side, made->side, GL_RGBA, GL_UNSIGNED_BYTE, made->rgba);
    if (glGetError() != GL_NO_ERROR) fail("OpenGL ES", "an error while drawing");
}

/* ---- a PNG of stored blocks ---- */

static void put32(unsigned char* to, unsigned long word) {
    int i;
    for (i = 0; i < 4; ++i) to[i] = (unsigned char)(word >> (24 - 8 * i));
}

static void write_chunk(FILE* file, const char* kind, const unsigned char* data, size_t bytes) {
    unsigned char* whole = (unsigned char*)malloc(bytes + 12);
    if (whole == NULL) fail("PNG", "no memory");
    put32(whole, (unsigned long)bytes);
    memcpy(whole + 4, kind, 4);
    if (bytes) memcpy(whole + 8, data, bytes);
    put32(whole + 8 + bytes, volpkg_crc32(whole + 4, bytes + 4));
    fwrite(whole, 1, bytes + 12, file);
    free(whole);
}

static void write_png(const char* path, const picture* made) {
    size_t side = (size_t)made->side, row = 1 + 3 * side, used = 2, x, y;
    unsigned char head[13] = {0, 0, 0, 0, 0, 0, 0, 0, 8, 2, 0, 0, 0};
    unsigned char* data = (unsigned char*)malloc(side * (row + 5) + 6);
    static const float black[3] = {0, 0, 0};
    unsigned long a = 1, b = 0;
    FILE* file = fopen(path, "wb");
    if (file == NULL || data == NULL) fail(path, "cannot be written");
    data[0] = 0x78;
    data[1] = 1;
    for (y = 0; y < side; ++y) { /* a block of deflate for each row: last or not, its length, and that again inverted */
        unsigned char *block = data + used, *pixel = block + 6;
        block[0] = y + 1 == side;
        block[1] = (unsigned char)row;
        block[2] = (unsigned char)(row >> 8);
        block[3] = (unsigned char)~block[1];
        block[4] = (unsigned char)~block[2];
        block[5] = 0; /* no filter */
        for (x = 0; x < side; ++x, pixel += 3) {
            const unsigned char* from = made->rgba + 4 * ((side - 1 - y) * side + x);
            float rgba[4];
            int i;
            for (i = 0; i < 4; ++i) rgba[i] = (float)from[i] / 255.0f;
            volpkg_srgb(rgba, black, pixel);
        }
        for (x = 0; x < row; ++x) a = (a + block[5 + x]) % 65521, b = (b + a) % 65521;
        used += 5 + row;
    }
    put32(data + used, b << 16 | a);
    put32(head, (unsigned long)side);
    put32(head + 4, (unsigned long)side);
    fwrite("\x89PNG\r\n\x1a\n", 1, 8, file);
    write_chunk(file, "IHDR", head, 13);
    write_chunk(file, "IDAT", data, used + 4);
    write_chunk(file, "IEND", NULL, 0);
    if (fclose(file) != 0) fail(path, "cannot be written");
    free(data);
}

int main(int count, char** words) {
    const char *view = "anterior", *transfer = NULL;
    int level = -1, point = -1, i;
    picture made = {NULL, 512};
    volpkg_mapping file;
    volpkg_error error;
    volpkg_drawing drawing;
    const volpkg_package* package;
    size_t bytes;
    void* arena;
    for (i = 3; i + 1 < count; i += 2) {
        if (strcmp(words[i], "--view") == 0)
            view = words[i + 1];
        else if (strcmp(words[i], "--transfer") == 0)
            transfer = words[i + 1];
        else if (strcmp(words[i], "--level") == 0)
            level = atoi(words[i + 1]);
        else if (strcmp(words[i], "--point") == 0)
            point = atoi(words[i + 1]);
        else if (strcmp(words[i], "--size") == 0)
            made.side = atoi(words[i + 1]);
        else
            break;
    }
    if (count < 3 || i != count || made.side < 1 || made.side > 8192)
        fail("usage", "PACKAGE.zip PICTURE.png [--view NAME] [--transfer NAME] [--level N] [--point N] [--size N]");
    if (volpkg_map(words[1], &file, &error)) fail(words[1], error.text);
    if ((bytes = volpkg_arena_bytes(file.data, file.size, &error)) == 0) fail(words[1], error.text);
    arena = malloc(bytes);
    package = volpkg_open(file.data, file.size, arena, bytes, &error);
    if (package == NULL || volpkg_check_files(package, &error)) fail(words[1], error.text);
    if (point < 0 ? volpkg_choose(package, transfer, level, &drawing, &error)
                  : volpkg_choose_point(package, transfer, point, &drawing, &error))
        fail(words[1], error.text);
    made.rgba = (unsigned char*)malloc((size_t)made.side * (size_t)made.side * 4);
    if (made.rgba == NULL) fail("picture", "no memory");
    open_context(package->profile.api == VOLPKG_ES3_0 ? 3 : 2);
    draw(package, &drawing, point, view, &made);
    write_png(words[2], &made);
    free(made.rgba);
    free(arena); /* the package is gone */
    volpkg_unmap(&file);
    return 0;
}
