#include "lib/model/linear_planes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "lib/model/srgb8.hpp"
#include "lib/model/texture.hpp"

namespace stx {
namespace {

TEST(LinearPlanes, EachPixelIsThatOfThePlainFormulaBitForBit) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    std::vector<glm::vec4> pixels;
    for (int i = 0; i < 4001; ++i) {
        const float a = i % 3 == 0 ? 1.0f : i % 7 == 0 ? 0.0f : unit(random);
        glm::vec4 p(unit(random) * a, unit(random) * a, unit(random) * a, a);
        // Brighter than white, darker than black, without a number.
        if (i % 101 == 0) p.g = 3 * a;
        if (i % 103 == 0) p.b = -0.5f;
        if (i % 211 == 0) p.r = NAN;
        if (i % 401 == 0) p.a = NAN;
        if (i % 7 == 0 && i % 2 == 0) p.r = 0.25f;  // colour without alpha
        pixels.push_back(p);
    }
    std::vector<float> values(4 * pixels.size());
    std::array<float*, 4> planes{};
    for (std::size_t c = 0; c < 4; ++c) planes[c] = values.data() + c * pixels.size();
    linearPlanes(pixels.data(), pixels.size(), planes);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const glm::vec4 p = pixels[i];
        glm::vec4 expected = p;
        for (int c = 0; c < 3 && p.a > 0; ++c) {
            const float coded = p[c] / p.a;
            expected[c] = (coded > 1 ? linearFromSrgb(coded) : linearByTable(coded)) * p.a;
        }
        for (int c = 0; c < 4; ++c) {
            if (std::isnan(expected[c])) {
                EXPECT_TRUE(std::isnan(planes[c][i])) << i << ' ' << c;
                continue;
            }
            ASSERT_EQ(std::bit_cast<std::uint32_t>(planes[c][i]),
                      std::bit_cast<std::uint32_t>(expected[c]))
                << i << ' ' << c;
        }
    }
}

}  // namespace
}  // namespace stx
