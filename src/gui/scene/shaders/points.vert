uniform mat4 clip_from_scene;
uniform float point_px;
uniform int shown_classes;
in vec3 position;
in float deviation;
in uint shown_class;
flat out float deviation_mm;
flat out int kind;

void main() {
    kind = int(shown_class);
    deviation_mm = deviation;
    if (((shown_classes >> kind) & 1) == 0) {
        // Outside of everything: clipped away.
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        gl_PointSize = 0.0;
        return;
    }
    gl_Position = clip_from_scene * vec4(position, 1.0);
    gl_PointSize = point_px;
}
