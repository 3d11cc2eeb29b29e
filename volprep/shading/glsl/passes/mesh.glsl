//: First pass over proxy geometry, both dialects, highp throughout. In: v_at and v_clip of vertex/mesh.glsl. Out: where
//: the ray meets the face, twice: an app draws the nearest faces into red and green and the farthest into blue and
//: alpha. Slots: dialect; box, ray/box.glsl.
//#part dialect
// A point of the mesh, box millimetres; and x, y and w of its clip coordinates.
$VARYING_IN vec3 v_at;
$VARYING_IN vec3 v_clip;
uniform mat4 u_box_from_clip;
// An end of the pixel's ray: on the near plane at depth -1, on the far plane at depth 1.
vec3 ray_end(float depth) {
  vec4 at = u_box_from_clip * vec4(v_clip.xy / v_clip.z, depth, 1.0);
  return at.xyz / at.w;
}

//#part box

void main() {
  vec3 origin = ray_end(-1.0);
  vec3 ray = ray_end(1.0) - origin;
  //#part inside
  float fraction = dot(v_at - origin, ray) / dot(ray, ray);
  // The place in the part of the ray inside the box, in 16 bits. 0 is for pixels without the mesh.
  float place = (fraction - inside.x) / max(inside.y - inside.x, 1e-9);
  float digits = clamp(floor(65535.0 * place + 0.5), 1.0, 65535.0);
  float high = floor(digits / 256.0);
  vec2 bytes = vec2(high, digits - 256.0 * high) / 255.0;
  $PICTURE = bytes.xyxy;
}
