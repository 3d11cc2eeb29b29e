// A package on a screen: open once, resize for each surface, draw for each frame. Errors are std::runtime_error.
#pragma once
#include <cstddef>

void viewer_open(const void* data, std::size_t bytes);
void viewer_resize(int width, int height);
void viewer_turn(float across, float down);
void viewer_draw();
