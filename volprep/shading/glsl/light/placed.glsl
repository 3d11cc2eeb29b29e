//: A light with a place (Phong 1975; Blinn 1977), on both sides of a surface. In: u_light_mm, box millimetres. Slot
//: normals gives normal_at, slot shadow light_reaching. Words: SHINE, the cosine that makes a highlight; REACHING and
//: SHADED, a parameter and a factor where there are shadows. Section sample: in the loop, after `medium`.
//#part normals

uniform vec3 u_light_mm;
const float AMBIENT = $AMBIENT;
const float DIFFUSE = $DIFFUSE;
const float SPECULAR = $SPECULAR;
const float SHININESS = $SHININESS;
//#part shadow
// A colour as the light shows it on a surface with this normal, which is towards the viewer; all vectors have length 1.
vec3 lit(vec3 colour, vec3 normal, vec3 to_light, vec3 to_viewer$REACHING) {
  float facing = dot(normal, to_light);
  float shine = facing > 0.0 ? SPECULAR * pow(max($SHINE, 0.0), SHININESS) : 0.0;
  return min(colour * (AMBIENT + DIFFUSE * max(facing, 0.0)$SHADED) + shine$SHADED, 1.0);
}
//#section sample
if (medium.a > 0.0) {
  vec3 place = $LIT_AT;
  vec3 normal = $NORMAL;
  float squared = dot(normal, normal);
  normal *= (dot(normal, direction) > 0.0 ? -1.0 : 1.0) * inversesqrt(max(squared, 1e-30));
  vec3 to_light = normalize(u_light_mm - place / $POSITION_PER_MM);
  vec3 surface = lit(medium.rgb, normal, to_light, -direction);
  // With a short normal a sample is hardly a surface, and keeps its colour.
  medium.rgb = mix(medium.rgb, surface, squared / (squared + $SOFT_SQUARED));
}
