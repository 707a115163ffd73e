#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "formats/any/sequences.hpp"
#include "formats/stx/stx.hpp"
#include "tests/sweep/measures.hpp"
#include "tests/sweep/random.hpp"

using namespace stx;

namespace {

/// A folder that goes when this does.
class Folder {
  public:
    Folder()
        : path_(std::filesystem::temp_directory_path() / fmt::format("stx_sweep_{}", getpid())) {
        std::filesystem::create_directories(path_);
    }
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

  private:
    std::filesystem::path path_;
};

/// The picture of a model, and how it is drawn.
struct FromFile {
    Drawn how;
    Frame frame;
    double promised = 0;  ///< PruneReport::psnr
};

Result<FromFile> drawModel(const Pictures& pictures, Model model, int salt) {
    FromFile out;
    out.how.mode = measures::pick(pictures, salt, 3) == 0 ? RenderMode::splat : RenderMode::surface;
    RenderSettings settings;
    settings.mode = out.how.mode;
    settings.fill = Fill::none;
    Job job;
    STX_TRY(const auto renderer, rendererOf(std::move(model), settings, job, Backend::cpu));
    STX_TRY(out.frame, renderer->render(pictures.captured().novel));
    return out;
}

/// How much worse a model is drawn than the bundle that it was made of.
measures::Outcome drawnFrom(Pictures& pictures, Model model, const std::string& name, int salt) {
    STX_TRY(const FromFile changed, drawModel(pictures, std::move(model), salt));
    STX_TRY(const Frame* frame, pictures.of(changed.how));
    const double before = pictures.psnr(*frame), after = pictures.psnr(changed.frame);
    return Measure{worseBy(after, before),
                   fmt::format("{}, {}: views {:.2f} dB, from the file {:.2f} dB", name,
                               changed.how.name(), before, after)};
}

/// The picture of the pruned atlas of a case.
Result<FromFile> drawPruned(const Pictures& pictures) {
    Job job;
    Bundle bundle = pictures.captured().bundle;
    STX_TRY(const PruneReport report, prune(bundle, {}, job));
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    settings.sourcePixels = report.sourcePixels;
    STX_TRY(Atlas packed, pack(bundle, settings, job));
    STX_TRY(FromFile out, drawModel(pictures, std::move(packed), 221));
    out.promised = report.psnr;
    return out;
}

}  // namespace

