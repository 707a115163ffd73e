// Which way the outline runs beside a pixel, from what is open around it: lib/render/outline/outlines.cpp.
precision highp float;
precision highp sampler2D;
uniform sampler2D pictureTexture;
out vec4 direction;  // xy out of the object, length 1; zero where no outline is asked for

const int kAround = 2;
const float kLeastDirection = 0.15;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(pictureTexture, 0) - 1;
    direction = vec4(0.0);
    if (!(texelFetch(pictureTexture, at, 0).a > 0.0)) return;
    vec2 sum = vec2(0.0);
    float all = 0.0;
    for (int y = -kAround; y <= kAround; ++y)
        for (int x = -kAround; x <= kAround; ++x) {
            if (x == 0 && y == 0) continue;
            float weight = 1.0 / float(x * x + y * y);
            all += weight;
            ivec2 beside = at + ivec2(x, y);
            bool outside = any(lessThan(beside, ivec2(0))) || any(greaterThan(beside, last));
            if (!outside && !(texelFetch(pictureTexture, beside, 0).a > 0.0)) sum += weight * vec2(x, y);
        }
    if (length(sum) > kLeastDirection * all) direction.xy = normalize(sum);
}
