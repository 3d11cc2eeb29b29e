/*
 * Draws a view of a package from bricks on demand, which a function of the app fetches, and prints the bound.
 *
 *     draw_bricks PACKAGE PICTURE.png VIEW SIDE BYTES BROKEN
 *
 * The file of bricks is read from the function only; the brick that begins at the byte BROKEN cannot be had.
 */
#define main example_main
#include "../../formats/c/example.c"
#undef main

/* From libzstd, whose header need not be installed. */
size_t ZSTD_decompress(void* to, size_t room, const void* from, size_t bytes);

typedef struct app {
    const char* package;
    uint64_t broken;
    int fetched;
} app;

static size_t unpack(void* user, const void* frames, size_t bytes, void* texels, size_t room) {
    (void)user;
    return ZSTD_decompress(texels, room, frames, bytes);
}

static int fetch(void* user, const char* path, uint64_t begin, size_t size, void* to) {
    app* given = (app*)user;
    char name[1024];
    FILE* file;
    size_t got;
    ++given->fetched;
    if (begin == given->broken) return 0;
    snprintf(name, sizeof name, "%s/%s", given->package, path);
    if ((file = fopen(name, "rb")) == NULL) return 0;
    fseek(file, (long)begin, SEEK_SET);
    got = fread(to, 1, size, file);
    fclose(file);
    return got == size;
}

/* Copy a brick to its place of a pool in memory. */
static void place_brick(unsigned char* pool, const volpkg_texture* texture, const unsigned char* texels, size_t pitch,
                        const int32_t at[3]) {
    size_t width =
        (size_t)(texture->texel_bytes / texture->shape_zyx[0] / texture->shape_zyx[1]) / (size_t)texture->shape_zyx[2];
    size_t z, y;
    for (z = 0; z < pitch; ++z)
        for (y = 0; y < pitch; ++y) {
            size_t row = ((size_t)at[2] * pitch + z) * (size_t)texture->shape_zyx[1] + (size_t)at[1] * pitch + y;
            memcpy(pool + (row * (size_t)texture->shape_zyx[2] + (size_t)at[0] * pitch) * width,
                   texels + (z * pitch + y) * pitch * width, pitch * width);
        }
}

int main(int count, char** words) {
    static char names[1 << 17];
    volpkg_folder folder;
    volpkg_input input;
    volpkg_error error;
    volpkg_held_bricks held;
    volpkg_drawing drawing;
    const volpkg_package* package;
    picture made;
    app user;
    size_t bytes, pitch;
    unsigned char *room, *texels, *pool;
    double box_from_clip[16];
    int32_t at[3], got, unit, round;
    if (count != 7) return 2;
    memset(&input, 0, sizeof input);
    memset(&held, 0, sizeof held);
    if (volpkg_map_folder(words[1], names, sizeof names, &folder, &error)) fail(words[1], error.text);
    input.files = folder.files, input.file_count = folder.count;
    bytes = volpkg_input_arena_bytes(&input, &error);
    package = volpkg_open_input(&input, malloc(bytes), bytes, &error);
    if (package == NULL) fail(words[1], error.text);
    user.package = words[1], user.broken = (uint64_t)strtoll(words[6], NULL, 10), user.fetched = 0;
    held.fetch = fetch, held.unpack = unpack, held.user = &user;
    bytes = volpkg_bricks_bytes(package);
    room = (unsigned char*)malloc(bytes + 1);
    if (volpkg_begin_bricks(package, NULL, room + 1, bytes - 1, &held, &drawing, &error) != VOLPKG_SMALL_ARENA)
        return 3;
    if (volpkg_begin_bricks(package, NULL, room + 1, bytes, &held, &drawing, &error)) fail(words[1], error.text);
    pitch = (size_t)(package->on_demand->size + 2 * package->on_demand->ghost);
    texels = (unsigned char*)malloc(2 * pitch * pitch * pitch);
    for (unit = 0; drawing.textures[unit].texels != NULL;) ++unit;
    pool = (unsigned char*)calloc((size_t)drawing.textures[unit].texel_bytes, 1);
    drawing.textures[unit].texels = pool;
    made.side = atoi(words[4]);
    made.rgba = (float*)malloc((size_t)made.side * (size_t)made.side * 4 * sizeof(float));
    for (round = 0; round < 2; ++round) { /* another view first, so that bricks are replaced */
        if (volpkg_view(package, drawing.grid, round ? words[3] : "inferior", 1.0, box_from_clip)) return 4;
        volpkg_choose_bricks(&held, box_from_clip, made.side, strtoll(words[5], NULL, 10), 0.0);
        while ((got = volpkg_next_brick(&held, texels, at, &error)) != 0) {
            if (got > 0)
                place_brick(pool, &drawing.textures[unit], texels, pitch, at);
            else if (round)
                printf("%s\n", error.text);
        }
        volpkg_brick_pages(&held);
    }
    printf("%.9g %d %d\n", held.bound, held.chosen, user.fetched);
    open_context(3);
    draw(package, &drawing, 0, words[3], &made);
    write_png(words[2], &made);
    return 0;
}
