#include "formats/mpeg4/mapping/sequence_write.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "formats/mpeg4/mapping/coded_view.hpp"
#include "formats/mpeg4/mapping/film_ranges.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/scene_timeline.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/video_write.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "formats/video/video_process.hpp"
#include "lib/model/from_origin.hpp"
#include "lib/model/view_table.hpp"

namespace stx::mpeg4 {
namespace {

/// A view on its way into the document.
struct ViewTrack {
    NodePtr node;  ///< the DepthImage that is shown now
    Camera camera;
    ViewBefore before;
    std::array<ElementaryStream*, kRoles.size()> streams{};
    std::array<CodedImage, kRoles.size()> last;
    /// In the spool, until colour and depth become video: the planes that they begin with.
    std::array<ByteRange, 2> planes;
    std::array<bool, kRoles.size()> changed{};
    std::array<int, 2> video{-1, -1};  ///< of colour and depth in H.264: VideoStreams' number
    bool coverageLost = false;         ///< by colour that is H.264
};

/// Errors: those of checkSameViews(), and (unsupported) a view whose size changes: a stream has
/// one.
Result<void> checkFrame(const Bundle& first, const Bundle& frame) {
    STX_CHECK(checkSameViews(first, frame));
    for (std::size_t i = 0; i < first.views.size(); ++i) {
        const Camera &was = first.views[i].camera, &is = frame.views[i].camera;
        if (is.width != was.width || is.height != was.height)
            return fail(ErrorCode::unsupported,
                        "view '{}' is {}x{}, but {}x{} at the start; in MPEG-4 a view keeps one "
                        "size for a whole film; write .exr",
                        first.views[i].name, is.width, is.height, was.width, was.height);
    }
    return {};
}

class SequenceWriter {
  public:
    SequenceWriter(Sequence& frames, const SceneWriteOptions& options, PictureSpool& spool,
                   Job& job)
        : frames_(frames), options_(options), spool_(spool), job_(job) {}

    Result<Document> write() {
        if (options_.pointTexture || options_.octreeLevels > 0)
            return fail(ErrorCode::unsupported,
                        "{} cannot move: its points are in the scene itself; write SimpleTexture",
                        options_.pointTexture ? "a PointTexture" : "an OctreeImage");
        // Before the frames are read twice.
        if (asVideo()) STX_CHECK(VideoProcess::start(job_.limits));
        STX_CHECK(frames_.timeline().check());
        scale_ = frames_.timeline().timescale();
        STX_CHECK(checkTicks(frames_.timeline(), scale_));
        STX_CHECK(findRanges());
        STX_CHECK(begin());
        const std::size_t count = frames_.timeline().count();
        for (std::size_t i = 1; i < count; ++i) {
            job_.progress(static_cast<std::int64_t>(count + i),
                          static_cast<std::int64_t>(2 * count), "writing frames");
            STX_CHECK(job_.checkCancelled());
            Job quiet;
            quiet.workFor(job_);
            STX_TRY(const auto table, frame(i, quiet));
            if (auto done = add(*table, i, quiet); !done)
                return tl::unexpected(done.error().at(frames_.timeline().nameOf(i)));
        }
        STX_CHECK(finish());
        return std::move(document_);
    }

  private:
    /// The presentation's time; see ViewNotes::start for the film's.
    [[nodiscard]] std::uint64_t ticks(double seconds) const {
        return ticksAt(seconds - frames_.timeline().start(), scale_);
    }

