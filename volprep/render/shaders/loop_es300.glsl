//: GLSL ES 3.00: a loop may end where the ray does.
for (float i = 0.5; i < count; i++) {
