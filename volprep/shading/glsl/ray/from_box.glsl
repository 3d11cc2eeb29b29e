//: Rays that begin at the volume's box. In: what vertex/picture.glsl gives for each pixel. Section
//: backwards: for rays that run towards the viewer.
// The ends of the pixel's ray on the near and the far plane, homogeneous box millimetres.
$VARYING_IN vec4 v_near;
$VARYING_IN vec4 v_far;
//#section backwards
// The ray runs from its far end to the near one.
