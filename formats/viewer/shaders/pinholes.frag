// Closes single open pixels, as lib/render/splat/pinholes.cpp: what opens between two surfaces belongs to
// the one behind.
precision highp float;
precision highp sampler2D;
uniform sampler2D pictureTexture, frontTexture;
uniform int enclosing;  // neighbours that close a pixel, of eight
out vec4 picture;

const float kSameDepth = 0.97;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(pictureTexture, 0) - 1;
    picture = texelFetch(pictureTexture, at, 0);
    if (picture.a > 0.0 || any(equal(at, ivec2(0))) || any(equal(at, last))) return;
    int covered = 0;
    float most = 0.0;
    for (int k = 0; k < 9; ++k) {
        ivec2 beside = at + ivec2(k % 3, k / 3) - 1;
        float front = texelFetch(frontTexture, beside, 0).r;
        if (!(front < 1.0)) continue;
        ++covered;
        most = max(most, front);
    }
    if (covered < enclosing) return;
    vec4 sum = vec4(0.0);
    float count = 0.0;
    for (int k = 0; k < 9; ++k) {
        ivec2 beside = at + ivec2(k % 3, k / 3) - 1;
        float front = texelFetch(frontTexture, beside, 0).r;
        if (!(front < 1.0) || front < kSameDepth * most) continue;
        sum += texelFetch(pictureTexture, beside, 0);
        count += 1.0;
    }
    picture = sum / count;
}
