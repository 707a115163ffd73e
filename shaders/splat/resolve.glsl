// Sums -> picture: normalises, settles silhouettes, lights; resolveBlended() in
// lib/render/splat/cpu/cpu_splat.cpp does the same. RASTER: the sums are textures, else buffers as
// splat.comp leaves them. LIT: Phong.
#include "splat/splat_frame.glsl"
#include "splat/phong_lights.glsl"
#include "shared/phong.glsl"
#define CHANNELS (4 + TRANSLUCENT + 3 * NORMALS)
#if ACCUMULATE == 2
#define STRIDE ((CHANNELS + 1) / 2 * 2)
#else
#define STRIDE CHANNELS
#endif
#if RASTER
uniform sampler2D frontTexture;
uniform sampler2D colourSums;
uniform sampler2D alphaSums;
uniform sampler2D normalSums;
#else
layout(std430, binding = 3) readonly buffer FrontBuffer { uint front[]; };
#if ACCUMULATE == 1
layout(std430, binding = 4) readonly buffer SumBuffer { float sums[]; };
#else
layout(std430, binding = 4) readonly buffer SumBuffer { int sums[]; };
#endif
#endif

const float kNone = 3.0e38;

float frontAt(ivec2 at) {
#if RASTER
    return texelFetch(frontTexture, at + frame.frameSize.w, 0).r;
#else
    return uintBitsToFloat(front[(at.y + 1) * frame.frameSize.z + at.x + 1]);
#endif
}

#if !RASTER
// Channel k of the pixel whose channels begin at j.
float sumOf(int j, int k) {
#if ACCUMULATE == 2
    // The upper half of a 64-bit sum lends one to a lower half below zero.
    if ((k & 1) == 1) return float(sums[j + k] + (sums[j + k - 1] < 0 ? 1 : 0));
#endif
    return float(sums[j + k]);
}
#endif

vec3 worldPosition(vec2 pixel, float dist) {
    vec2 ray = (pixel - frame.novelLens.zw) * frame.novelLens.xy * vec2(1.0, -1.0);
    float spread = orthographic() ? 1.0 : dist;
    return frame.novelPosition.xyz + frame.novelAxisX.xyz * (ray.x * spread) + frame.novelAxisY.xyz * (ray.y * spread) -
           frame.novelAxisZ.xyz * dist;
}

// What a pixel of the frame shows; `albedo` is its colour without light.
void resolvePixel(ivec2 at, out vec4 colour, out float dist, out vec3 normal, out vec4 albedo) {
    dist = frontAt(at);
    colour = vec4(0.0);
    normal = vec3(0.0);
#if RASTER
    vec4 sum = texelFetch(colourSums, at + frame.frameSize.w, 0);
    if (sum.a > 0.0) {
        colour = vec4(sum.rgb / sum.a, 1.0);
#if TRANSLUCENT
        colour.a = texelFetch(alphaSums, at + frame.frameSize.w, 0).r / sum.a;
#endif
#if NORMALS
        normal = texelFetch(normalSums, at + frame.frameSize.w, 0).xyz / sum.a;
#endif
    }
#else
    int j = ((at.y + 1) * frame.frameSize.z + at.x + 1) * STRIDE;
    float weight = sumOf(j, 3);
    if (weight > 0.0) {
        float scale = 1.0 / (weight * frame.scales.y);
        colour = vec4(vec3(sumOf(j, 0), sumOf(j, 1), sumOf(j, 2)) * scale, 1.0);
#if TRANSLUCENT
        colour.a = min(sumOf(j, 4) * scale, 1.0);
#endif
#if NORMALS
        const int n = 4 + TRANSLUCENT;
        normal = vec3(sumOf(j, n), sumOf(j, n + 1), sumOf(j, n + 2)) * (2.0 * scale) - 1.0;
#endif
    }
#endif
    // Continued colours may leave what a picture holds.
    colour.rgb = max(colour.rgb, vec3(0.0));
#if !LINEAR
    colour.rgb = min(colour.rgb, vec3(colour.a));
#endif
    if (!(dist < kNone)) {
#if TRANSLUCENT
        // Only faint splats of a silhouette reach here, or only the skirts of full ones.
        if (!(colour.a < kSkirts)) colour = vec4(0.0);
        if (colour.a > 0.0) {
            if (at.x > 0) dist = min(dist, frontAt(at - ivec2(1, 0)));
            if (at.y > 0) dist = min(dist, frontAt(at - ivec2(0, 1)));
            if (at.x + 1 < frame.frameSize.x) dist = min(dist, frontAt(at + ivec2(1, 0)));
            if (at.y + 1 < frame.frameSize.y) dist = min(dist, frontAt(at + ivec2(0, 1)));
        }
#else
        colour = vec4(0.0);
#endif
        if (!(dist < kNone)) dist = uintBitsToFloat(0x7f800000u);
    }
    albedo = colour;
#if NORMALS
    float length2 = dot(normal, normal);
    normal = length2 > 1e-6 && colour.a > 0.0 ? normal * inversesqrt(length2) : vec3(0.0);
#endif
#if LIT
    if (colour.a > 0.0 && normal != vec3(0.0)) {
        vec3 world = worldPosition(vec2(at) + 0.5, dist < kNone ? dist : 1.0);
        vec3 ahead = worldPosition(vec2(at) + 0.5, 1.0) - frame.novelPosition.xyz;
        vec3 toEye = orthographic() ? frame.novelAxisZ.xyz : -normalize(ahead);
        #if LINEAR
        colour.rgb = shadePhong(colour.rgb / colour.a, world, normal, toEye) * colour.a;
#else
        colour.rgb = shadeCoded(colour.rgb / colour.a, world, normal, toEye) * colour.a;
#endif
    }
#endif
}
