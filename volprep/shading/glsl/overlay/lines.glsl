//: Fragment shader of lines. In: u_colour, linear light.
//#part dialect
// Lines of one colour.
uniform vec3 u_colour;
void main() {
  $PICTURE = vec4(u_colour, 1.0);
}
