#include "lib/model/environment.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace stx {

bool Environment::linear() const {
    return std::ranges::any_of(pictures,
                               [](const Texture& t) { return !t.empty() && t.isLinear(); });
}

int Environment::pictureCount() const {
    return static_cast<int>(
        std::ranges::count_if(pictures, [](const Texture& t) { return !t.empty(); }));
}

Result<void> Environment::check() const {
    const std::size_t expected = layout == Layout::cube ? 6 : 1;
    if (!pictures.empty() && pictures.size() != expected)
        return fail(ErrorCode::invalidInput, "an environment of {} picture(s); {} expected",
                    pictures.size(), layout == Layout::cube ? "six faces are" : "one is");
    if (pictureCount() == 0 && skyColours.empty() && groundColours.empty())
        return fail(ErrorCode::invalidInput,
                    "an environment has no picture, no sky and no ground; one of them is expected");
    for (const Texture& t : pictures) {
        STX_CHECK(within("an environment", t.check()));
        if (!t.empty() && t.isLinear() != linear())
            return fail(ErrorCode::invalidInput,
                        "an environment has pictures of 8-bit sRGB and of linear light; all must "
                        "be alike");
    }
    const double length = orientation.w * orientation.w + orientation.x * orientation.x +
                          orientation.y * orientation.y + orientation.z * orientation.z;
    if (!(std::abs(length - 1.0) < 1e-4))
        return fail(ErrorCode::invalidInput,
                    "the orientation of an environment is not a rotation: its quaternion has the "
                    "length {:g}",
                    std::sqrt(length));
    for (const auto& [what, colours, angles] :
         {std::tuple{"sky", &skyColours, &skyAngles},
          std::tuple{"ground", &groundColours, &groundAngles}}) {
        if (colours->empty() ? !angles->empty() : angles->size() + 1 != colours->size())
            return fail(ErrorCode::invalidInput,
                        "the {} of an environment has {} colours and {} angles; one angle less "
                        "than colours is expected",
                        what, colours->size(), angles->size());
        double before = 0;
        for (const double angle : *angles) {
            if (!(angle >= before && angle <= 3.1416))
                return fail(ErrorCode::invalidInput,
                            "the {} of an environment has the angle {:g} after {:g}; angles rise "
                            "from 0 to 3.1416",
                            what, angle, before);
            before = angle;
        }
        for (const glm::vec3& c : *colours)
            if (!(std::isfinite(c.x + c.y + c.z)))
                return fail(ErrorCode::invalidInput,
                            "the {} of an environment has a colour that is not finite", what);
    }
    return {};
}

}  // namespace stx
