#include <cmath>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "tools/python/arrays.hpp"
#include "tools/python/handles.hpp"
#include "tools/python/keywords.hpp"
#include "tools/python/settings.hpp"

namespace stx::python {
namespace {

using FilmPointer = std::shared_ptr<Film>;

/// The frames of a film that others use, too.
class SharedFrames final : public Sequence {
  public:
    explicit SharedFrames(FilmPointer film) : film_(std::move(film)) {
        timeline_ = film_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        const std::lock_guard lock(film_->mutex);
        return film_->frames->frame(index, job);
    }

  private:
    FilmPointer film_;
};

/// Bundles in memory.
class KeptBundles final : public Sequence {
  public:
    KeptBundles(std::vector<std::shared_ptr<const Model>> bundles, Timeline timeline)
        : bundles_(std::move(bundles)) {
        timeline_ = std::move(timeline);
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_CHECK(job.checkCancelled());
        Bundle bundle = std::get<Bundle>(*bundles_[index]);
        setTime(bundle, index);
        return bundle;
    }

  private:
    std::vector<std::shared_ptr<const Model>> bundles_;
};

FilmPointer makeFilm(const std::vector<BundleModel>& bundles, double rate) {
    if (bundles.empty()) refuse("a film of no bundles is asked for; one or more are expected");
    if (!(rate > 0 && rate <= 1e6))
        refuse("rate is {:g}; frames a second, above 0, are expected", rate);
    std::vector<std::shared_ptr<const Model>> frames;
    for (const BundleModel& bundle : bundles) {
        valueOf(checkSameViews(bundles[0].get(), bundle.get()));
        frames.push_back(bundle.model);
    }
    auto timeline = steadyTimeline(static_cast<int>(frames.size()), rate);
    return std::make_shared<Film>(
        fromOrigin(std::make_unique<KeptBundles>(std::move(frames), std::move(timeline)),
                   bundles[0].get().origin));
}

FilmPointer openFilm(const std::filesystem::path& path, const py::dict& keywords, JobHandle* job) {
    const Keywords given(keywords);
    const OpenOptions options = openOptionsFrom(given);
    const GivenOptions names = givenFrom(given);
    return std::make_shared<Film>(run(job, [&](Job& part) -> Result<std::unique_ptr<Sequence>> {
        STX_TRY(auto frames, openSequence(path, options, part));
        noteUnusedOptions(path, Reads::film, names, options, part);
        return frames;
    }));
}

py::object frameOf(const FilmPointer& film, py::ssize_t index, JobHandle* job) {
    const auto count = static_cast<py::ssize_t>(film->timeline().count());
    const py::ssize_t from = index < 0 ? index + count : index;
    if (from < 0 || from >= count)
        throw py::index_error(fmt::format("frame {} of a film of {}", index, count));
    return modelObject(run(job, [&](Job& part) {
        return SharedFrames(film).frame(static_cast<std::size_t>(from), part);
    }));
}

void saveFilm(const FilmPointer& film, const std::filesystem::path& path, int jpegQuality,
              std::optional<int> h264, bool noClobber, JobHandle* job) {
    const SaveOptions options = saveOptionsFrom(jpegQuality, h264, noClobber);
    SharedFrames frames(film);
    run(job, [&](Job& part) -> Result<void> {
        STX_CHECK(save(frames, path, options, part));
        if (h264 && !frames.timeline().moves())
            part.noteUnused({"h264"}, "of films", "nothing moves");
        return {};
    });
}

/// Notes the times that are asked for outside a film.
void checkTimes(const FilmPointer& film, const std::vector<double>& times, JobHandle* handle) {
    for (const double time : times)
        if (!std::isfinite(time))
            refuse("times holds {}; finite numbers of seconds are expected", time);
    Job job;
    noteOutside(times, film->timeline(), job);
    tell(handle, job.takeNotes());
}

FilmPointer bakeFilm(const FilmPointer& film, const py::dict& keywords) {
    const BakeSettings settings = bakeSettingsFrom(Keywords(keywords));
    return std::make_shared<Film>(
        changed(std::make_unique<SharedFrames>(film),
                [settings](Bundle& bundle, Job& job) { return bake(bundle, settings, job); }));
}

FilmPointer backgroundOfFilm(const FilmPointer& film, const py::dict& keywords, JobHandle* job) {
    const Keywords given(keywords);
    BackgroundSettings settings;
    given.take("support", settings.support);
    given.take("key_views", settings.keyViews);
    return std::make_shared<Film>(run(job, [&](Job& part) {
        return background(std::make_unique<SharedFrames>(film), settings, part);
    }));
}

/// Pictures in an array, which outlives this.
class ArrayFrames final : public StillFrames {
  public:
    explicit ArrayFrames(const py::array_t<std::uint8_t, py::array::c_style>& frames)
        : data_(frames.data()),
          count_(static_cast<int>(frames.shape(0))),
          size_(static_cast<int>(frames.shape(2)), static_cast<int>(frames.shape(1))),
          channels_(static_cast<std::size_t>(frames.shape(3))) {}

    glm::ivec2 size() const override { return size_; }
    int count() const override { return count_; }
    Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        auto image = std::make_shared<Rgba8Image>(size_.x, size_.y);
        const std::uint8_t* from = data_ + static_cast<std::size_t>(k) * image->count() * channels_;
        for (glm::u8vec4& pixel : image->pixels()) {
            const std::uint8_t alpha = channels_ == 4 ? from[3] : std::uint8_t{255};
            pixel = {from[0], from[1], from[2], alpha};
            from += channels_;
        }
        return std::shared_ptr<const Rgba8Image>(std::move(image));
    }

