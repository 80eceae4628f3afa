// The CAD in one colour, lit so that its form is seen.
uniform vec3 cad_colour;
in vec3 normal_eye;
out vec4 colour;

void main() {
    vec3 normal = normalize(normal_eye);
    float side = gl_FrontFacing ? 1.0 : -1.0;
    normal *= side;
    float key = max(dot(normal, normalize(vec3(-0.55, 0.65, 0.75))), 0.0);
    float fill = max(dot(normal, normalize(vec3(0.8, -0.2, 0.6))), 0.0);
    float light = 0.42 + 0.52 * key + 0.16 * fill;
    vec3 half_way = normalize(vec3(-0.55, 0.65, 1.75));
    float gloss = pow(max(dot(normal, half_way), 0.0), 28.0);
    colour = vec4(cad_colour * light * (side < 0.0 ? 0.84 : 1.0) + 0.10 * gloss, 1.0);
}
