// Where points are in the picture, and the size and shape of their splats. The processor does the same
// with vectors in lib/render/splat/cpu/; a test holds both against this. From outside: kSlopeScale.

CONSTANT float kSigmaSource2 = kSigmaSource * kSigmaSource, kSigmaPixel2 = kSigmaPixel * kSigmaPixel;

struct Point {
    TaskEntry task;
    ViewEntry view;
    vec3 a, h;     // of its pixel; see ViewEntry
    float source;  // distance in the reference view
    vec2 pixel;    // novel frame, centres at whole numbers
    float dist;    // from the novel camera
    bool flatFrame;  // the novel camera is orthographic
    bool opaque;     // of full alpha
    float largest;   // how far its splat reaches at most, pixels
};

// Places pixel (u, v) of p.view with its distance p.source; false when it is behind the camera.
bool placePoint(INOUT(Point) p, float u, float v) {
    p.a = vec3(p.view.a0) + vec3(p.view.au) * u + vec3(p.view.av) * v;
    p.h = p.a * p.source + (vec3(p.view.b0) + vec3(p.view.bu) * u + vec3(p.view.bv) * v);
    p.dist = p.h.z;
    p.pixel = p.flatFrame ? vec2(p.h) : vec2(p.h) / p.h.z;
    return p.dist > kNearest;
}

// The low-pass filter over an output pixel: close to a Gaussian of sigma 0.35, zero from 1 on.
vec2 lowPass(vec2 squared) {
    vec2 a = 1.0f - squared, b = a * a;
    return b * b;
}

// Fainter than 1/64 a small splat's weight is not worth its atomics, unless it closes the surface.
bool worthwhile(float kernel, float radius2, float core2) {
    return kernel > 1.0f / 64.0f || radius2 <= core2;
}

// A splat's footprint. Small: the 2x2 pixels around, q and core2 in squared pixels. Else an
// ellipse: q(d) = (xx, 2 xy, yy) . (dx dx, dx dy, dy dy), d in pixels from the point.
struct Splat {
    bool small;
    vec3 q;
    vec2 reach;   // of the bounding box
    float core2;  // q up to which it hides what is behind
    vec2 slope;   // distance per pixel
    float quality;
    vec4 steps;   // uAcross, vAcross, uDown, vDown; zero where colour must not be continued
};

float squaredRadius(Splat s, vec2 d) {
    return s.small ? dot(d, d) : s.q.x * d.x * d.x + s.q.y * d.x * d.y + s.q.z * d.y * d.y;
}

// Weight at d, whose squaredRadius is q. Ellipses fall off like a Gaussian and end at kReach2.
float kernelAt(Splat s, vec2 d, float q) {
    if (s.small) {
        vec2 k = lowPass(min(d * d, vec2(1.0f)));
        return k.x * k.y;
    }
    float fall = max(0.0f, 1.0f - q * (1.0f / kReach2));
    return fall * fall * fall;
}

// Distance of the splat's plane at d. One that runs through the viewpoint must not hide all.
float depthAt(float dist, vec2 slope, vec2 d) { return max(dist + dot(slope, d), 0.5f * dist); }

// Of a block whose points share a tilt: small.
Splat uniformSplat(Point p) {
    Splat s;
    s.small = true;
    s.q = vec3(0.0f);
    s.reach = vec2(1.0f);
    s.core2 = p.task.core2;
    s.slope = vec2(p.task.slopeX, p.task.slopeY) * p.dist;
    s.quality = p.task.quality;
    s.steps = vec4(p.task.uAcross, p.task.vAcross, p.task.uDown, p.task.vDown);
    return s;
}

// The paper's: round, `coefficient` pixels wide at distance 1.
Splat paperSplat(Point p, float coefficient) {
    float radius = min(max(0.5f, 0.5f * coefficient * (p.flatFrame ? 1.0f : 1.0f / p.dist)), p.largest);
    float q = kReach2 / (radius * radius);
    Splat s;
    s.small = false;
    s.q = vec3(q, 0.0f, q);
    s.reach = vec2(radius);
    s.core2 = kReach2;
    s.slope = vec2(0.0f);
    s.quality = 1.0f;
    s.steps = vec4(0.0f);
    return s;
}

// From the point's own data: its coded slopes (splat::Slope) and its size, 1 = closes the lattice.
// False when it faces away.
bool ownSplat(Point p, int codeU, int codeV, float size, bool allSmall, OUT(Splat) s) {
    // Of what is not opaque the flag says that it is glass.
    bool linked = p.opaque && (codeU & 1) != 0, rim = (codeV & 1) != 0;
    float inverse = p.flatFrame ? 1.0f : 1.0f / p.h.z;
    float back = p.flatFrame ? 0.0f : 1.0f;
    float spacing = p.view.a0.w != 0.0f ? 1.0f : p.source;
    float tiltU = float(codeU) * (spacing / kSlopeScale) / p.view.au.w;
    float tiltV = float(codeV) * (spacing / kSlopeScale) / p.view.av.w;
    // Derivatives of H and then of the pixel by u and v.
    vec3 hu = vec3(p.view.au) * p.source + vec3(p.view.bu) + p.a * tiltU;
    vec3 hv = vec3(p.view.av) * p.source + vec3(p.view.bv) + p.a * tiltV;
    vec2 eu = (vec2(hu) - back * p.pixel * hu.z) * inverse;
    vec2 ev = (vec2(hv) - back * p.pixel * hv.z) * inverse;
    float det = eu.x * ev.y - ev.x * eu.y;
    if (!(det > 0.0f)) return false;
    vec2 longer = eu + ev, other = eu - ev;
    float cover2 = size * size * 0.25f * max(dot(longer, longer), dot(other, other));
    s.small = allSmall || cover2 < kSmallCover2;
    // The plane's distance per pixel; nearly edge-on it would run away.
    vec2 relative = vec2(hu.z * ev.y - hv.z * eu.y, hv.z * eu.x - hu.z * ev.x) / (det * p.h.z);
    s.slope = clamp(relative, vec2(-kSteepestPlane), vec2(kSteepestPlane)) * p.dist;
    float density = 1.0f / max(1.0f, max(dot(eu, eu), dot(ev, ev)));
    s.quality = p.task.quality * (linked ? 1.0f : kEdgeQuality) * max(density * density, kLeastDensity);
    float fade = linked ? clamp(det / kFadeTo - 1.0f, 0.0f, 1.0f) : 0.0f;
    s.steps = vec4(ev.y, -eu.y, -ev.x, eu.x) * (fade * 0.5f * kGradient / det);
    if (s.small) {
        // At its rim the surface ends within half a sample.
        s.core2 = max(0.5f, 1.08f * cover2) * (rim ? kRimCore2 : 1.0f);
        return true;
    }
    // The lattice's Gaussian carried into the picture, and the low-pass filter added.
    s.core2 = kCore2;
    float k = kSigmaSource2 * size * size;
    float vxx = k * (eu.x * eu.x + ev.x * ev.x) + kSigmaPixel2;
    float vyy = k * (eu.y * eu.y + ev.y * ev.y) + kSigmaPixel2;
    float vxy = k * (eu.x * eu.y + ev.x * ev.y);
    // vxx vyy - vxy vxy without cancellation.
    float determinant = k * k * det * det + kSigmaPixel2 * (vxx + vyy - kSigmaPixel2);
    s.q = vec3(vyy / determinant, -2.0f * vxy / determinant, vxx / determinant);
    s.reach = min(vec2(sqrt(kDrawn2 * vxx), sqrt(kDrawn2 * vyy)), vec2(p.largest));
    return true;
}