  private:
    const std::uint8_t* data_;
    int count_;
    glm::ivec2 size_;
    std::size_t channels_;
};

using StillPointer = std::shared_ptr<StillBackground>;

/// `frames`: an array, or names of files.
StillPointer stillBackgroundOf(const py::object& frames, const py::dict& keywords, JobHandle* job) {
    const StillSettings settings = stillSettingsFrom(Keywords(keywords));
    const auto kept = [](StillBackground background) {
        return std::make_shared<StillBackground>(std::move(background));
    };
    if (!py::isinstance<py::array>(frames)) {
        const auto inputs = frames.cast<std::vector<std::filesystem::path>>();
        return kept(run(job, [&](Job& part) { return background(inputs, settings, part); }));
    }
    refuseMasked(frames, "frames");
    const auto array = py::reinterpret_borrow<py::array>(frames);
    const bool fits = py::isinstance<py::array_t<std::uint8_t>>(array) && array.ndim() == 4 &&
                      (array.shape(3) == 3 || array.shape(3) == 4) && array.shape(0) >= 1 &&
                      array.shape(1) >= 1 && array.shape(2) >= 1;
    if (!fits)
        refuse(
            "frames are {} of shape {}; uint8 of shape (frames, height, width, 3 or 4) are "
            "expected",
            std::string(py::str(array.dtype())), std::string(py::str(array.attr("shape"))));
    const auto rows = py::array_t<std::uint8_t, py::array::c_style>::ensure(array);
    ArrayFrames pictures(rows);
    return kept(run(job, [&](Job& part) { return stillBackground(pictures, settings, part); }));
}

void bindStillBackground(py::module_& module) {
    py::class_<StillBackground, StillPointer>(module, "Background",
                                              "What a camera that stands still sees without those "
                                              "who pass, as stx.background() finds it.")
        .def_property_readonly(
            "colour", [](const StillPointer& b) { return arrayOf(b->colour, b); },
            "(height, width, 4) uint8, sRGB, opaque; 0 where no frame shows anything.")
        .def_property_readonly(
            "confidence", [](const StillPointer& b) { return arrayOf(b->confidence, b); },
            "(height, width) uint8: how far frames agree with each pixel, 0 (none) to 255 (all).")
        .def_readonly("frames_used", &StillBackground::framesUsed, "Frames that were looked at.")
        .def(
            "mask",
            [](const StillPointer& b, const py::object& frame) {
                const Texture texture = textureFrom(frame, "frame");
                if (texture.isLinear()) refuse("frame is float32; uint8 (sRGB) is expected");
                const auto mask = std::make_shared<Image<std::uint8_t>>(
                    valueOf(foregroundMask(b->colour, *texture.rgba8())));
                return arrayOf(*mask, mask);
            },
            py::arg("frame"),
            "What of a frame, (height, width, 3 or 4) uint8, is not background: (height, width) "
            "uint8, 255 where, else 0.");
}

}  // namespace

void bindFilms(py::module_& module) {
    py::class_<Film, FilmPointer>(module, "Film",
                                  R"(Bundles in time, each read when it is asked for.

bundles: a list of stx.Bundle with the same views; frames count from the origin of the first. rate:
frames a second, above 0. len(film), film[i] and iteration give its frames as stx.Bundle. One call at a
time works; others wait.)")
        .def(py::init(&makeFilm), py::arg("bundles"), py::kw_only(), py::arg("rate") = 25.0)
        .def_property_readonly(
            "times", [](const FilmPointer& f) { return arrayOf(f->timeline().times, f); },
            "(n,) float64: when frames begin, seconds by the film's clock, which need not begin at "
            "0.")
        .def_property_readonly(
            "end", [](const FilmPointer& f) { return f->timeline().end; },
            "When the last frame ends, by the same clock.")
        .def(
            "frame_at",
            [](const FilmPointer& f, double time) {
                if (!std::isfinite(time))
                    refuse("time is {}; a finite number of seconds is expected", time);
                return f->timeline().frameAt(time);
            },
            py::arg("time"),
            "The number of the frame that is shown at a time, in seconds; outside the film the "
            "nearest one's. Raises stx.Error (usage) for NaN and infinity.")
        .def("frame", &frameOf, py::arg("index"), py::kw_only(), py::arg("job") = py::none(),
             "A frame as stx.Bundle; of a negative number from the end. Raises stx.Error (io, "
             "invalidInput).")
        .def("save", &saveFilm, py::arg("path"), py::kw_only(), py::arg("jpeg_quality") = 0,
             py::arg("h264") = py::none(), py::arg("no_clobber") = false,
             py::arg("job") = py::none(),
             R"(Writes it whole or not at all: .mp4, .xmt, .bt, or name_%04d.exr.

The files of a film that is open cannot be replaced. jpeg_quality: of colours, 1..100; 0: PNG, exact.
h264: pictures that change as video of this quality, 0 (the best) to 51; None: as PNG or JPEG.
no_clobber: a target that exists is an error. Raises stx.Error (usage, invalidInput, io).)")
        .def("__len__", [](const FilmPointer& f) { return f->timeline().count(); })
        .def("__getitem__",
             [](const FilmPointer& f, py::ssize_t index) { return frameOf(f, index, nullptr); })
        .def("__iter__",
             [](py::object film) {
                 return py::reinterpret_steal<py::object>(PySeqIter_New(film.ptr()));
             })
        .def("__repr__", [](const FilmPointer& f) {
            return fmt::format("<stx.Film {} frames, {:.6g} s>", f->timeline().count(),
                               f->timeline().duration());
        });
    bindStillBackground(module);
    module.def("open_film", &openFilm);
    module.def("bake_film", &bakeFilm);
    module.def("check_times", &checkTimes);
    module.def("background_of_film", &backgroundOfFilm);
    module.def("still_background", &stillBackgroundOf);
}

}  // namespace stx::python
