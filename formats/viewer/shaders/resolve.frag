// Sums -> picture, with Lee & Park's Phong light: as shaders/splat/resolve.glsl.
#include "formats/viewer/shaders/scene.glsl"
#include "shaders/shared/srgb.glsl"
uniform sampler2D frontTexture, colourSums, normalSums;
uniform float farthest;
uniform vec4 lens;
uniform mat3 worldFromCamera;
uniform vec3 eye;
uniform bool lit;
uniform vec3 lightDirection;  // the way it travels, in the world
uniform vec4 lightAmounts;    // light, ambient, specular, shininess
out vec4 picture;             // premultiplied

vec3 ambientLight() { return vec3(lightAmounts.y); }
// Pages have no environment.
vec3 environmentDiffuse(vec3 n) { return vec3(0.0); }
vec3 environmentGloss(vec3 d) { return vec3(0.0); }
vec3 specularLight() { return vec3(lightAmounts.z); }
float shininess() { return lightAmounts.w; }
float brightest() { return 1.0; }
int lightCount() { return 1; }
vec4 lightVector(int i) { return vec4(lightDirection, 0.0); }
vec3 lightColour(int i) { return vec3(lightAmounts.x); }
#include "shaders/shared/phong.glsl"

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    float front = texelFetch(frontTexture, at, 0).r;
    vec4 sum = texelFetch(colourSums, at, 0), more = texelFetch(normalSums, at, 0);
    picture = vec4(0.0);
    if (!(sum.a > 0.0)) return;
    float alpha = min(more.a / sum.a, 1.0);
    // Without a front only faint splats of a silhouette count, not the skirts of full ones.
    if (!(front < 1.0) && !(alpha < kSkirts)) return;
    picture = vec4(clamp(sum.rgb / sum.a, vec3(0.0), vec3(alpha)), alpha);
    if (!lit || !(alpha > 0.0) || !(dot(more.xyz, more.xyz) > 0.0)) return;
    vec2 ray = (vec2(at) - lens.zw) * lens.xy * vec2(1.0, -1.0);
    float dist = front < 1.0 ? front * farthest : 1.0;
    vec3 ahead = worldFromCamera * vec3(ray, -1.0);
    picture.rgb = shadeCoded(picture.rgb / alpha, eye + ahead * dist, normalize(more.xyz), -normalize(ahead)) * alpha;
}
