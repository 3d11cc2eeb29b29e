/*
 * Draws a chosen drawing with OpenGL ES 2 or 3: programs, textures, targets, passes. Copy it into an app, or read it
 * beside volpkg.h. It follows volpkg.h and the headers of OpenGL ES; `fail(what, why)` must be declared before it and
 * never return.
 */
#ifndef EXAMPLE_GL_H
#define EXAMPLE_GL_H

/* ---- targets: the picture, and the textures of passes ---- */

typedef struct target {
    GLuint framebuffer, texture, program; /* the program of a pass */
    int side;
} target;

static void make_target(target* made, volpkg_target format, int side, GLint filter, int es3, int with_depth) {
    static const GLenum internal[3] = {GL_RGBA, GL_RGBA16F, GL_RGBA32F};
    GLenum type = format == VOLPKG_TARGET_RGBA8     ? GL_UNSIGNED_BYTE
                  : format == VOLPKG_TARGET_RGBA32F ? GL_FLOAT
                  : es3                             ? GL_HALF_FLOAT
                                                    : 0x8D61; /* GL_HALF_FLOAT_OES */
    GLuint depth;
    made->side = side;
    glGenFramebuffers(1, &made->framebuffer);
    glGenTextures(1, &made->texture);
    glActiveTexture(GL_TEXTURE0 + VOLPKG_MAX_UNITS - 1);
    glBindTexture(GL_TEXTURE_2D, made->texture);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)(es3 ? internal[format] : GL_RGBA), side, side, 0, GL_RGBA, type, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, made->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, made->texture, 0);
    if (with_depth) {
        glGenRenderbuffers(1, &depth);
        glBindRenderbuffer(GL_RENDERBUFFER, depth);
        glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT16, side, side);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    }
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) fail("framebuffer", "not complete");
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT | (with_depth ? GL_DEPTH_BUFFER_BIT : 0));
}

static void draw_into(const target* to) {
    glBindFramebuffer(GL_FRAMEBUFFER, to->framebuffer);
    glViewport(0, 0, to->side, to->side);
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
        const target* light = &s->pass[s->passes > 0 ? s->passes - 1 : 0];
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

/* Compile, make targets and upload: once for a drawing. The picture has side x side pixels. */
static void prepare(scene* s, const volpkg_drawing* drawing, int side) {
    const volpkg_program* p = drawing->program;
    int es3 = drawing->package->profile.api == VOLPKG_API_ES3_0, i;
    s->passes = p->before.count + (p->light_pass != NULL);
    glDisable(GL_DITHER);
    glEnableVertexAttribArray(0);
    make_target(&s->picture, p->target, side, GL_NEAREST, es3, 0);
    for (i = 0; i < s->passes; ++i) {
        const volpkg_pass* pass = pass_of(p, i);
        make_target(&s->pass[i], pass->target, pass->size ? pass->size : side,
                    pass == p->light_pass ? GL_LINEAR : GL_NEAREST, es3, pass->geometry == VOLPKG_GEOMETRY_MESH);
        s->pass[i].program = link_program(&pass->vertex, &pass->fragment);
    }
    for (i = 0; i < drawing->units; ++i) upload(drawing, i);
    s->program = link_program(&p->vertex, &p->fragment);
}

#endif /* EXAMPLE_GL_H */
