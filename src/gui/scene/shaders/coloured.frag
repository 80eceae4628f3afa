flat in vec3 own_colour;
out vec4 colour;

void main() {
    colour = vec4(own_colour, 1.0);
}
