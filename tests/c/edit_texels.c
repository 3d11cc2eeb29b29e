/*
 * Prints the tables of a drawing after an edit: for each texture that changes a line with its name, and its texels as
 * hexadecimal digits. Each POINT is VALUE,RED,GREEN,BLUE,EXTINCTION.
 *
 *     edit_texels PACKAGE.zip TRANSFER LEVEL POINT...
 */
#define VOLPKG_IMPLEMENTATION
#include "../../formats/c/volpkg.h"

static void print(const volpkg_drawing* drawing) {
    int32_t unit;
    int64_t at;
    for (unit = 0; unit < drawing->units; ++unit) {
        const volpkg_texture* t = &drawing->textures[unit];
        if (t->role != VOLPKG_ROLE_TRANSFER && t->role != VOLPKG_ROLE_SKIP) continue;
        printf("%s ", t->name);
        for (at = 0; at < t->texel_bytes; ++at) printf("%02x", ((const unsigned char*)t->texels)[at]);
        printf("\n");
    }
}

int main(int count, char** words) {
    static unsigned char arena[1 << 22];
    volpkg_transfer_point points[16];
    volpkg_edit edit = {NULL, NULL, 0, 0};
    volpkg_mapping file;
    volpkg_error error;
    volpkg_drawing drawing;
    const volpkg_package* package;
    size_t bytes;
    void* room;
    int i;
    if (count < 4 || count > 20 || volpkg_map(words[1], &file, &error)) return 2;
    package = volpkg_open(file.data, file.size, arena, sizeof arena, &error);
    if (package == NULL || volpkg_choose(package, words[2], atoi(words[3]), &drawing, &error))
        return printf("%s\n", error.text), 1;
    for (i = 4; i < count; ++i) {
        volpkg_transfer_point* p = &points[edit.count++];
        if (sscanf(words[i], "%lf,%lf,%lf,%lf,%lf", &p->value, &p->colour[0], &p->colour[1], &p->colour[2],
                   &p->extinction_per_mm) != 5)
            return 2;
    }
    edit.transfer = words[2];
    edit.points = points;
    bytes = volpkg_edit_bytes(&drawing);
    room = malloc(bytes + 1);
    if (room == NULL) return 2;
    /* Twice: an edit must not rest on what the one before it left. */
    if (volpkg_edit_drawing(&drawing, &edit, 1, room, bytes, &error) ||
        volpkg_edit_drawing(&drawing, &edit, 1, room, bytes, &error))
        return printf("%s\n", error.text), free(room), 1;
    print(&drawing);
    if (volpkg_edit_drawing(&drawing, NULL, 0, room, bytes, &error) ||
        volpkg_edit_drawing(&drawing, NULL, 0, room, bytes - 1, NULL) != VOLPKG_SMALL_ARENA)
        return 3;
    print(&drawing);
    free(room);
    volpkg_unmap(&file);
    return 0;
}