    /// A frame from the film's origin, with the ranges of the sequence when these are known.
    Result<std::unique_ptr<ViewTable>> frame(std::size_t i, Job& job) {
        auto table = frames_.views(i, job);
        if (!table) return tl::unexpected(table.error().at(frames_.timeline().nameOf(i)));
        if (!origin_) {
            origin_ = originOf(**table);
            noteOrigin(*origin_, std::as_const(**table).about(), job);
        }
        *table = countedFrom(*origin_, std::move(*table));
        if (ranges_.empty()) return table;
        std::vector<ViewHeader> headers;
        loss_.ownSteps.clear();
        for (const ReferenceView& view : std::as_const(**table).about().views)
            headers.push_back(view);
        for (std::size_t k = 0; k < std::min(headers.size(), ranges_.size()); ++k) {
            ViewHeader& view = headers[k];
            loss_.ownSteps.push_back(view.depthCode().step());
            view.nearPlane = ranges_[k].nearPlane;
            view.farPlane = ranges_[k].farPlane;
            view.depthBits = ranges_[k].depthBits;
            // A note says it of the whole film; alpha, where it is written, of each frame.
            const bool unknown = hasAlpha() ? ranges_[k].everUnknown : ranges_[k].unknown.any();
            view.noDepth = unknown ? NoDepth::unknown : NoDepth::empty;
            view.pruned = ranges_[k].everPruned;
            view.refined = ranges_[k].refined;
        }
        return withHeaders(std::move(*table), headers);
    }

    Result<void> findRanges() {
        const std::size_t count = frames_.timeline().count();
        FilmRanges ranges(options_);
        for (std::size_t i = 0; i < count; ++i) {
            job_.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(2 * count),
                          "writing frames");
            STX_CHECK(job_.checkCancelled());
            // Notes are those of the first frame: of its views when they are written.
            Job quiet;
            quiet.workFor(job_);
            STX_TRY(const auto table, frame(i, i == 0 ? job_ : quiet));
            if (i == 0) {
                if (table->count() == 0) return Bundle().checkHeaders();
                first_ = headersOf(std::as_const(*table).about());
            }
            noteOtherEnvironment(std::as_const(*table).about(), i);
            auto looked = checkFrame(first_, std::as_const(*table).about());
            if (looked) looked = ranges.add(*table, quiet);
            if (!looked) return tl::unexpected(looked.error().at(frames_.timeline().nameOf(i)));
        }
        ranges_ = ranges.finish(first_, job_);
        bounds_ = ranges.bounds();
        return {};
    }
    void noteOtherEnvironment(const Bundle& about, std::size_t frame) {
        const auto &is = about.environment, &was = first_.environment;
        if (environmentDiffers_ || is == was || (is && was && *is == *was)) return;
        environmentDiffers_ = true;
        job_.note(
            fmt::format("the environment of {} is not that of the first frame, which the film "
                        "keeps; write .exr for one in each frame",
                        frames_.timeline().nameOf(frame)));
    }

    /// The document of the first frame, whose streams the others go into.
    Result<void> begin() {
        Job quiet;  // the notes of the frame have been said, but for those of its views
        quiet.workFor(job_);
        STX_TRY(auto table, frame(0, quiet));
        table->about().bounds = bounds_;
        table->about().duration.reset();  // of the first frame; see noteDuration()
        SceneWriteOptions options = options_;
        for (const ViewRange& range : ranges_)
            options.splatRanges.push_back(range.splats ? range.longestSplat : 0);
        for (const ViewRange& range : ranges_) {
            if (hasAlpha()) break;
            options.unknownWhere.emplace_back();
            if (range.unknown.any()) STX_SET(options.unknownWhere.back(), range.unknown.text());
        }
        options.loss = &loss_;
        std::vector<ViewBefore> before(table->count());
        table = watchedViews(std::move(table), [&](std::size_t k, const ReferenceView& view) {
            before[k] = ViewBefore::of(view);
        });
        STX_TRY(document_, sceneFromViews(*table, options, &spool_, job_));
        document_.sceneStream.timescale = scale_;
        const Timeline& timeline = frames_.timeline();
        const double span = timeline.times.back() - timeline.times.front();
        video_.emplace(options_.h264,
                       span > 0 ? static_cast<double>(timeline.count() - 1) / span : 25.0,
                       job_.limits, [this](const Bytes& bytes) { return spool_.add(bytes); });
        STX_CHECK(beginTracks(before));
        return asVideo() ? keepPlanes(*table, quiet) : Result<void>();
    }

