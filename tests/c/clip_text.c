/*
 * Prints the fragment shader of the first program of a package, cut by the six planes of the box from LOW to HIGH,
 * which are fractions of the volume along x; the planes are on the first line.
 *
 *     clip_text PACKAGE.zip LOW HIGH
 */
#define VOLPKG_IMPLEMENTATION
#include "../../formats/c/volpkg.h"

int main(int count, char** words) {
    static unsigned char arena[1 << 22];
    static char text[1 << 18];
    volpkg_mapping file;
    volpkg_error error;
    const volpkg_package* package;
    double low[3] = {0, 0, 0}, high[3];
    float planes[24];
    size_t bytes, i;
    if (count != 4 || volpkg_map(words[1], &file, &error)) return 2;
    package = volpkg_open(file.data, file.size, arena, sizeof arena, &error);
    if (package == NULL) return printf("%s\n", error.text), 1;
    for (i = 0; i < 3; ++i) high[i] = package->grid->extent_mm_zyx[2 - i];
    low[0] = atof(words[2]) * high[0];
    high[0] *= atof(words[3]);
    volpkg_clip_box(low, high, planes);
    for (i = 0; i < 24; ++i) printf("%.9g ", (double)planes[i]);
    bytes = volpkg_clip_shader(&package->programs.at[0].fragment, 6, NULL, 0);
    if (bytes == 0 || volpkg_clip_shader(&package->programs.at[0].fragment, 6, text, bytes) != bytes || text[0] != 0 ||
        volpkg_clip_shader(&package->programs.at[0].fragment, 6, text, bytes + 1) != bytes || strlen(text) != bytes ||
        volpkg_clip_shader(&package->programs.at[0].fragment, 13, NULL, 0) != 0)
        return 3;
    printf("\n%s", text);
    volpkg_unmap(&file);
    return 0;
}
