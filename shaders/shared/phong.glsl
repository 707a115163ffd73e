// Phong lighting with any number of lights; the twin of shadePhong() in lib/render/lighting.cpp.
struct PhongLight {
    vec4 vector;  // w = 0: the way the light travels, w = 1: where it stands; world
    vec4 colour;
};
#if RASTER
uniform samplerBuffer lightBuffer;
PhongLight lightAt(int i) {
    return PhongLight(texelFetch(lightBuffer, 2 * i), texelFetch(lightBuffer, 2 * i + 1));
}
#else
layout(std430, binding = 5) readonly buffer LightBuffer { PhongLight lights[]; };
PhongLight lightAt(int i) { return lights[i]; }
#endif

vec3 shadePhong(vec3 albedo, vec3 position, vec3 normal, vec3 toEye) {
    vec3 diffuse = ambient.rgb, gloss = vec3(0.0);
    for (int i = 0; i < counts.w; ++i) {
        PhongLight light = lightAt(i);
        vec4 v = light.vector;
        vec3 toLight = v.w == 0.0 ? -v.xyz : v.xyz - position;
        float length2 = dot(toLight, toLight);
        if (!(length2 > 0.0)) continue;
        vec3 l = toLight * inversesqrt(length2);
        float cosine = dot(normal, l);
        if (cosine <= 0.0) continue;
        diffuse += light.colour.rgb * cosine;
        float mirrored = dot(normal * (2.0 * cosine) - l, toEye);
        if (mirrored > 0.0) gloss += light.colour.rgb * pow(mirrored, specular.w);
    }
    return albedo * diffuse + gloss * specular.rgb;
}
