/*
 * Prints the textures that change when segments are hidden: for each a line with its name and its texels as hexadecimal
 * digits.
 *
 *     look_texels PACKAGE.zip LEVEL SEGMENT...
 */
#define VOLPKG_IMPLEMENTATION
#include "../../formats/c/volpkg.h"

int main(int count, char** words) {
    static unsigned char arena[1 << 22];
    volpkg_look looks[16];
    volpkg_mapping file;
    volpkg_error error;
    volpkg_drawing drawing;
    const volpkg_package* package;
    size_t bytes;
    void* room;
    int i;
    if (count < 3 || volpkg_map(words[1], &file, &error)) return 2;
    package = volpkg_open(file.data, file.size, arena, sizeof arena, &error);
    if (package == NULL || volpkg_choose(package, NULL, atoi(words[2]), &drawing, &error))
        return printf("%s\n", error.text), 1;
    if (package->segments == NULL) return volpkg_looks_bytes(&drawing) ? 4 : volpkg_set_looks(&drawing, looks, NULL, 0);
    bytes = volpkg_looks_bytes(&drawing);
    room = malloc(bytes);
    volpkg_looks(package, looks);
    /* Twice: looks must not rest on what the ones before them left. */
    if (volpkg_set_looks(&drawing, looks, room, bytes)) return 5;
    for (i = 3; i < count; ++i) looks[volpkg_find_segment(package, words[i])].visible = 0;
    if (volpkg_set_looks(&drawing, looks, room, bytes - 1) != VOLPKG_SMALL_ARENA) return 5;
    if (volpkg_set_looks(&drawing, looks, room, bytes)) return 5;
    for (i = 0; i < drawing.units; ++i) {
        const volpkg_texture* t = &drawing.textures[i];
        int64_t at;
        if (t->role != VOLPKG_ROLE_LOOKS && t->role != VOLPKG_ROLE_SKIP) continue;
        printf("%s ", t->name);
        for (at = 0; at < t->texel_bytes; ++at) printf("%02x", ((const unsigned char*)t->texels)[at]);
        printf("\n");
    }
    looks[0].opacity = 1.5;
    if (volpkg_set_looks(&drawing, looks, room, bytes) != VOLPKG_BAD_ARGUMENT) return 5;
    free(room);
    volpkg_unmap(&file);
    return 0;
}
