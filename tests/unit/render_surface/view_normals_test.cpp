#include "lib/render/surface/view_normals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace stx::surface {
namespace {

TEST(ViewNormals, AreThoseBetweenFourPixels) {
    constexpr int kWidth = 13, kHeight = 9;
    std::mt19937 random(1);
    const auto between = [&](float from, float to) {
        return std::uniform_real_distribution<float>(from, to)(random);
    };
    std::vector<std::vector<glm::vec3>> normals(2);
    for (auto& view : normals)
        for (int i = 0; i < kWidth * kHeight; ++i)
            view.push_back(i % 5 == 0
                               ? glm::vec3(0.0f)
                               : glm::normalize(glm::vec3(between(-1, 1), between(-1, 1), 1)));
    // The third has no page of its own.
    const std::vector<ViewNormals> views = {
        {normals[0].data(), kWidth, kHeight}, {normals[1].data(), kWidth, kHeight}, {}};
    for (const std::size_t count : {1u, 5u, 16u, 100u, 1000u}) {
        std::vector<glm::vec3> origins, found(count + 1, glm::vec3(7.0f));
        for (std::size_t i = 0; i < count; ++i)
            origins.emplace_back(static_cast<float>(static_cast<int>(random() % 4) - 1),
                                 between(-1, kWidth + 1), between(-1, kHeight + 1));
        bool all = true;
        std::vector<glm::vec3> expected;
        for (const glm::vec3 at : origins) {
            glm::vec3 sum(0.0f);
            if (at.x >= 0) {
                const auto number = static_cast<std::size_t>(at.x);
                const bool holds = isBetween(views[number], at.y, at.z);
                all = all && holds;
                const float left = std::floor(at.y - 0.5f), top = std::floor(at.z - 0.5f);
                if (number < 2) {
                    const bool inside =
                        left >= 0 && top >= 0 && left + 1 < kWidth && top + 1 < kHeight;
                    EXPECT_EQ(holds, inside && !(left == kWidth - 2 && top == kHeight - 2));
                } else {
                    EXPECT_FALSE(holds);
                }
                for (int k = 0; holds && k < 4; ++k) {
                    const int x = static_cast<int>(left) + k % 2, y = static_cast<int>(top) + k / 2;
                    const float tu = at.y - 0.5f - left, tv = at.z - 0.5f - top;
                    sum += (k % 2 ? tu : 1 - tu) * (k / 2 ? tv : 1 - tv) *
                           normals[number][static_cast<std::size_t>(y * kWidth + x)];
                }
            }
            const float length = glm::length(sum);
            expected.push_back(length > 1e-6f ? sum / length : glm::vec3(0.0f));
        }
        EXPECT_EQ(normalsBetween(origins, views, found.data()), all);
        for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(found[i], expected[i]) << i;
        EXPECT_EQ(found[count], glm::vec3(7.0f));
    }
}

}  // namespace
}  // namespace stx::surface
