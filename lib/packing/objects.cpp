#include <algorithm>

#include "lib/packing/layout.hpp"

namespace stx {
namespace {

/// What pack() would refuse of each, by its name.
Result<void> checkPackObjects(const std::vector<PackObject>& objects) {
    if (objects.empty()) return fail(ErrorCode::usage, "there is no object to pack");
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const PackObject& o = objects[i];
        const auto same = [&](const PackObject& other) { return other.name == o.name; };
        if (o.name.empty())
            return fail(ErrorCode::usage, "object {} has no name; --names gives one to each", i);
        if (std::any_of(objects.begin(), objects.begin() + static_cast<std::ptrdiff_t>(i), same))
            return fail(ErrorCode::usage,
                        "two objects are called '{}'; --names gives each a name of its own",
                        o.name);
        const auto where = [&](const Error& error) {
            return tl::unexpected(error.at(fmt::format("object '{}'", o.name)));
        };
        if (const auto ok = o.bundle.check(); !ok) return where(ok.error());
        if (o.bundle.pointCount() == 0)
            return where({ErrorCode::invalidInput, "it has no point to pack", {}});
        const auto linear = [](const PackObject& object) {
            return object.bundle.views[0].texture.isLinear();
        };
        if (linear(o) != linear(objects[0]))
            return where({ErrorCode::invalidInput,
                          fmt::format("its colour is {} and that of '{}' {}; pack them into sheets "
                                      "of their own",
                                      linear(o) ? "linear light" : "8-bit sRGB", objects[0].name,
                                      linear(o) ? "8-bit sRGB" : "linear light"),
                          {}});
    }
    return {};
}

std::int64_t pixelsOf(const Bundle& bundle) {
    std::int64_t n = 0;
    for (const ReferenceView& view : bundle.views) n += objectPixels(view);
    return n;
}

}  // namespace

Result<JoinedObjects> joinObjects(std::vector<PackObject> objects, Job& job) {
    STX_CHECK(checkPackObjects(objects));
    JoinedObjects joined;
    std::vector<std::string> environments;
    for (PackObject& o : objects) {
        AtlasObject& entry = joined.objects.emplace_back();
        entry.name = o.name;
        entry.title = o.bundle.title;
        entry.firstView = static_cast<int>(joined.bundle.views.size());
        entry.views = static_cast<int>(o.bundle.views.size());
        entry.bounds = o.bundle.bounds;
        entry.origin = o.bundle.origin;
        entry.keptPixels = o.bundle.pointCount();
        entry.sourcePixels = o.sourcePixels > 0 ? o.sourcePixels : pixelsOf(o.bundle);
        if (o.bundle.environment) environments.push_back(o.name);
        std::ranges::move(o.bundle.views, std::back_inserter(joined.bundle.views));
        o.bundle = {};
    }
    if (!environments.empty())
        job.note(
            fmt::format("the environment of {} is left out: objects that share an atlas have "
                        "none",
                        fmt::join(environments, ", ")));
    return joined;
}

}  // namespace stx
