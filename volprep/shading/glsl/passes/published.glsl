//: Second pass, as Congote et al. (2011) published it, on the front faces: where the ray enters the box is
//: interpolated, where it leaves is read from a colour of the first pass. Sections: ends of the ray; inside.
// Where the pixel's ray enters the box, box millimetres; and x, y and w of its clip coordinates.
$VARYING_IN vec3 v_at;
$VARYING_IN vec3 v_clip;
uniform highp sampler2D u_exit;
const vec3 BOX_MM = $BOX_MM;
//#section ends
vec4 near_end = vec4(v_at, 1.0);
vec4 far_end = vec4($TEXTURE_2D(u_exit, 0.5 * v_clip.xy / v_clip.z + 0.5).rgb * BOX_MM, 1.0);
//#section inside
vec2 inside = vec2(0.0, 1.0);
