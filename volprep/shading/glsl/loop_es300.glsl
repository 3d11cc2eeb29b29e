//: GLSL ES 3.00: a loop may end where the ray does.
for (float i = $FIRST; i < count; i++) {
