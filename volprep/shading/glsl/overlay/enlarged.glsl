//: Fragment shader of the small picture, as large as the one that is drawn. In: v_at; u_small, premultiplied, with
//: filter LINEAR and CLAMP_TO_EDGE.
//#part dialect
// A small picture, enlarged.
uniform sampler2D u_small;
$VARYING_IN vec2 v_at;
void main() {
  $PICTURE = $TEXTURE_2D(u_small, v_at);
}
