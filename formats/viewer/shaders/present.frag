// The picture on the screen: averaged where it was drawn larger, row 0 on top.
precision highp float;
precision highp sampler2D;
uniform sampler2D pictureTexture;
uniform int factor;  // of the picture's size to the canvas'
out vec4 shown;

void main() {
    int height = textureSize(pictureTexture, 0).y;
    ivec2 at = ivec2(gl_FragCoord.xy) * factor;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < factor; ++y)
        for (int x = 0; x < factor; ++x)
            sum += texelFetch(pictureTexture, ivec2(at.x + x, height - 1 - (at.y + y)), 0);
    shown = sum / float(factor * factor);
}
