//: Rays that begin and end at proxy geometry, behind from_box.glsl or tiles/cost.glsl. Words: PLACE, the pixel in the
//: picture, from 0 to 1; MARGIN_MM. Sections: place, what vertex/picture.glsl gives of it; start, the first and the
//: last sample.
// Where the rays of pixels meet the mesh first and last, in 16 bits each, as parts of the ray inside the box.
uniform highp sampler2D u_mesh;
// Rays begin this much before the mesh, and end this much behind it: the resolution of the depth buffer and of 16 bits
// is less.
const float MARGIN_MM = $MARGIN_MM;
//#section place
// The pixel in the picture, from 0 to 1.
$VARYING_IN vec2 v_place;
//#section start
// The samples that are taken: those outside the mesh see nothing, and the others stay where they are.
vec4 bytes = floor($TEXTURE_2D(u_mesh, $PLACE) * 255.0 + 0.5);
vec2 met = (256.0 * bytes.xz + bytes.yw) / 65535.0 * count;
float margin = MARGIN_MM / max(length_mm, 1e-9) * count;
float entered = 0.5 + max(floor(met.x - margin - 0.5), 0.0);
float left = met.y > 0.0 ? min(ceil(met.y + margin + 0.5), count) : 0.0;
