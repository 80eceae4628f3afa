uniform mat4 clip_from_scene;
uniform mat3 eye_from_scene;
in vec3 position;
in vec3 normal;
out vec3 normal_eye;
#ifdef WITH_VALUES
in vec4 value;
out vec4 value_known;
#endif

void main() {
    gl_Position = clip_from_scene * vec4(position, 1.0);
    normal_eye = eye_from_scene * normal;
#ifdef WITH_VALUES
    value_known = value;
#endif
}
