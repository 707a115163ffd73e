#include "formats/meshes/gltf/splats.hpp"

#include <algorithm>

namespace stx::gltf {
namespace {

constexpr const char* kName = "KHR_gaussian_splatting";
constexpr float kDegree0 = 0.28209479177387814f;

/// The degree's first coefficient among those of the degrees 1 and more.
int firstOf(int degree) {
    return degree * degree - 1;
}

/// More degrees than before: coefficients of the splats that are there get zeros behind them.
Result<void> resizeTo(SplatCloud& cloud, std::size_t count, int degree, const Limits& limits) {
    const int old = cloud.degree;
    if (degree <= old || cloud.positions.empty())
        return cloud.resize(count, std::max(old, degree), limits);
    const auto before = static_cast<std::size_t>(SplatCloud::paddedCount(old)),
               after = static_cast<std::size_t>(SplatCloud::paddedCount(degree));
    const std::size_t lists = 3 * cloud.positions.size();
    const std::vector<std::uint16_t> values = std::move(cloud.harmonics);
    cloud.harmonics.clear();
    STX_CHECK(cloud.resize(count, degree, limits));
    for (std::size_t i = 0; i < lists && before > 0; ++i)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * before), before,
                    cloud.harmonics.begin() + static_cast<std::ptrdiff_t>(i * after));
    return {};
}

}  // namespace

Result<const Json*> splatsIn(const Json& primitive, const std::string& where) {
    return getExtension(primitive, kName, where);
}

Result<void> addSplats(GltfFile& model, const Json& primitive, const std::string& where,
                       SplatCloud& cloud) {
    STX_TRY(const Json* extension, splatsIn(primitive, where));
    const std::string at = fmt::format("{}.extensions.{}", where, kName);
    STX_TRY(const Json* attributes, getObject(primitive, "attributes", where));
    if (!extension || !attributes)
        return fail(ErrorCode::invalidInput, "{} has no attributes", where);
    STX_TRY(const auto kernel, getString(*extension, "kernel", at));
    if (kernel.value_or("") != "ellipse")
        model.job().note(
            fmt::format("{}: kernel '{}' is drawn as 'ellipse'", at, kernel.value_or("")));
    STX_TRY(const auto space, getString(*extension, "colorSpace", at));
    const bool linear = space == "lin_rec709_display";
    if (!linear && space != "srgb_rec709_display")
        model.job().note(fmt::format("{}: colorSpace '{}' is taken for 'srgb_rec709_display'", at,
                                     space.value_or("")));
    if (!cloud.positions.empty() && linear != cloud.linear)
        return fail(ErrorCode::unsupported,
                    "{} has another colorSpace than the splats before it; one for all is expected",
                    at);
    cloud.linear = linear;
    std::size_t count = 0;
    const auto read = [&](const std::string& name, std::string_view type,
                          bool normalise = false) -> Result<AccessorValues> {
        STX_TRY(const auto index, getUint(*attributes, name.c_str(), where));
        if (!index) return fail(ErrorCode::invalidInput, "{} has no attribute {}", where, name);
        STX_TRY(auto values, model.accessor(*index, where + " " + name, {type}, normalise));
        if (count != 0 && values.count != count)
            return fail(ErrorCode::invalidInput, "{}: {} has {} values for {} splats", where, name,
                        values.count, count);
        count = values.count;
        return values;
    };
    const auto own = [](const char* name) { return fmt::format("{}:{}", kName, name); };
    const auto harmonic = [&](int degree, int n) {
        return fmt::format("{}:SH_DEGREE_{}_COEF_{}", kName, degree, n);
    };
    int degree = 0;
    while (degree < 3 && attributes->contains(harmonic(degree + 1, 0))) ++degree;
    const std::size_t first = cloud.positions.size();
    {
        STX_TRY(const auto positions, read("POSITION", "VEC3"));
        STX_CHECK(resizeTo(cloud, first + count, degree, model.job().limits));
        STX_TRY(const auto scales, read(own("SCALE"), "VEC3"));
        STX_TRY(const auto rotations, read(own("ROTATION"), "VEC4", true));
        STX_TRY(const auto opacities, read(own("OPACITY"), "SCALAR", true));
        STX_TRY(const auto colours, read(harmonic(0, 0), "VEC3"));
        for (std::size_t i = 0; i < count; ++i) {
            for (int k = 0; k < 3; ++k) {
                cloud.positions[first + i][k] = positions.at(i, k);
                cloud.scales[first + i][k] = scales.at(i, k);
                cloud.colours[first + i][k] = 0.5f + kDegree0 * colours.at(i, k);
            }
            for (int k = 0; k < 4; ++k) cloud.rotations[first + i][k] = rotations.at(i, k);
            cloud.opacities[first + i] = opacities.at(i, 0);
        }
    }
    for (int l = 1; l <= degree; ++l) {
        for (int n = 0; n < 2 * l + 1; ++n) {
            STX_TRY(const auto values, read(harmonic(l, n), "VEC3"));
            for (std::size_t i = 0; i < count; ++i)
                for (int k = 0; k < 3; ++k)
                    cloud.setHarmonic(first + i, firstOf(l) + n, k, values.at(i, k));
        }
    }
    return {};
}

}  // namespace stx::gltf
