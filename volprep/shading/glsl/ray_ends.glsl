//: What vertex.glsl gives for each pixel.
$VARYING_IN vec4 v_near;
$VARYING_IN vec4 v_far;
