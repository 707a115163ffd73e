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
// Behind the lights, where ambient.w says so. Gloss has no place here; the processor draws it.
vec3 harmonic(int i) { return lightColour(frame.counts.w + i); }
#include "shared/environment_light.glsl"
vec3 environmentDiffuse(vec3 n) { return frame.ambient.w > 0.0 ? harmonicLight(n) : vec3(0.0); }
vec3 environmentGloss(vec3 direction) { return vec3(0.0); }
vec3 specularLight() { return frame.specular.rgb; }
float shininess() { return frame.specular.w; }
int lightCount() { return frame.counts.w; }
#include "shared/srgb.glsl"
