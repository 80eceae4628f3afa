// The deviation map on the CAD's face.
uniform vec3 reverse_colour;
uniform vec3 hatch_light;
uniform vec3 hatch_dark;
uniform float hatch_px;
uniform float line_mm;
in vec3 normal_eye;
uniform float mm_per_px;
in vec4 value_known;
out vec4 colour;

void main() {
    bool reverse = !gl_FrontFacing;
    vec3 normal = normalize(normal_eye) * (reverse ? -1.0 : 1.0);
    // A sheet square to the eye has 0.686 and lies in the middle of the scale, as on paper; never darker than 0.88.
    float cosine = dot(normal, normalize(vec3(-0.75, 0.75, 1.0)));
    float light = 0.88 + 0.12 * clamp(0.55 + 3.5 * (cosine - 0.686), 0.0, 1.0);
    float known = value_known.y;
    float deviation_mm = value_known.x / max(known, 1e-3);
    // Lines of equal deviation, about a pixel wide, where there is form: a fiftieth of a millimetre a millimetre.
    float level = value_known.z / max(known, 1e-3) / line_mm;
    float slope = fwidth(level);
    float form = fwidth(value_known.w / max(known, 1e-3));
    float to_line = abs(level - floor(level + 0.5));
    vec3 shown;
    if (reverse) {
        shown = reverse_colour;
    } else if (known < 0.5) {
        float stripe = mod(gl_FragCoord.x + gl_FragCoord.y, hatch_px);
        shown = stripe < 0.5 * hatch_px ? hatch_dark : hatch_light;
    } else {
        shown = scale_colour(deviation_mm);
        if (to_line < 0.6 * slope && slope < 0.35 && form > 0.02 * mm_per_px) {
            shown *= 0.74;
        }
    }
    colour = vec4(shown * light, 1.0);
}
