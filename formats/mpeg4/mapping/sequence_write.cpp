#include "formats/mpeg4/mapping/sequence_write.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>

#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/video_write.hpp"
#include "formats/mpeg4/mapping/view_images.hpp"
#include "formats/video/video_process.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/same_pictures.hpp"

namespace stx::mpeg4 {
namespace {

/// What must not change from frame to frame.
struct ViewRange {
    double nearPlane = std::numeric_limits<double>::infinity(), farPlane = 0;
    int depthBits = 8;
    float longestSplat = 0;
    bool normals = false, splats = false;
    bool everUnknown = false, alwaysUnknown = true;  ///< NoDepth::unknown, of its frames
    Refined refined;  ///< steps of the first frame, and the largest doubt
};

/// The images of a SimpleTexture, in the order in which they are coded.
constexpr std::array kRoles = {"texture", "depth", "normal", "splatU", "splatV"};
const Bytes& imageOf(const ViewImages& images, std::size_t role) {
    const std::array all = {&images.texture, &images.depth, &images.normal, &images.splatU,
                            &images.splatV};
    return *all[role];
}

/// Whether two frames of a view are coded alike: the lens counts, too, as pictures are padded by
/// it.
bool codedAlike(const ReferenceView& a, const ReferenceView& b) {
    const Camera &c = a.camera, &d = b.camera;
    return c.orthographic == d.orthographic && c.fx == d.fx && c.fy == d.fy && c.cx == d.cx &&
           c.cy == d.cy && samePictures(a, b);
}

/// A view on its way into the document.
struct ViewTrack {
    NodePtr node;  ///< the DepthImage that is shown now
    Camera camera;
    ReferenceView before;  ///< of the frame before
    std::array<ElementaryStream*, kRoles.size()> streams{};
    std::array<Bytes, kRoles.size()> last;
    std::array<bool, kRoles.size()> changed{};
    std::array<int, 2> video{-1, -1};  ///< of colour and depth in H.264: VideoStreams' number
};

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
        STX_CHECK(findRanges());
        STX_CHECK(begin());
        const std::size_t count = frames_.timeline().count();
        for (std::size_t i = 1; i < count; ++i) {
            job_.progress(static_cast<std::int64_t>(count + i),
                          static_cast<std::int64_t>(2 * count), "writing frames");
            STX_CHECK(job_.checkCancelled());
            STX_TRY(auto bundle, frame(i));
            if (auto done = add(bundle, i); !done)
                return tl::unexpected(done.error().at(placeOf(i)));
        }
        STX_CHECK(finish());
        return std::move(document_);
    }

  private:
    [[nodiscard]] std::string placeOf(std::size_t i) const {
        return fmt::format("frame {} ({:g} s)", i, frames_.timeline().times[i]);
    }
    /// The presentation's time; see ViewNotes::start for the film's.
    [[nodiscard]] std::uint64_t ticks(double seconds) const {
        return ticksAt(seconds - frames_.timeline().start(), scale_);
    }

    /// A frame with the ranges of the sequence. Its notes are said once, of the first frame.
    Result<Bundle> frame(std::size_t i) {
        Job quiet;
        quiet.workFor(job_);
        auto bundle = frames_.frame(i, i == 0 && ranges_.empty() ? job_ : quiet);
        if (!bundle) return tl::unexpected(bundle.error().at(placeOf(i)));
        for (std::size_t k = 0; k < ranges_.size(); ++k) {
            ReferenceView& view = bundle->views[k];
            view.nearPlane = ranges_[k].nearPlane;
            view.farPlane = ranges_[k].farPlane;
            view.depthBits = ranges_[k].depthBits;
            // A note says it of the whole film; alpha, where it is written, of each frame.
            const bool alpha = !asVideo() && options_.texture == SceneWriteOptions::Texture::png;
            const bool unknown = alpha ? ranges_[k].everUnknown : ranges_[k].alwaysUnknown;
            view.noDepth = unknown ? NoDepth::unknown : NoDepth::empty;
            view.refined = ranges_[k].refined;
        }
        return bundle;
    }

