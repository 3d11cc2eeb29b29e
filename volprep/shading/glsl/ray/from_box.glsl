//: Rays that begin at the volume's box. In: what vertex/picture.glsl gives for each pixel.
// The ends of the pixel's ray on the near and the far plane, homogeneous box millimetres.
$VARYING_IN vec4 v_near;
$VARYING_IN vec4 v_far;
