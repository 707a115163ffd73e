#pragma once

#include <gtest/gtest.h>

#include "lib/model/sequence.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx {

inline Timeline moved(Timeline line, double by) {
    for (double& time : line.times) time += by;
    line.end += by;
    return line;
}

/// Two views: the first has colours and a depth that change from frame to frame, the second stands
/// still but for its camera, which moves along x. Depths are on the codes of the whole range.
class MovingViews : public Sequence {
  public:
    explicit MovingViews(int count, double rate = 25, bool cameraMoves = true)
        : MovingViews(steadyTimeline(count, rate), cameraMoves) {}
    explicit MovingViews(Timeline line, bool cameraMoves = true) : cameraMoves_(cameraMoves) {
        timeline_ = std::move(line);
    }

    Result<Bundle> frame(std::size_t index, Job&) override {
        ++asked;
        Bundle bundle;
        bundle.title = "moving";
        bundle.views = {mpeg4::makeView(24, 16, 16, 1), mpeg4::makeView(24, 16, 16, 2)};
        const auto step = static_cast<int>(index);
        auto colours = *bundle.views[0].texture.rgba8();
        colours.at(1, 0).r = static_cast<unsigned char>(10 + 20 * step);
        bundle.views[0].texture = Texture(colours);
        const DepthCode code = bundle.views[0].depthCode();
        bundle.views[0].depth.at(1, 0) =
            static_cast<float>(code.decode(100 + 300 * static_cast<unsigned>(step)));
        if (cameraMoves_) bundle.views[1].camera.position.x += 0.25 * step;
        setTime(bundle, index);
        return bundle;
    }

    int asked = 0;

  private:
    bool cameraMoves_;
};

/// Names, cameras (as floats hold them), depths (within half a step of a 16-bit code) and colours.
inline void expectSameFrame(const Bundle& is, const Bundle& expected, double slack = 1e-6) {
    ASSERT_EQ(is.views.size(), expected.views.size());
    for (std::size_t k = 0; k < is.views.size(); ++k) {
        const ReferenceView& a = is.views[k];
        const ReferenceView& b = expected.views[k];
        EXPECT_EQ(a.name, b.name);
        EXPECT_LT(glm::distance(a.camera.position, b.camera.position), 1e-5);
        ASSERT_EQ(a.depth.width(), b.depth.width());
        ASSERT_EQ(a.depth.height(), b.depth.height());
        for (std::size_t i = 0; i < a.depth.count(); ++i) {
            const float da = a.depth.data()[i], db = b.depth.data()[i];
            ASSERT_EQ(hasPoint(da), hasPoint(db)) << i;
            if (hasPoint(da)) {
                ASSERT_NEAR(da, db, slack * db + b.depthCode().step()) << i;
                ASSERT_EQ(a.texture.rgba8()->data()[i], b.texture.rgba8()->data()[i]) << i;
            }
        }
    }
}

}  // namespace stx
