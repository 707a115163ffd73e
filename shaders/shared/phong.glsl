// Phong lighting with any number of lights. From outside: vec3 ambientLight(), vec3 specularLight()
// (the material's), float shininess(), int lightCount(), vec3 lightColour(i),
//   vec4 lightVector(i)  w = 0: the way the light travels, w = 1: its position
//   vec3 environmentDiffuse(vec3 normal), vec3 environmentGloss(vec3 direction)  0 where there is
//   none
//   vec3 decoded(vec3), vec3 coded(vec3)  sRGB to linear light, 0..1, and back, from 0
//   float brightest()  the linear light at which sRGB-coded colours stop
// All vectors in one space; `normal` and `toEye` of length 1.
vec3 shadePhong(vec3 albedo, vec3 position, vec3 normal, vec3 toEye) {
    vec3 diffuse = ambientLight() + environmentDiffuse(normal);
    vec3 gloss = environmentGloss(normal * (2.0f * dot(normal, toEye)) - toEye);
    for (int i = 0; i < lightCount(); ++i) {
        vec4 v = lightVector(i);
        vec3 toLight = v.w == 0.0f ? -vec3(v) : vec3(v) - position;
        float away = length(toLight);
        if (!(away > 0.0f)) continue;
        vec3 l = toLight / away;
        float cosine = dot(normal, l);
        if (cosine <= 0.0f) continue;
        diffuse += lightColour(i) * cosine;
        float mirrored = dot(normal * (2.0f * cosine) - l, toEye);
        if (mirrored > 0.0f) gloss += lightColour(i) * pow(mirrored, shininess());
    }
    return albedo * diffuse + gloss * specularLight();
}

// Light adds up only as linear light: sRGB-coded colours are decoded for it, and coded again.
vec3 shadeCoded(vec3 albedo, vec3 position, vec3 normal, vec3 toEye) {
    return coded(min(shadePhong(decoded(albedo), position, normal, toEye), vec3(brightest())));
}
