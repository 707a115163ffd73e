// The outermost and innermost point along the direction of the outline, and how many points tell; blended
// as the largest, and the last as a sum.
precision highp float;
precision highp sampler2D;
uniform sampler2D directionTexture;
flat in vec2 centre;
out vec4 reach;  // outermost, minus innermost, pixels; 0; points

const float kBeside = 0.6;

void main() {
    vec2 d = centre - (gl_FragCoord.xy - 0.5), n = texelFetch(directionTexture, ivec2(gl_FragCoord.xy), 0).xy;
    if (n == vec2(0.0) || abs(n.x * d.y - n.y * d.x) > kBeside) discard;
    float along = dot(n, d);
    reach = vec4(along, -along, 0.0, 1.0);
}