    /// The streams of the nodes of views.
    Result<void> beginTracks(const std::vector<ViewBefore>& before) {
        std::map<int, ElementaryStream*> streams;
        for (OdFrame& odFrame : document_.odFrames)
            for (OdCommand& command : odFrame.commands)
                if (auto* update = std::get_if<UpdateObjectDescriptors>(&command))
                    for (ObjectDescriptor& od : update->descriptors)
                        streams[od.id] = &od.streams.front();
        const auto& root = std::get<ReplaceScene>(document_.frames[0].commands[0]).root;
        for (const NodePtr& node : root->get<NodeList>("children")) {
            if (node->info->find("diTexture") < 0) continue;
            ViewTrack track;
            track.node = node;
            track.before = before[tracks_.size()];
            track.camera = track.before.header.camera;
            const NodePtr& texture = node->get<NodePtr>("diTexture");
            for (std::size_t r = 0; r < kRoles.size(); ++r) {
                const int field = texture->info->find(kRoles[r]);
                const NodePtr image =
                    field < 0 ? nullptr : std::get<NodePtr>(texture->value(field));
                if (!image) continue;
                const auto& urls = image->get<std::vector<Url>>("url");
                ElementaryStream* stream = streams.at(urls.front().objectDescriptorId);
                STX_TRY(const Bytes picture, stream->samples[0].data.load(job_.limits));
                track.last[r] = CodedImage::of(picture);
                stream->timescale = scale_;
                stream->samples[0].time = ticks(frames_.timeline().times[0]);
                track.streams[r] = stream;
            }
            tracks_.push_back(std::move(track));
        }
        return {};
    }
    /// The planes of the first frame, for what becomes video later.
    Result<void> keepPlanes(const ViewTable& table, Job& job) {
        return coded(
            table, job, [](const ViewBefore&, std::size_t) { return false; },
            [&](std::size_t k, const ComingView& coming) -> Result<void> {
                ViewTrack& track = tracks_[k];
                for (std::size_t r = 0; r < track.planes.size(); ++r) {
                    const Bytes& planes = imageOf(coming.images, r);
                    STX_TRY(track.planes[r], spool_.add(planes));
                    track.last[r] = CodedImage::of(coming.images, r);
                }
                track.coverageLost = coming.images.coverageLost;
                worstDepth_ = std::max(worstDepth_, coming.images.worstDepth);
                return {};
            });
    }

    /// Codes the views of a frame but those that are there `again`, and takes them in their order.
    Result<void> coded(
        const ViewTable& table, Job& job,
        const std::function<bool(const ViewBefore& view, std::size_t k)>& again,
        const std::function<Result<void>(std::size_t k, const ComingView& coming)>& take) {
        const bool vectors = std::ranges::any_of(
            table.kinds(), [](const auto& kinds) { return kinds.normal || kinds.hasSplats(); });
        const auto placed = [&](const Result<void>& done, std::size_t k) -> Result<void> {
            if (done) return {};
            return tl::unexpected(
                done.error().at(fmt::format("view '{}'", table.about().views[k].name)));
        };
        std::vector<ComingView> coming(table.count());
        const auto code = [&](std::size_t k, const ReferenceView& view) -> Result<void> {
            coming[k].view = ViewBefore::of(view);
            // What stands still, as a background does, is coded once.
            coming[k].again = again(coming[k].view, k);
            if (coming[k].again) {
                STX_TRY(coming[k].images.padding, paddingOf(view.camera));
            } else {
                STX_TRY(coming[k].images, imagesOf(view, k));
            }
            return {};
        };
        return forEachView(
            table, vectors ? peak::kMpeg4Vectors : peak::kMpeg4, job,
            [&](std::size_t k, const std::shared_ptr<const ReferenceView>& view) {
                return placed(code(k, *view), k);
            },
            [&](std::size_t k) {
                const ComingView ready = std::move(coming[k]);
                return placed(take(k, ready), k);
            });
    }