    Result<void> findRanges() {
        const std::size_t count = frames_.timeline().count();
        std::vector<ViewRange> ranges;
        Bundle first;
        for (std::size_t i = 0; i < count; ++i) {
            job_.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(2 * count),
                          "writing frames");
            STX_CHECK(job_.checkCancelled());
            STX_TRY(auto bundle, frame(i));
            if (i == 0) {
                ranges.resize(bundle.views.size());
                first = headersOf(bundle);
            }
            if (auto same = checkSameViews(first, bundle); !same)
                return tl::unexpected(same.error().at(placeOf(i)));
            const Bounds here = bundle.bounds ? *bundle.bounds : bundle.computeBounds();
            if (!here.empty()) {
                bounds_.add(here.min);
                bounds_.add(here.max);
            }
            for (std::size_t k = 0; k < ranges.size(); ++k)
                if (auto done = widen(ranges[k], bundle.views[k], i == 0); !done)
                    return tl::unexpected(done.error().at(
                        fmt::format("{}: view '{}'", placeOf(i), bundle.views[k].name)));
        }
        ranges_ = std::move(ranges);
        return {};
    }
    Result<void> widen(ViewRange& range, const ReferenceView& view, bool first) const {
        if (first) {
            range.normals = view.hasNormals();
            range.splats = view.hasSplats();
            range.refined.steps = view.refined.steps;
        }
        range.refined.doubt = std::max(range.refined.doubt, view.refined.doubt);
        if (range.normals != view.hasNormals() || range.splats != view.hasSplats())
            return fail(ErrorCode::unsupported,
                        "normals or splats are there in some frames only; bake all or none");
        if (view.pruned && (asVideo() || options_.texture == SceneWriteOptions::Texture::jpeg))
            return fail(ErrorCode::unsupported,
                        "a pruned view that moves keeps its mark in the alpha of its colour, "
                        "which {} does not have; use PNG",
                        asVideo() ? "H.264" : "JPEG");
        const bool unknown = view.noDepth == NoDepth::unknown;
        range.everUnknown = range.everUnknown || unknown;
        range.alwaysUnknown = range.alwaysUnknown && unknown;
        range.nearPlane = std::min(range.nearPlane, view.nearPlane);
        range.farPlane = std::max(range.farPlane, view.farPlane);
        range.depthBits = std::max(range.depthBits, view.depthBits);
        if (view.hasSplats())
            range.longestSplat = std::max(range.longestSplat, longestSplatOf(view));
        return {};
    }

    /// The document of the first frame, whose streams the others go into.
    Result<void> begin() {
        STX_TRY(auto bundle, frame(0));
        bundle.bounds = bounds_;
        SceneWriteOptions options = options_;
        for (const ViewRange& range : ranges_)
            options.splatRanges.push_back(range.splats ? range.longestSplat : 0);
        STX_TRY(document_, sceneFromBundle(bundle, options, job_));
        scale_ = frames_.timeline().timescale();
        document_.sceneStream.timescale = scale_;
        const Timeline& timeline = frames_.timeline();
        const double span = timeline.times.back() - timeline.times.front();
        video_.emplace(options_.h264,
                       span > 0 ? static_cast<double>(timeline.count() - 1) / span : 25.0,
                       job_.limits, [this](const Bytes& bytes) { return spool_.add(bytes); });
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
            track.camera = bundle.views[tracks_.size()].camera;
            const NodePtr& texture = node->get<NodePtr>("diTexture");
            for (std::size_t r = 0; r < kRoles.size(); ++r) {
                const int field = texture->info->find(kRoles[r]);
                const NodePtr image =
                    field < 0 ? nullptr : std::get<NodePtr>(texture->value(field));
                if (!image) continue;
                const auto& urls = image->get<std::vector<Url>>("url");
                ElementaryStream* stream = streams.at(urls.front().objectDescriptorId);
                STX_TRY(track.last[r], stream->samples[0].data.load(job_.limits));
                STX_TRY(stream->samples[0].data, spool_.add(track.last[r]));
                stream->timescale = scale_;
                stream->samples[0].time = ticks(frames_.timeline().times[0]);
                track.streams[r] = stream;
            }
            tracks_.push_back(std::move(track));
        }
        first_ = headersOf(bundle);
        for (std::size_t k = 0; k < tracks_.size(); ++k) {
            if (asVideo()) {
                auto images = imagesOf(bundle.views[k], k);
                if (!images)
                    return tl::unexpected(
                        images.error().at(fmt::format("view '{}'", bundle.views[k].name)));
                tracks_[k].last[0] = std::move(images->texture);
                tracks_[k].last[1] = std::move(images->depth);
                worstDepth_ = std::max(worstDepth_, images->worstDepth);
            }
            tracks_[k].before = std::move(bundle.views[k]);
        }
        return {};
    }

    Result<void> add(Bundle& bundle, std::size_t index) {
        STX_CHECK(checkSameViews(first_, bundle));
        std::vector<Result<ViewImages>> images(bundle.views.size());
        parallelFor(0, images.size(), [&](std::size_t k) {
            // What stands still, as a background does, is coded once.
            images[k] = codedAlike(bundle.views[k], tracks_[k].before)
                            ? imagesAgain(tracks_[k], bundle.views[k])
                            : imagesOf(bundle.views[k], k);
        });
        const std::uint64_t now = ticks(frames_.timeline().times[index]);
        for (std::size_t k = 0; k < images.size(); ++k) {
            auto done = images[k] ? addView(tracks_[k], *images[k], bundle.views[k], now)
                                  : Result<void>(tl::unexpected(images[k].error()));
            if (!done)
                return tl::unexpected(
                    done.error().at(fmt::format("view '{}'", bundle.views[k].name)));
            tracks_[k].before = std::move(bundle.views[k]);
        }
        return {};
    }

    /// What the streams of a view get: files, or planes of what becomes video.
    Result<ViewImages> imagesOf(const ReferenceView& view, std::size_t k) {
        ViewImages images;
        if (!asVideo() || isWrittenAsV2(view, options_)) {
            STX_TRY(images, encodeView(view, options_, job_.limits, ranges_[k].longestSplat));
        } else {
            STX_TRY(images.padding,
                    centringPadding(view.camera, std::min(job_.limits.maxImageSide, 65535)));
        }
        if (!asVideo()) return images;
        const Node& node = *tracks_[k].node;
        const int bits = videoDepthBits(writtenDepthBits(view, options_));
        const DepthCode code{node.get<float>("nearPlane"), node.get<float>("farPlane"),
                             (1u << bits) - 1};
        STX_TRY(images.depth, depthPlane(view.depth, code, images.padding, images.worstDepth));
        bool clamped = false;
        const Rgba8Image colour = rgba8FromTexture(view.texture, clamped);
        images.coverageLost = !alphaFollowsDepth(colour, view.depth, view.depthMayBeUnknown());
        images.texture = yuvPlanes(padded(colour, images.padding));
        return images;
    }
    [[nodiscard]] bool asVideo() const { return options_.h264 >= 0; }

    /// The images of the frame before, around a camera that may have moved.
    Result<ViewImages> imagesAgain(const ViewTrack& track, const ReferenceView& view) const {
        ViewImages images;
        STX_TRY(images.padding,
                centringPadding(view.camera, std::min(job_.limits.maxImageSide, 65535)));
        images.texture = track.last[0];
        images.depth = track.last[1];
        images.normal = track.last[2];
        images.splatU = track.last[3];
        images.splatV = track.last[4];
        return images;
    }

    Result<void> addView(ViewTrack& track, const ViewImages& images, const ReferenceView& view,
                         std::uint64_t now) {
        bool any = false;
        for (std::size_t r = 0; r < kRoles.size(); ++r) {
            if (!track.streams[r]) continue;
            const bool differs = imageOf(images, r) != track.last[r];
            track.changed[r] = track.changed[r] || differs;
            any = any || differs;
        }
        for (std::size_t r = 0; any && r < kRoles.size(); ++r) {
            ElementaryStream* stream = track.streams[r];
            if (!stream) continue;
            if (asVideo() && r < track.video.size()) {
                STX_CHECK(addVideo(track, images, r, view, now));
                continue;
            }
            Sample sample;
            sample.time = now;
            sample.data = stream->samples.back().data;
            if (imageOf(images, r) != track.last[r]) {
                track.last[r] = imageOf(images, r);
                STX_TRY(sample.data, spool_.add(track.last[r]));
            }
            stream->samples.push_back(std::move(sample));
        }
        if (view.camera == track.camera) return {};
        return moveCamera(track, images, view, now);
    }

    /// A picture of a stream that is video from its first change on; before, it may stay an image.
    Result<void> addVideo(ViewTrack& track, const ViewImages& images, std::size_t r,
                          const ReferenceView& view, std::uint64_t now) {
        ElementaryStream& stream = *track.streams[r];
        const Bytes& planes = imageOf(images, r);
        int& number = track.video[r];
        if (number < 0 && planes == track.last[r]) {
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
            for (const Sample& sample : before)
                STX_CHECK(video_->add(number, sample.time, track.last[r]));
        }
        track.last[r] = planes;
        worstDepth_ = std::max(worstDepth_, images.worstDepth);
        coverageLost_ = coverageLost_ || images.coverageLost;
        return video_->add(number, now, planes);
    }

    /// What H.264 loses.
    void noteVideo() {
        bool half = false, whole = false, depth = false;
        for (const ViewTrack& track : tracks_) {
            depth = depth || track.video[1] >= 0;
            if (track.video[0] < 0) continue;
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
        if ((half || whole) && coverageLost_)
            job_.note("H.264 has no alpha: soft edges of the coverage are lost");
        if (depth)
            job_.note(
                fmt::format("depth that moves is lossless H.264 of 8 or 10 bits: at most "
                            "{:.4g} scene units off",
                            worstDepth_));
    }

    /// A new node in the old one's place. It has its name, and so its id: see assignNodeIds().
    Result<void> moveCamera(ViewTrack& track, const ViewImages& images, const ReferenceView& view,
                            std::uint64_t now) {
        const Camera& was = track.camera;
        if (!view.camera.orthographic && (view.camera.cx != was.cx || view.camera.cy != was.cy))
            return fail(ErrorCode::unsupported,
                        "the principal point moves from {:.6g} {:.6g} to {:.6g} {:.6g}; in MPEG-4 "
                        "it is fixed by the pictures' size; write .exr",
                        was.cx, was.cy, view.camera.cx, view.camera.cy);
        track.camera = view.camera;
        NodePtr node = std::make_shared<Node>(*track.node);
        setCamera(*node, images.padding.camera);
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
        return {};
    }

    Sequence& frames_;
    const SceneWriteOptions& options_;
    PictureSpool& spool_;
    Job& job_;
    std::vector<ViewRange> ranges_;
    Bounds bounds_;
    Document document_;
    Bundle first_;  ///< names and cameras
    std::vector<ViewTrack> tracks_;
    std::uint32_t scale_ = 1000;
    std::optional<VideoStreams> video_;
    double worstDepth_ = 0;
    bool coverageLost_ = false;
};

}  // namespace

Result<Document> sceneFromSequence(Sequence& frames, const SceneWriteOptions& options,
                                   PictureSpool& spool, Job& job) {
    return SequenceWriter(frames, options, spool, job).write();
}

}  // namespace stx::mpeg4
