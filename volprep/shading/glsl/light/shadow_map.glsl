//: A shadow map (Williams 1978; mobile volume rendering thesis, section 4.2). In: u_shadow, RGBA32F, NEAREST: red is
//: the distance from the light to the first place of the surface, millimetres, alpha 0 without a surface;
//: u_light_from_box, 4x4, to clip coordinates of the light's view. Word SIZE, texels of an edge. Section distance: what
//: the pass that makes it writes.
// How far the light goes, along each of its rays.
uniform highp sampler2D u_shadow;
uniform mat4 u_light_from_box;
// 1 if the light reaches a place of the surface, box millimetres, 0 if something is nearer to it. Half a voxel and two
// texels are left out, the possible error of the place, and of the surface within a texel.
float light_reaching(vec3 place_mm) {
  vec3 voxel_mm = $VOXEL / $POSITION_PER_MM;
  vec4 seen = u_light_from_box * vec4(place_mm, 1.0);
  vec4 met = texture(u_shadow, 0.5 * seen.xy / seen.w + 0.5);
  vec3 across = vec3(u_light_from_box[0].x, u_light_from_box[1].x, u_light_from_box[2].x);
  float texel_mm = 2.0 / $SIZE * seen.w / length(across);
  float margin_mm = 0.5 * min(voxel_mm.x, min(voxel_mm.y, voxel_mm.z)) + 2.0 * texel_mm;
  return met.a > 0.5 && distance(place_mm, u_light_mm) > met.r + margin_mm ? 0.0 : 1.0;
}

//#section about
// The distance from the light to the first place of the surface, millimetres; alpha is 0 without a surface.
uniform vec3 u_light_mm;
const float ISOVALUE = $ISOVALUE;
//#part touch

//#part refinement
//#section distance
$PICTURE = vec4(0.0);
if (passed > 0.0) {
  //#part hit
  $PICTURE = vec4(distance(hit / $POSITION_PER_MM, u_light_mm), 0.0, 0.0, 1.0);
}
