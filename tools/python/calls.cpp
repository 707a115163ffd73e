#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "tools/python/handles.hpp"
#include "tools/python/keywords.hpp"
#include "tools/python/settings.hpp"

namespace stx::python {
namespace {

using Path = std::filesystem::path;

py::object openModel(const Path& path, const py::dict& keywords, JobHandle* job) {
    const Keywords given(keywords);
    const OpenOptions options = openOptionsFrom(given);
    const GivenOptions names = givenFrom(given);
    auto model = run(job, [&](Job& part) -> Result<Model> {
        if (options.set.frame != 0)
            STX_CHECK(checkFrameOf(path, options, "frame",
                                   "stx.open_film() of it has all of its frames", part));
        STX_TRY(auto opened, open(path, options, part));
        noteUnusedOptions(path, std::holds_alternative<Mesh>(opened) ? Reads::mesh : Reads::moment,
                          names, options, part);
        return opened;
    });
    return modelObject(std::move(model), path.stem().string());
}

py::object convertModel(const AnyModel& given, const py::dict& keywords, JobHandle* job) {
    ConvertSettings settings = convertSettingsFrom(Keywords(keywords));
    const bool mesh = std::holds_alternative<Mesh>(*given.model);
    if (settings.title.empty() && mesh) settings.title = given.title;
    return modelObject(
        run(job, [&](Job& part) { return convert(Model(*given.model), settings, part); }));
}

py::object bakeBundle(const BundleModel& given, const py::dict& keywords, JobHandle* job) {
    const BakeSettings settings = bakeSettingsFrom(Keywords(keywords));
    return modelObject(run(job, [&](Job& part) -> Result<Bundle> {
        Bundle baked = given.get();
        STX_CHECK(bake(baked, settings, part));
        return baked;
    }));
}

py::object packBundle(const BundleModel& given, const py::dict& keywords, JobHandle* job) {
    PackSettings settings = packSettingsFrom(Keywords(keywords));
    const auto pruning = pruneSettingsFrom(Keywords(keywords));
    return modelObject(run(job, [&](Job& part) -> Result<Atlas> {
        if (!pruning) return pack(given.get(), settings, part);
        Bundle pruned = given.get();
        STX_TRY(const auto report, prune(pruned, *pruning, part));
        settings.sourcePixels = report.sourcePixels;
        settings.unmeasuredPixels = report.unmeasuredPixels;
        return pack(pruned, settings, part);
    }));
}

py::object unpackAtlas(const AtlasModel& given, JobHandle* job) {
    return modelObject(run(job, [&](Job& part) { return unpack(given.get(), part); }));
}

}  // namespace

void bindCalls(py::module_& module) {
    module.def("open", &openModel);
    module.def("convert", &convertModel);
    module.def("bake", &bakeBundle);
    module.def("pack", &packBundle);
    module.def("unpack", &unpackAtlas);
}

}  // namespace stx::python