    Result<void> add(const ViewTable& table, std::size_t index, Job& job) {
        STX_CHECK(checkFrame(first_, table.about()));
        const std::uint64_t now = ticks(frames_.timeline().times[index]);
        return coded(
            table, job,
            [&](const ViewBefore& view, std::size_t k) { return view.codedAs(tracks_[k].before); },
            [&](std::size_t k, const ComingView& coming) -> Result<void> {
                if (!coming.again)
                    STX_CHECK(addImages(tracks_[k], coming.images, coming.view.header, now));
                const Camera& camera = coming.view.header.camera;
                if (camera != tracks_[k].camera)
                    STX_CHECK(moveCamera(tracks_[k], coming.images, camera, now));
                tracks_[k].before = coming.view;
                return {};
            });
    }

    /// What the streams of a view get: files, or planes of what becomes video.
    Result<ViewImages> imagesOf(const ReferenceView& view, std::size_t k) {
        ViewImages images;
        if (!asVideo() || isWrittenAsV2(view, options_)) {
            STX_TRY(images, encodeView(view, options_, job_.limits, ranges_[k].longestSplat));
        } else {
            STX_TRY(images.padding, paddingOf(view.camera));
        }
        if (!asVideo()) return images;
        const Node& node = *tracks_[k].node;
        const int bits = videoDepthBits(writtenDepthBits(view, options_));
        const DepthCode code{node.get<float>("nearPlane"), node.get<float>("farPlane"),
                             (1u << bits) - 1};
        STX_TRY(images.depth, depthPlane(view.depth, code, images.padding, images.worstDepth));
        images.depthClamped = isBeyondPlanes(images.worstDepth, code);
        bool clamped = false;
        const Rgba8Image colour = rgba8FromTexture(view.texture, clamped);
        images.linear = view.texture.isLinear();
        images.clamped = clamped;
        images.coverageLost = !alphaFollowsDepth(colour, view.depth, view.depthMayBeUnknown());
        if (images.coverageLost) {
            Bytes alpha;
            for (const glm::u8vec4 p : colour.pixels()) alpha.push_back(std::byte{p.a});
            images.coverage = hashOf(alpha);
        }
        images.texture = yuvPlanes(padded(colour, images.padding));
        return images;
    }
    [[nodiscard]] bool asVideo() const { return options_.h264 >= 0; }
    [[nodiscard]] bool hasAlpha() const { return keepsAlpha(options_); }

    [[nodiscard]] Result<Padding> paddingOf(const Camera& camera) const {
        return centringPadding(camera, std::min(job_.limits.maxImageSide, 65535));
    }

    Result<void> addImages(ViewTrack& track, const ViewImages& images, const ViewHeader& view,
                           std::uint64_t now) {
        if (asVideo()) {
            loss_.linear = loss_.linear || images.linear;
            loss_.clamped = loss_.clamped || images.clamped;
            if (images.depthClamped)
                loss_.worstClamped = std::max(loss_.worstClamped, images.worstDepth);
            loss_.splats = loss_.splats || images.splatsCoarse;
            track.coverageLost = track.coverageLost || images.coverageLost;
        } else {
            const auto k = static_cast<std::size_t>(&track - tracks_.data());
            loss_.add(k, view, writtenDepthBits(view, options_), images);
        }
        std::array<CodedImage, kRoles.size()> found;
        bool any = false;
        for (std::size_t r = 0; r < kRoles.size(); ++r) {
            if (!track.streams[r]) continue;
            found[r] = CodedImage::of(images, r);
            const bool differs = found[r] != track.last[r];
            track.changed[r] = track.changed[r] || differs;
            any = any || differs;
        }
        for (std::size_t r = 0; any && r < kRoles.size(); ++r) {
            ElementaryStream* stream = track.streams[r];
            if (!stream) continue;
            if (asVideo() && r < track.video.size()) {
                STX_CHECK(addVideo(track, images, r, found[r], view, now));
                continue;
            }
            Sample sample;
            sample.time = now;
            sample.data = stream->samples.back().data;
            if (found[r] != track.last[r]) {
                track.last[r] = found[r];
                STX_TRY(sample.data, spool_.add(imageOf(images, r)));
            }
            stream->samples.push_back(std::move(sample));
        }
        return {};
    }

