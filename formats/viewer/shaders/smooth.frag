// Whether a block of points is smooth (lib/render/splat/plan.cpp), a pixel for each block.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp usampler2DArray;
precision highp isampler2DArray;
uniform sampler2D blockTable;  // first texel, columns + 32 rows, 2 layer + 1 where its depths allow it
uniform sampler2DArray colourTexture;
uniform usampler2DArray depthTexture;
uniform isampler2DArray slopeTexture;
out vec4 smoothOut;

const float kSmoothSlopes = 0.35, kSlopeScale = 2048.0;

void main() {
    vec4 block = texelFetch(blockTable, ivec2(gl_FragCoord.xy), 0);
    int size = int(block.z), layer = int(block.w) >> 1;
    ivec2 least = ivec2(32767), most = ivec2(-32768);
    for (int y = 0; y < size >> 5; ++y)
        for (int x = 0; x < (size & 31); ++x) {
            ivec3 texel = ivec3(ivec2(block.xy) + ivec2(x, y), layer);
            if (texelFetch(depthTexture, texel, 0).r == 0u || !(texelFetch(colourTexture, texel, 0).a > 0.0)) continue;
            ivec2 slope = texelFetch(slopeTexture, texel, 0).xy;
            least = min(least, slope);
            most = max(most, slope);
        }
    bool even = all(lessThan(vec2(most - least), vec2(kSmoothSlopes * kSlopeScale)));
    smoothOut = vec4(even && (int(block.w) & 1) == 1 ? 1.0 : 0.0);
}