namespace measures {

Outcome container(Pictures& pictures) {
    constexpr std::array kNames{"a.exr", "a.mp4", "a.xmt", "a.bt"};
    const char* name = kNames[std::size_t(pick(pictures, 201, int(kNames.size())))];
    Bundle bundle = pictures.captured().bundle;
    // Only .exr has room for principal points and for floats; the others are compared as they are.
    if (name != kNames[0]) {
        if (pictures.captured().from.offCentre) return std::nullopt;
        for (ReferenceView& view : bundle.views) view.depthBits = 16;
    }
    Folder folder;
    Job job;
    STX_CHECK(save(bundle, folder / name, {}, job));
    STX_TRY(Model model, open(folder / name, {}, job));
    return drawnFrom(pictures, std::move(model), name, 202);
}

Outcome atlas(Pictures& pictures) {
    Job job;
    PackSettings settings;
    settings.layout =
        pick(pictures, 211, 2) ? PackSettings::Layout::tight : PackSettings::Layout::grid;
    STX_TRY(Atlas packed, pack(pictures.captured().bundle, settings, job));
    const char* kind = settings.layout == PackSettings::Layout::tight ? "tight" : "grid";
    if (pick(pictures, 212, 2)) return drawnFrom(pictures, std::move(packed), kind, 213);
    Folder folder;
    const char* name = pick(pictures, 214, 2) ? "atlas" : "atlas.exr";
    STX_CHECK(save(packed, folder / name, {}, job));
    STX_TRY(Model model, open(folder / name, {}, job));
    return drawnFrom(pictures, std::move(model), fmt::format("{} {}", kind, name), 213);
}

Outcome prunedAtlas(Pictures& pictures) {
    STX_TRY(const FromFile pruned, drawPruned(pictures));
    STX_TRY(const Frame* frame, pictures.of(pruned.how));
    const auto before = pictures.psnrAwayFromOutlines(*frame),
               after = pictures.psnrAwayFromOutlines(pruned.frame);
    if (!before || !after) return std::nullopt;
    // Beside the error of the views that of what replaces their pixels, which pruning tells:
    // colours between the texels of one view instead of several.
    const double expected =
        -10 * std::log10(std::pow(10, -*before / 10) + std::pow(10, -pruned.promised / 10));
    return Measure{
        worseBy(*after, expected),
        fmt::format("{}, away from outlines: views {:.2f} dB, pruning promises {:.2f} dB, from the "
                    "file {:.2f} dB; in all {:.2f} and {:.2f} dB",
                    pruned.how.name(), *before, pruned.promised, *after, pictures.psnr(*frame),
                    pictures.psnr(pruned.frame))};
}

Outcome prunedOutline(Pictures& pictures) {
    STX_TRY(const FromFile pruned, drawPruned(pictures));
    // What only two views show may be all that one of them keeps, at a grazing angle.
    const auto open = pictures.openShare(pruned.frame, 3),
               drawn = pictures.drawnShare(pruned.frame);
    if (!open || !drawn) return std::nullopt;
    return Measure{std::max(*open, *drawn),
                   fmt::format("{}: open {:.2f} %, drawn where nothing is {:.2f} %",
                               pruned.how.name(), *open, *drawn)};
}

Outcome clock(Pictures& pictures) {
    constexpr std::array kRates{24.0, 25.0, 29.5, 30000.0 / 1001, 30.0, 39.0, 60.0, 120.0};
    constexpr std::array kStarts{0.0, 7.3, 0.1, -1.0, 1234.5678, 1.3e9};
    constexpr std::array kNames{"a.mp4", "a.xmt", "a.bt", "a_%04d.exr"};
    const double rate = kRates[std::size_t(pick(pictures, 231, int(kRates.size())))];
    const double start = kStarts[std::size_t(pick(pictures, 232, int(kStarts.size())))];
    const char* name = kNames[std::size_t(pick(pictures, 233, int(kNames.size())))];
    const int frames = 3 + pick(pictures, 234, 4);

    // One small view; the colour of a frame is its number.
    class Numbered : public Sequence {
      public:
        Numbered(const ReferenceView& view, const Timeline& timeline) : view_(view) {
            timeline_ = timeline;
        }
        Result<Bundle> frame(std::size_t index, Job&) override {
            Bundle bundle;
            bundle.views = {view_};
            bundle.time = timeline_.times[index];
            for (glm::u8vec4& colour : bundle.views[0].texture.rgba8()->pixels())
                colour = glm::u8vec4(20 * (index + 1), 100, 100, colour.a);
            return bundle;
        }

      private:
        ReferenceView view_;
    };
    ReferenceView view = pictures.captured().bundle.views[0];
    view.depthBits = 16;
    if (view.pointCount() == 0 || pictures.captured().from.offCentre) return std::nullopt;
    Timeline timeline = steadyTimeline(frames, rate);
    for (double& time : timeline.times) time += start;
    timeline.end += start;
    Numbered film(view, timeline);
    Folder folder;
    Job job;
    STX_CHECK(saveSequence(film, folder / name, {}, job));
    STX_TRY(const auto back, openSequence(folder / name, {}, job));
    int wrong = 0;
    std::string seen;
    for (int i = 0; i < frames; ++i) {
        STX_TRY(const Bundle bundle, back->frame(back->timeline().frameAt(start + i / rate), job));
        const Rgba8Image& texture = *bundle.views[0].texture.rgba8();
        int shown = -1;
        for (std::size_t p = 0; p < texture.count(); ++p)
            if (hasPoint(bundle.views[0].depth.data()[p])) shown = texture.data()[p].r / 20 - 1;
        wrong += shown != i;
        seen += fmt::format(" {}", shown);
    }
    return Measure{double(wrong), fmt::format("{} at {:.3f} a second from {} s: frames{}", name,
                                              rate, start, seen)};
}

}  // namespace measures
