// One triangle over the whole target.
in vec2 corner;
out vec2 uv;

void main() {
    uv = corner;
    gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
