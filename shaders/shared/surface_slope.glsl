// The slope out of the differences to both sides, where there are any: the smaller when it is under
// half of the other, which then crosses a crease, else their mean.
INLINE float chooseSlope(bool hasA, float a, bool hasB, float b) {
    if (hasA && hasB) {
        if (abs(a) < 0.5f * abs(b)) return a;
        if (abs(b) < 0.5f * abs(a)) return b;
        return 0.5f * (a + b);
    }
    return hasA ? a : hasB ? b : 0.0f;
}
