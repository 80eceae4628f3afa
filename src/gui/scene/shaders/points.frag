uniform vec3 flagged_colour;
uniform vec3 removed_colour;
flat in float deviation_mm;
flat in int kind;
out vec4 colour;

void main() {
    vec3 shown = kind == 0 ? scale_colour(deviation_mm) : (kind == 1 ? flagged_colour : removed_colour);
    colour = vec4(shown, 1.0);
}
