// An object out of a grid of its views: for each pixel, the three views around the camera's direction are
// searched for the surface along the line of sight (depth parallax), and blended. Everything is in the
// object's space; the views are parallel projections. `view_table` has five texels for each view:
//   right, nearPlane; up, farPlane; back (to the camera), codes; atlas x, y, pixels a unit, size; position
// Godot 3 (GLES3); the same as ../three/impostor_shader.js.
shader_type spatial;
render_mode unshaded, cull_front, shadows_disabled;

uniform sampler2D colour_texture : hint_albedo;
uniform sampler2D depth_texture;
uniform sampler2D view_table;
uniform int side;        // views along a side of the grid
uniform bool hemi;       // hemi-octahedral, else octahedral
uniform mat3 upright;    // turns what is up in the grid to +Y
uniform vec3 centre;     // what all views look at
uniform vec3 box_middle; // of the box that is drawn
uniform float radius;
varying vec3 place;

const int kSteps = 32;
const int kHalvings = 6;

vec4 entry(int view, int k) { return texelFetch(view_table, ivec2(k, view), 0); }

// Where a direction from the object lies on the grid, 0 .. side - 1 (stx convert --views).
vec2 onGrid(vec3 direction) {
    vec3 d = upright * direction;
    if (hemi) d.y = max(d.y, 0.0);
    d /= abs(d.x) + abs(d.y) + abs(d.z);
    vec2 p = d.xz;
    if (hemi) p = vec2(d.x + d.z, d.x - d.z);
    else if (d.y < 0.0) p = (1.0 - abs(d.zx)) * vec2(d.x < 0.0 ? -1.0 : 1.0, d.z < 0.0 ? -1.0 : 1.0);
    return (p * 0.5 + 0.5) * float(side - 1);
}

// Texel of a point in the atlas; outside of the view: below zero.
vec2 texelOf(int view, vec3 point) {
    vec4 at = entry(view, 3);
    vec3 from = point - entry(view, 4).xyz;
    vec2 inView = at.w * 0.5 + at.z * vec2(dot(from, entry(view, 0).xyz), -dot(from, entry(view, 1).xyz));
    if (any(lessThan(inView, vec2(0.5))) || any(greaterThan(inView, vec2(at.w - 0.5)))) return vec2(-1.0);
    return at.xy + inView;
}

// Distance that the view's depth image has at a texel (ISO/IEC 14496-16: code 0 is not a point, the largest the
// near plane).
float depthAt(int view, vec2 texel) {
    if (texel.x < 0.0) return 1000000000.0;
    float code = floor(texelFetch(depth_texture, ivec2(texel), 0).r * 255.0 + 0.5), codes = entry(view, 2).w;
    float near = entry(view, 0).w, far = entry(view, 1).w;
    return code < 0.5 ? 1000000000.0 : near + (1.0 - (code - 1.0) / (codes - 1.0)) * (far - near);
}

// The same between the centres of four texels, where they are on one surface.
float smoothDepthAt(int view, vec2 texel, float jump) {
    vec2 corner = floor(texel - 0.5) + 0.5, part = texel - corner;
    vec4 d = vec4(depthAt(view, corner), depthAt(view, corner + vec2(1.0, 0.0)), depthAt(view, corner + vec2(0.0, 1.0)),
                  depthAt(view, corner + vec2(1.0, 1.0)));
    float low = min(min(d.x, d.y), min(d.z, d.w)), high = max(max(d.x, d.y), max(d.z, d.w));
    if (high - low > jump) return depthAt(view, texel);
    return mix(mix(d.x, d.y, part.x), mix(d.z, d.w, part.x), part.y);
}

