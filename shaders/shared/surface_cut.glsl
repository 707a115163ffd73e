// Polygons that reach behind the camera, in C++ and GLSL.

// From a corner, homogeneous as of toSamples(), to sample position and q.
INLINE vec3 placed(vec4 corner) { return vec3(corner) * (1.0f / corner.w); }

// The corners of what is in front of the camera of such a convex polygon, and how many these are: none, or 3 to 5.
INLINE int cutInFront(vec4 a, vec4 b, vec4 c, vec4 d, OUT_ARRAY(vec3, kept, 5)) {
    float cut = kNearestShare * max(max(a.w, b.w), max(c.w, d.w));
    int count = 0;
    if (!(cut > 0.0f)) return count;
    vec4 from = a;
    for (int i = 0; i < 4; ++i) {
        vec4 to = i == 0 ? b : i == 1 ? c : i == 2 ? d : a;
        if (from.w >= cut) kept[count++] = placed(from);
        if ((from.w >= cut) != (to.w >= cut))
            kept[count++] = placed(from + (to - from) * ((from.w - cut) / (from.w - to.w)));
        from = to;
    }
    return count;
}
