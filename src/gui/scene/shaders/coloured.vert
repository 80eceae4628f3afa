uniform mat4 clip_from_scene;
uniform float point_px;
in vec3 position;
in uvec4 shown_colour;
flat out vec3 own_colour;

void main() {
    own_colour = vec3(shown_colour.rgb) / 255.0;
    if (shown_colour.a == 0u) {
        // Outside of everything: clipped away.
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        gl_PointSize = 0.0;
        return;
    }
    gl_Position = clip_from_scene * vec4(position, 1.0);
    gl_PointSize = point_px;
}