// How far along the ray a view sees the surface. -1: the ray meets nothing; -2: it gets behind something, so that
// what it meets there is hidden from this view. Sure: the end is on the surface, not a step behind an edge of it.
float hit(int view, vec3 eye, vec3 ray, inout bool sure) {
    vec3 back = entry(view, 2).xyz, position = entry(view, 4).xyz;
    float sink = -dot(ray, back);  // of the view's depth, along the ray
    if (sink < 0.1) return -2.0;
    float begin = entry(view, 0).w, end = entry(view, 1).w, room = (end - begin) / float(kSteps);
    float start = dot(position - eye, back);  // the depth of the eye, seen from the view, below zero
    float before = begin - room, last = 1000000000.0;
    bool hidden = false;
    for (int i = 0; i <= kSteps; ++i) {
        float dist = begin + float(i) * room;
        float there = depthAt(view, texelOf(view, eye + ray * ((dist - start) / sink)));
        // From beside the surface the ray gets behind it by a step at most; from its front side by what it slopes.
        float thick = last > 100000000.0 ? room : 3.0 * room;
        if (there <= dist && dist - there < thick) {
            float low = before, high = dist;
            for (int k = 0; k < kHalvings; ++k) {
                float middle = 0.5 * (low + high);
                vec2 texel = texelOf(view, eye + ray * ((middle - start) / sink));
                if (smoothDepthAt(view, texel, thick) <= middle) high = middle;
                else low = middle;
            }
            vec2 texel = texelOf(view, eye + ray * ((high - start) / sink));
            sure = sure || high - smoothDepthAt(view, texel, thick) < 0.25 * room;
            return (high - start) / sink;
        }
        hidden = hidden || there <= dist;
        before = dist;
        last = there;
    }
    return hidden ? -2.0 : -1.0;
}

void vertex() {
    VERTEX += box_middle;
    place = VERTEX;
}

void fragment() {
    vec3 eye = (inverse(WORLD_MATRIX) * vec4(CAMERA_MATRIX[3].xyz, 1.0)).xyz;
    vec3 ray = normalize(place - eye), towards = normalize(eye - centre);
    vec2 at = clamp(onGrid(towards), vec2(0.0), vec2(float(side - 1) - 0.001)), part = fract(at);
    ivec2 cell = ivec2(at);
    // The triangle of the grid around the direction, and its weights.
    ivec2 corner = cell + (part.x > part.y ? ivec2(1, 0) : ivec2(0, 1));
    int views[3];
    views[0] = cell.y * side + cell.x;
    views[1] = (cell.y + 1) * side + cell.x + 1;
    views[2] = corner.y * side + corner.x;
    float far = max(part.x, part.y), near = min(part.x, part.y);
    float weights[3];
    weights[0] = 1.0 - far;
    weights[1] = near;
    weights[2] = far - near;
    float along[3];
    float first = 1000000000.0, spare = 1000000000.0;
    bool sure = false;
    for (int k = 0; k < 3; ++k) {
        along[k] = hit(views[k], eye, ray, sure);
        if (along[k] > 0.0 && weights[k] > 0.02) first = min(first, along[k]);
        else if (along[k] > 0.0) spare = along[k];
    }
    if (first > 100000000.0) first = spare;  // hidden from the others
    vec4 sum = vec4(0.0);
    float seen = 0.0;
    for (int k = 0; k < 3; ++k) {
        // What is far behind the nearest is another surface, which this view sees past an edge.
        if (along[k] > first + 0.06 * radius || (sure && along[k] < -1.5)) continue;
        seen += weights[k];
        if (along[k] < 0.0) continue;
        vec2 texel = texelOf(views[k], eye + ray * along[k]);
        vec4 colour = textureLod(colour_texture, texel / vec2(textureSize(colour_texture, 0)), 0.0);
        sum += vec4(colour.rgb * colour.a, colour.a) * weights[k];
    }
    if (sum.a < 0.4 * seen || sum.a <= 0.0) discard;
    ALBEDO = sum.rgb / sum.a;
    vec4 clip = PROJECTION_MATRIX * INV_CAMERA_MATRIX * WORLD_MATRIX * vec4(eye + ray * first, 1.0);
    DEPTH = 0.5 * clip.z / clip.w + 0.5;
}
