// sRGB to linear light, 0..1, and back, from 0 (IEC 61966-2-1).
vec3 decoded(vec3 c) {
    c = clamp(c, vec3(0.0), vec3(1.0));
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThanEqual(c, vec3(0.04045)));
}
vec3 coded(vec3 c) {
    c = max(c, vec3(0.0));
    return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}
