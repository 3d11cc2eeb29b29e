/* Parts of example.c that most apps have themselves: a context without a window, and a file for the picture. */
#ifndef EXAMPLE_OFFSCREEN_H
#define EXAMPLE_OFFSCREEN_H

typedef struct picture {
    float* rgba; /* premultiplied linear RGB and opacity; row 0 at the bottom */
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
    if (version == 1) wanted[3] = EGL_OPENGL_ES_BIT;
    if (version == 3) wanted[3] = EGL_OPENGL_ES3_BIT;
    context_wanted[1] = version;
    eglBindAPI(EGL_OPENGL_ES_API);
    if (!eglChooseConfig(display, wanted, &config, 1, &count) || count < 1) fail("EGL", "no configuration");
    context = eglCreateContext(display, config, EGL_NO_CONTEXT, context_wanted);
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) fail("EGL", "no context of this version");
}

/* ---- a PNG of stored blocks, over black ---- */

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
            volpkg_srgb(made->rgba + 4 * ((side - 1 - y) * side + x), black, pixel);
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

#endif /* EXAMPLE_OFFSCREEN_H */