    /// A picture of a stream that is video from its first change on; before, it may stay an image.
    Result<void> addVideo(ViewTrack& track, const ViewImages& images, std::size_t r,
                          const CodedImage& found, const ViewHeader& view, std::uint64_t now) {
        ElementaryStream& stream = *track.streams[r];
        const Bytes& planes = imageOf(images, r);
        int& number = track.video[r];
        if (number < 0 && found == track.last[r]) {
            Sample again;
            again.time = now;
            again.data = stream.samples.back().data;
            stream.samples.push_back(std::move(again));
            return {};
        }
        if (number < 0) {
            const auto before = std::move(stream.samples);
            const Padding& p = images.padding;
            STX_TRY(number,
                    video_->begin(stream, view.camera.width + p.left + p.right,
                                  view.camera.height + p.top + p.bottom, r == 1,
                                  r == 1 ? videoDepthBits(writtenDepthBits(view, options_)) : 8));
            STX_TRY(track.planes[r].source, spool_.source());
            STX_TRY(const Bytes first, track.planes[r].load(job_.limits));
            track.planes[r] = {};
            for (const Sample& sample : before) STX_CHECK(video_->add(number, sample.time, first));
        }
        track.last[r] = found;
        worstDepth_ = std::max(worstDepth_, images.worstDepth);
        return video_->add(number, now, planes);
    }

    /// What H.264 loses.
    void noteVideo() {
        bool half = false, whole = false, depth = false, coverageLost = false;
        for (const ViewTrack& track : tracks_) {
            depth = depth || track.video[1] >= 0;
            if (track.video[0] < 0) continue;
            coverageLost = coverageLost || track.coverageLost;
            const ElementaryStream& colour = *track.streams[0];
            (chromaFormatOf(colour.width, colour.height) == 1 ? half : whole) = true;
        }
        if (half)
            job_.note(
                fmt::format("colour is H.264 of quality {} with half of its chroma, which is "
                            "lossy",
                            options_.h264));
        if (whole)
            job_.note(
                fmt::format("colour with an odd side is H.264 (4:4:4) of quality {}, which is "
                            "lossy",
                            options_.h264));
        if (coverageLost) job_.note("H.264 has no alpha: soft edges of the coverage are lost");
        if (depth)
            job_.note(
                fmt::format("depth that moves is lossless H.264 of 8 or 10 bits: at most "
                            "{:.4g} scene units off",
                            worstDepth_));
    }

    /// A new node in the old one's place. It has its name, and so its id: see assignNodeIds().
    Result<void> moveCamera(ViewTrack& track, const ViewImages& images, const Camera& camera,
                            std::uint64_t now) {
        const Camera& was = track.camera;
        if (camera.orthographic != was.orthographic)
            return fail(ErrorCode::unsupported,
                        "the camera is {} and was {} before; in MPEG-4 a view keeps one projection "
                        "for a whole film; write .exr",
                        camera.orthographic ? "orthographic" : "perspective",
                        was.orthographic ? "orthographic" : "perspective");
        if (!camera.orthographic && (camera.cx != was.cx || camera.cy != was.cy))
            return fail(ErrorCode::unsupported,
                        "the principal point moves from {:.6g} {:.6g} to {:.6g} {:.6g}; in MPEG-4 "
                        "it is fixed by the pictures' size; write .exr",
                        was.cx, was.cy, camera.cx, camera.cy);
        track.camera = camera;
        NodePtr node = std::make_shared<Node>(*track.node);
        STX_CHECK(setCamera(*node, images.padding.camera));
        // Only values of the camera were set; nodes below are shared.
        const auto same = [](const Node::SetField& a, const Node::SetField& b) {
            return a.index == b.index && sameValue(a.value, b.value);
        };
        if (std::ranges::equal(node->setFields, track.node->setFields, same)) return {};
        if (document_.frames.back().time != now || document_.frames.size() == 1) {
            CommandFrame frame;
            frame.time = now;
            document_.frames.push_back(std::move(frame));
        }
        document_.frames.back().commands.emplace_back(ReplaceNode{track.node, node});
        track.node = node;
        return {};
    }

