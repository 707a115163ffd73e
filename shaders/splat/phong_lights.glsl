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
vec3 specularLight() { return frame.specular.rgb; }
float shininess() { return frame.specular.w; }
int lightCount() { return frame.counts.w; }
