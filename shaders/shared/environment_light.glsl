// Light of an environment on a surface of a normal of length 1, over pi: spherical harmonics up to
// order 2 (Ramamoorthi & Hanrahan, An Efficient Representation for Irradiance Environment Maps,
// SIGGRAPH 2001), their constants multiplied into the coefficients. From outside: vec3 harmonic(i).
vec3 harmonicLight(vec3 n) {
    vec3 sum = harmonic(0) + harmonic(1) * n.y + harmonic(2) * n.z + harmonic(3) * n.x;
    sum += harmonic(4) * (n.x * n.y) + harmonic(5) * (n.y * n.z) + harmonic(7) * (n.x * n.z);
    sum += harmonic(6) * (3.0f * n.z * n.z - 1.0f) + harmonic(8) * (n.x * n.x - n.y * n.y);
    return max(sum, vec3(0.0f));
}
