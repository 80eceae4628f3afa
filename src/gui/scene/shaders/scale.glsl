// The palette as report/palette.rs lays it over a range: linear between stops, in bands if there are any.
uniform vec3 stops[9];
uniform int stop_count;
uniform float range_mm;
uniform float bands;

vec3 scale_colour(float deviation_mm) {
    float value = clamp(deviation_mm / range_mm, -1.0, 1.0);
    if (bands > 0.5) {
        float band = min(floor((value + 1.0) * 0.5 * bands), bands - 1.0);
        value = (band + 0.5) * 2.0 / bands - 1.0;
    }
    float place = (value + 1.0) * 0.5 * float(stop_count - 1);
    int low = min(int(place), stop_count - 2);
    return mix(stops[low], stops[low + 1], place - float(low));
}
