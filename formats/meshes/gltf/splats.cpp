#include "formats/meshes/gltf/splats.hpp"

#include <algorithm>
#include <set>

namespace stx::gltf {
namespace {

constexpr const char* kName = "KHR_gaussian_splatting";
constexpr float kDegree0 = 0.28209479177387814f;

/// The degree's first coefficient among those of the degrees 1 and more.
int firstOf(int degree) {
    return degree * degree - 1;
}

/// More degrees than before: coefficients of the splats that are there get zeros behind them.
Result<void> resizeTo(FileSplats& splats, std::size_t count, int degree, const Limits& limits) {
    SplatCloud& cloud = splats.cloud;
    const int old = cloud.degree;
    if (degree <= old || splats.centres.empty())
        return splats.resize(count, std::max(old, degree), limits);
    const auto before = static_cast<std::size_t>(SplatCloud::paddedCount(old)),
               after = static_cast<std::size_t>(SplatCloud::paddedCount(degree));
    const std::size_t lists = 3 * splats.centres.size();
    const std::vector<std::uint16_t> values = std::move(cloud.harmonics);
    cloud.harmonics.clear();
    STX_CHECK(splats.resize(count, degree, limits));
    for (std::size_t i = 0; i < lists && before > 0; ++i)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * before), before,
                    cloud.harmonics.begin() + static_cast<std::ptrdiff_t>(i * after));
    return {};
}

/// Says where the extension wants another way of drawing than the one of here.
Result<void> noteRules(const Json& extension, const std::string& at, Job& job) {
    struct Rule {
        const char *name, *here, *unsaid;
    };
    for (const Rule& rule : {Rule{"kernel", "ellipse", ""},
                             {"projection", "perspective", "perspective"},
                             {"sortingMethod", "cameraDistance", "cameraDistance"}}) {
        STX_TRY(const auto said, getString(extension, rule.name, at));
        const std::string wanted = said.value_or(rule.unsaid);
        if (wanted != rule.here)
            job.note(fmt::format("{}: {} '{}' is drawn as '{}'", at, rule.name, wanted, rule.here));
    }
    return {};
}

/// An attribute's name in the extension.
std::string own(std::string_view name) {
    return fmt::format("{}:{}", kName, name);
}
std::string harmonic(int degree, int n) {
    return own(fmt::format("SH_DEGREE_{}_COEF_{}", degree, n));
}

/// The highest degree of which there is some coefficient; of it and those below it all must be
/// there.
int degreeOf(const Json& attributes) {
    int degree = 0;
    for (const auto& [name, accessor] : attributes.items())
        for (int l = degree + 1; l <= 3; ++l)
            if (name.starts_with(own(fmt::format("SH_DEGREE_{}_", l)))) degree = l;
    return degree;
}

void noteUnread(const Json& attributes, const std::set<std::string>& read, const std::string& where,
                Job& job) {
    std::string first;
    int count = 0;
    for (const auto& [name, accessor] : attributes.items())
        if (name.starts_with(own("")) && !read.contains(name) && count++ == 0) first = name;
    if (count > 0)
        job.note(fmt::format("{}: dropped: {} of splats, {}{}", where,
                             count == 1 ? "an attribute" : fmt::format("{} attributes", count),
                             first, count == 1 ? "" : " and others"));
}

}  // namespace

Result<const Json*> splatsIn(const Json& primitive, const std::string& where) {
    return getExtension(primitive, kName, where);
}

Result<void> addSplats(GltfFile& model, const Json& primitive, const std::string& where,
                       FileSplats& splats) {
    STX_TRY(const Json* extension, splatsIn(primitive, where));
    const std::string at = fmt::format("{}.extensions.{}", where, kName);
    STX_TRY(const Json* attributes, getObject(primitive, "attributes", where));
    if (!extension || !attributes)
        return fail(ErrorCode::invalidInput, "{} has no attributes", where);
    STX_CHECK(noteRules(*extension, at, model.job()));
    STX_TRY(const auto space, getString(*extension, "colorSpace", at));
    const bool linear = space == "lin_rec709_display";
    if (!linear && space != "srgb_rec709_display")
        model.job().note(fmt::format("{}: colorSpace '{}' is taken for 'srgb_rec709_display'", at,
                                     space.value_or("")));
    SplatCloud& cloud = splats.cloud;
    if (!splats.centres.empty() && linear != cloud.linear)
        return fail(ErrorCode::unsupported,
                    "{} has another colorSpace than the splats before it; one for all is expected",
                    at);
    cloud.linear = linear;
    std::size_t count = 0;
    std::set<std::string> names;
    const auto read = [&](const std::string& name, std::string_view type,
                          bool normalise = false) -> Result<AccessorValues> {
        STX_TRY(const auto index, getUint(*attributes, name.c_str(), where));
        if (!index) return fail(ErrorCode::invalidInput, "{} has no attribute {}", where, name);
        STX_TRY(auto values, model.accessor(*index, where + " " + name, {type}, normalise));
        if (count != 0 && values.count != count)
            return fail(ErrorCode::invalidInput, "{}: {} has {} values for {} splats", where, name,
                        values.count, count);
        count = values.count;
        names.insert(name);
        return values;
    };
    const int degree = degreeOf(*attributes);
    const std::size_t first = splats.centres.size();
    {
        STX_TRY(const auto positions, read("POSITION", "VEC3"));
        STX_CHECK(resizeTo(splats, first + count, degree, model.job().limits));
        STX_TRY(const auto scales, read(own("SCALE"), "VEC3"));
        STX_TRY(const auto rotations, read(own("ROTATION"), "VEC4", true));
        STX_TRY(const auto opacities, read(own("OPACITY"), "SCALAR", true));
        STX_TRY(const auto colours, read(harmonic(0, 0), "VEC3"));
        for (std::size_t i = 0; i < count; ++i) {
            for (int k = 0; k < 3; ++k) {
                splats.centres[first + i][k] = positions.at(i, k);
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
    noteUnread(*attributes, names, where, model.job());
    return {};
}

}  // namespace stx::gltf
