// The lights of a frame as shared/phong.glsl asks for them.
#if RASTER
uniform samplerBuffer lightBuffer;
vec4 lightVector(int i) { return texelFetch(lightBuffer, 2 * i); }
vec3 lightColour(int i) { return texelFetch(lightBuffer, 2 * i + 1).rgb; }
#else
layout(std430, binding = 5) readonly buffer LightBuffer { LightEntry lights[]; };
vec4 lightVector(int i) { return lights[i].vector; }
vec3 lightColour(int i) { return lights[i].colour.rgb; }
#endif
vec3 ambientLight() { return frame.ambient.rgb; }
// Behind the lights, where ambient.w is above 0: what an environment gives (EnvironmentLight).
vec3 harmonic(int i) { return lightColour(frame.counts.w + i); }
#include "shared/environment_light.glsl"
vec3 environmentDiffuse(vec3 n) { return frame.ambient.w > 0.0 ? harmonicLight(n) : vec3(0.0); }
// Behind those, where it is above 1: EnvironmentLight::glossTable(), bilinear.
const int kGlossSide = 32;
vec3 glossTexel(int face, ivec2 at) {
    int row = face * (kGlossSide + 2) + at.y;
    return lightColour(frame.counts.w + 9 + row * (kGlossSide + 2) + at.x);
}
vec3 environmentGloss(vec3 d) {
    if (!(frame.ambient.w > 1.0)) return vec3(0.0);
    vec3 size = abs(d);
    int face;
    vec3 p;  // across, up, towards the face
    if (size.z >= size.x && size.z >= size.y) {
        face = d.z < 0.0 ? 0 : 1;
        p = vec3(d.z < 0.0 ? d.x : -d.x, d.y, size.z);
    } else if (size.x >= size.y) {
        face = d.x < 0.0 ? 2 : 3;
        p = vec3(d.x < 0.0 ? -d.z : d.z, d.y, size.x);
    } else {
        face = d.y > 0.0 ? 4 : 5;
        p = vec3(d.x, d.y > 0.0 ? d.z : -d.z, size.y);
    }
    vec2 at = (vec2(0.5) + vec2(0.5, -0.5) * p.xy / p.z) * float(kGlossSide) + 0.5;
    ivec2 low = clamp(ivec2(at), ivec2(0), ivec2(kGlossSide));
    vec2 part = at - vec2(low);
    vec3 above = mix(glossTexel(face, low), glossTexel(face, low + ivec2(1, 0)), part.x);
    vec3 below =
        mix(glossTexel(face, low + ivec2(0, 1)), glossTexel(face, low + ivec2(1, 1)), part.x);
    return mix(above, below, part.y);
}
vec3 specularLight() { return frame.specular.rgb; }
float shininess() { return frame.specular.w; }
float brightest() { return frame.novelAxisY.w; }
int lightCount() { return frame.counts.w; }
#include "shared/srgb.glsl"