    /// Durations, and MovieTextures where a stream has become one.
    Result<void> finish() {
        STX_CHECK(video_->finish());
        // Depth that became video is not in the pictures of the first frame: see noteVideo().
        for (std::size_t k = 0; k < std::min(tracks_.size(), loss_.depth.size()); ++k)
            if (tracks_[k].video[1] >= 0) loss_.depth[k] = {};
        loss_.note(options_, job_);
        if (asVideo()) noteVideo();
        STX_TRY(const ByteSource source, spool_.source());
        for (const ViewTrack& track : tracks_)
            for (ElementaryStream* stream : track.streams)
                if (stream)
                    for (Sample& sample : stream->samples) sample.data.source = source;
        const std::uint64_t end = ticks(frames_.timeline().end);
        for (ViewTrack& track : tracks_) {
            const NodePtr texture = track.node->get<NodePtr>("diTexture");
            for (std::size_t r = 0; r < kRoles.size(); ++r) {
                ElementaryStream* stream = track.streams[r];
                if (!stream) continue;
                if (!track.changed[r]) {
                    stream->samples.resize(1);
                    continue;
                }
                auto& samples = stream->samples;
                for (std::size_t i = 0; i < samples.size(); ++i) {
                    const std::uint64_t next = i + 1 < samples.size() ? samples[i + 1].time : end;
                    const std::uint64_t shown =
                        next > samples[i].time ? next - samples[i].time : scale_;
                    samples[i].duration = static_cast<std::uint32_t>(
                        std::min<std::uint64_t>(shown, std::numeric_limits<std::uint32_t>::max()));
                }
                const NodePtr still =
                    std::get<NodePtr>(texture->value(std::string_view(kRoles[r])));
                NodePtr movie = makeNode("MovieTexture");
                for (const char* field : {"url", "repeatS", "repeatT"})
                    movie->set(field, still->value(field));
                texture->set(std::string_view(kRoles[r]), movie);
            }
        }
        return noteDuration();
    }
    /// How long the film is, where what is left of it does not tell to a tick: frames at the end
    /// that change nothing are not there, and a sample lasts 2^32 ticks at most.
    Result<void> noteDuration() {
        const double duration = frames_.timeline().duration();
        STX_TRY(const auto images, StreamImages::make(document_, {}, job_.limits));
        STX_TRY(const auto line, timelineOf(document_, images));
        if (std::abs(line.duration() - duration) * scale_ <= 1) return {};
        ViewNotes notes;
        notes.duration = duration;
        const auto& root = std::get<ReplaceScene>(document_.frames[0].commands[0]).root;
        auto& info = root->get<NodeList>("children")[0]->edit<std::vector<std::string>>("info");
        for (std::string& text : notes.text()) info.push_back(std::move(text));
        return {};
    }

    Sequence& frames_;
    const SceneWriteOptions& options_;
    PictureSpool& spool_;
    Job& job_;
    std::vector<ViewRange> ranges_;
    Bounds bounds_;
    Document document_;
    Bundle first_;                      ///< names and cameras
    std::optional<glm::dvec3> origin_;  ///< of all frames
    bool environmentDiffers_ = false;
    std::vector<ViewTrack> tracks_;
    std::uint32_t scale_ = 1000;
    std::optional<VideoStreams> video_;
    PictureLoss loss_;       ///< of pictures; of video colour's range alone
    double worstDepth_ = 0;  ///< of video
};

}  // namespace

Result<Document> sceneFromSequence(Sequence& frames, const SceneWriteOptions& options,
                                   PictureSpool& spool, Job& job) {
    return SequenceWriter(frames, options, spool, job).write();
}

}  // namespace stx::mpeg4
