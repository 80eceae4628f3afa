// Adds the outline where depth jumps, and averages the samples of a pixel.
uniform sampler2D colours;
uniform sampler2D depths;
uniform int samples;
uniform float outline;
uniform float jump_mm;
uniform vec2 near_far;
uniform int perspective;
uniform vec3 line_colour;
out vec4 colour;

float distance_mm(ivec2 place) {
    place = clamp(place, ivec2(0), textureSize(depths, 0) - 1);
    float depth = texelFetch(depths, place, 0).r;
    if (depth >= 1.0) {
        return 1e9;
    }
    float n = near_far.x;
    float f = near_far.y;
    float flat_mm = n + depth * (f - n);
    float eye_mm = 2.0 * n * f / ((f + n) - (2.0 * depth - 1.0) * (f - n));
    return perspective == 1 ? eye_mm : flat_mm;
}

bool is_outline(ivec2 place) {
    float here = distance_mm(place);
    if (here > 1e8) {
        return false;
    }
    float west = distance_mm(place - ivec2(samples, 0));
    float east = distance_mm(place + ivec2(samples, 0));
    float south = distance_mm(place - ivec2(0, samples));
    float north = distance_mm(place + ivec2(0, samples));
    // Second differences: a slope is no edge, however steep.
    return west + east - 2.0 * here > jump_mm || south + north - 2.0 * here > jump_mm;
}

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * samples;
    vec3 sum = vec3(0.0);
    for (int y = 0; y < samples; y++) {
        for (int x = 0; x < samples; x++) {
            ivec2 place = first + ivec2(x, y);
            bool line = outline > 0.5 && is_outline(place);
            sum += line ? line_colour : texelFetch(colours, place, 0).rgb;
        }
    }
    colour = vec4(sum / float(samples * samples), 1.0);
}
