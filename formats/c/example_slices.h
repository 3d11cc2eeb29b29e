/* Part of example.c: draws the slices of a package for OpenGL ES 1.1 with fixed functions (spec/es11.md). */
#ifndef EXAMPLE_SLICES_H
#define EXAMPLE_SLICES_H

/* ---- a picture to draw into: GL_OES_framebuffer_object ---- */

typedef void (*any_function)(void);

static any_function extension(const char* name) {
    any_function found = (any_function)eglGetProcAddress(name);
    if (found == NULL) fail(name, "the driver does not have it");
    return found;
}

static void make_slice_target(int side) {
    PFNGLGENFRAMEBUFFERSOESPROC generate = (PFNGLGENFRAMEBUFFERSOESPROC)extension("glGenFramebuffersOES");
    PFNGLGENRENDERBUFFERSOESPROC generate_buffers = (PFNGLGENRENDERBUFFERSOESPROC)extension("glGenRenderbuffersOES");
    PFNGLBINDRENDERBUFFEROESPROC bind_buffer = (PFNGLBINDRENDERBUFFEROESPROC)extension("glBindRenderbufferOES");
    PFNGLRENDERBUFFERSTORAGEOESPROC storage = (PFNGLRENDERBUFFERSTORAGEOESPROC)extension("glRenderbufferStorageOES");
    PFNGLBINDFRAMEBUFFEROESPROC bind = (PFNGLBINDFRAMEBUFFEROESPROC)extension("glBindFramebufferOES");
    PFNGLFRAMEBUFFERRENDERBUFFEROESPROC attach =
        (PFNGLFRAMEBUFFERRENDERBUFFEROESPROC)extension("glFramebufferRenderbufferOES");
    PFNGLCHECKFRAMEBUFFERSTATUSOESPROC status =
        (PFNGLCHECKFRAMEBUFFERSTATUSOESPROC)extension("glCheckFramebufferStatusOES");
    GLuint framebuffer, buffer;
    generate_buffers(1, &buffer);
    bind_buffer(GL_RENDERBUFFER_OES, buffer);
    storage(GL_RENDERBUFFER_OES, GL_RGBA8_OES, side, side);
    generate(1, &framebuffer);
    bind(GL_FRAMEBUFFER_OES, framebuffer);
    attach(GL_FRAMEBUFFER_OES, GL_COLOR_ATTACHMENT0_OES, GL_RENDERBUFFER_OES, buffer);
    if (status(GL_FRAMEBUFFER_OES) != GL_FRAMEBUFFER_COMPLETE_OES) fail("framebuffer", "not complete");
    glViewport(0, 0, side, side);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT);
}

/* ---- textures and state ---- */

static GLuint upload_slices(const volpkg_slice_drawing* drawing, const volpkg_texture* t) {
    GLfloat filter = t->filter == VOLPKG_FILTER_LINEAR ? GL_LINEAR : GL_NEAREST;
    GLsizei width = t->shape_zyx[2], height = t->shape_zyx[1], bytes = (GLsizei)t->texel_bytes;
    unsigned char* texels = (unsigned char*)malloc((size_t)bytes);
    GLuint handle;
    if (texels == NULL || volpkg_slice_texels(drawing, t, texels, (size_t)bytes)) fail(t->name, "no memory");
    glGenTextures(1, &handle);
    glBindTexture(GL_TEXTURE_2D, handle);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    if (t->gl.format == 0) /* palette and indices */
        glCompressedTexImage2D(GL_TEXTURE_2D, 0, t->gl.internal_format, width, height, 0, bytes, texels);
    else
        glTexImage2D(GL_TEXTURE_2D, 0, (GLint)t->gl.internal_format, width, height, 0, t->gl.format, t->gl.type,
                     texels);
    free(texels);
    return handle;
}

/* Blending back to front, and an environment that multiplies texels by 0 to 2. */
static void begin_fixed_functions(const volpkg_slice_frame* frame) {
    GLfloat scale = frame->factor > 1 ? 2 : 1, level = (GLfloat)(frame->factor / (double)scale);
    glDisable(GL_DITHER);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glEnable(GL_TEXTURE_2D);
    glTexEnvf(GL_TEXTURE_ENV, GL_TEXTURE_ENV_MODE, GL_COMBINE);
    glTexEnvf(GL_TEXTURE_ENV, GL_COMBINE_RGB, GL_MODULATE);
    glTexEnvf(GL_TEXTURE_ENV, GL_COMBINE_ALPHA, GL_MODULATE);
    glTexEnvf(GL_TEXTURE_ENV, GL_SRC0_RGB, GL_TEXTURE);
    glTexEnvf(GL_TEXTURE_ENV, GL_SRC1_RGB, GL_PRIMARY_COLOR);
    glTexEnvf(GL_TEXTURE_ENV, GL_SRC0_ALPHA, GL_TEXTURE);
    glTexEnvf(GL_TEXTURE_ENV, GL_SRC1_ALPHA, GL_PRIMARY_COLOR);
    glTexEnvf(GL_TEXTURE_ENV, GL_RGB_SCALE, scale);
    glTexEnvf(GL_TEXTURE_ENV, GL_ALPHA_SCALE, scale);
    glColor4f(level, level, level, level);
    glMatrixMode(GL_PROJECTION);
    glLoadMatrixf(frame->clip_from_box);
    glMatrixMode(GL_MODELVIEW);
    glLoadIdentity();
    glEnableClientState(GL_VERTEX_ARRAY);
    glEnableClientState(GL_TEXTURE_COORD_ARRAY);
}

/* ---- drawing ---- */

static void draw_slices(const volpkg_package* package, const volpkg_slice_drawing* drawing, const char* view,
                        picture* made) {
    double box_from_clip[16];
    float corners[5 * VOLPKG_SLICE_CORNERS];
    uint16_t indices[VOLPKG_SLICE_INDICES];
    size_t count = 4 * (size_t)made->side * (size_t)made->side, i;
    unsigned char* bytes = (unsigned char*)made->rgba;
    GLuint* handles = (GLuint*)malloc((size_t)drawing->textures * sizeof *handles);
    volpkg_slice_frame frame;
    volpkg_error error;
    int32_t number;
    if (handles == NULL) fail("textures", "no memory");
    if (volpkg_view(package, package->grid, view, 1.0, box_from_clip)) fail(view, "no standard view has this name");
    if (volpkg_begin_slices(drawing, box_from_clip, &frame, &error)) fail(view, error.text);
    make_slice_target(made->side);
    for (number = 0; number < drawing->textures; ++number)
        handles[number] = upload_slices(drawing, volpkg_slice_texture(drawing, number));
    begin_fixed_functions(&frame);
    volpkg_slice_triangles(indices);
    while ((number = volpkg_next_slice(&frame, corners)) >= 0) {
        glBindTexture(GL_TEXTURE_2D, handles[number]);
        glVertexPointer(3, GL_FLOAT, 5 * sizeof(float), corners);
        glTexCoordPointer(2, GL_FLOAT, 5 * sizeof(float), corners + 3);
        glDrawElements(GL_TRIANGLES, VOLPKG_SLICE_INDICES, GL_UNSIGNED_SHORT, indices);
    }
    glReadPixels(0, 0, made->side, made->side, GL_RGBA, GL_UNSIGNED_BYTE, bytes);
    for (i = count; i-- > 0;) made->rgba[i] = (float)bytes[i] / 255.0f; /* from the end: in place */
    if (glGetError() != GL_NO_ERROR) fail("OpenGL ES 1.1", "an error while drawing");
    free(handles);
}

#endif /* EXAMPLE_SLICES_H */
