uniform mat4 clip_from_scene;
in vec3 position;

void main() {
    gl_Position = clip_from_scene * vec4(position, 1.0);
    // A little towards the eye, so that a rim is not lost in its own face.
    gl_Position.z -= 0.0004 * gl_Position.w;
}
