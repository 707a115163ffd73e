#include "formats/validate/validate_moments.hpp"

#include <algorithm>

#include "formats/mpeg4/mapping/scene_sequence.hpp"

namespace stx {

using namespace mpeg4;

namespace {

/// Whether other pictures or nodes may come: clocks only move what is there.
bool picturesChange(const Document& document) {
    return document.frames.size() > 1 || document.odFrames.size() > 1 ||
           std::ranges::any_of(document.odFrames, [](const OdFrame& frame) {
               return std::ranges::any_of(frame.commands, [](const OdCommand& command) {
                   const auto* update = std::get_if<UpdateObjectDescriptors>(&command);
                   return update &&
                          std::ranges::any_of(update->descriptors, [](const ObjectDescriptor& od) {
                              return std::ranges::any_of(od.streams, [](const ElementaryStream& s) {
                                  return s.samples.size() > 1;
                              });
                          });
               });
           });
}

}  // namespace

bool changesLater(const Document& document) {
    // A clock moves something along a ROUTE only; those of commands come with them.
    const auto hasRoutes = [](const Command& command) {
        const auto* scene = std::get_if<ReplaceScene>(&command);
        return std::holds_alternative<InsertRoute>(command) || (scene && !scene->routes.empty());
    };
    return picturesChange(document) ||
           std::ranges::any_of(document.frames, [&](const CommandFrame& frame) {
               return std::ranges::any_of(frame.commands, hasRoutes);
           });
}

void checkLaterMoments(Document document, const std::filesystem::path& folder, Findings& findings,
                       Job& job) {
    constexpr std::size_t kMostFindings = 20;  // more of the kind say no more
    Job quiet;
    quiet.workFor(job);
    SceneReadOptions read;
    read.folder = folder;
    const bool pixels = picturesChange(document);
    const auto frames = sequenceFromScene(std::move(document), read, quiet);
    if (!frames) {
        findings.add(2032, "scene", frames.error().text(), "moments that can be read");
        return;
    }
    const auto& times = (*frames)->timeline().times;
    std::size_t found = 0;
    for (std::size_t i = 1; i < times.size() && found < kMostFindings; ++i) {
        if (!job.checkCancelled()) return;
        const auto sound = [&]() -> Result<void> {
            STX_TRY(const auto table, (*frames)->views(i, quiet));
            if (!pixels) return {};
            return forEachView(*table, {"reading", 0}, quiet,
                               [](std::size_t, const auto&) { return Result<void>(); });
        }();
        if (sound) continue;
        findings.add(2032, fmt::format("{:g} s", times[i]), sound.error().text(),
                     "a moment that can be read");
        ++found;
    }
}

}  // namespace stx
