#include "tools/frame_writer.hpp"

#include <system_error>

#include "lib/base/parallel.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

constexpr std::size_t kQueue = 2;  // frames waiting; enough to hide encoding, small in memory

}  // namespace

Result<void> FrameWriter::check(const Settings& s) {
    if (s.pattern == "-") {
        if (s.stream.empty())
            return fail(ErrorCode::usage, "pictures on stdout need --file-format y4m, png or exr");
        return {};
    }
    if (!s.stream.empty())
        return fail(ErrorCode::usage, "--file-format {} is for a stream on stdout, -o -", s.stream);
    STX_CHECK(frameFormat(s.pattern));
    return {};
}

FrameWriter::FrameWriter(Settings settings, Job& job) : settings_(std::move(settings)), job_(job) {
    // A stream is written in order by one thread; files by as many as may run.
    const int count = settings_.pattern == "-" ? 1 : threadCount();
    for (int i = 0; i < count; ++i) {
        try {
            threads_.emplace_back([this] { work(); });
        } catch (const std::system_error&) {
            if (threads_.empty()) throw;
            break;  // the system gives no more of them; these do
        }
    }
}

FrameWriter::~FrameWriter() {
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
        if (!error_) queue_.clear();
    }
    changed_.notify_all();
    for (auto& t : threads_) {
        if (t.joinable()) t.join();
    }
}

std::string FrameWriter::nameOf(int frame) const {
    return frameName(settings_.pattern, frame).value_or(settings_.pattern);
}

Result<void> FrameWriter::write(int index, const Frame& frame, const Camera& camera) {
    Item item{index, {}, {}, camera};
    STX_TRY(const auto format, settings_.stream == "exr" ? Result<FrameFormat>(FrameFormat::exr)
                                                         : frameFormat(settings_.pattern));
    // Only OpenEXR has room for more than 8 bits and colours; what waits is kept small.
    if (settings_.stream == "y4m")
        item.picture = rgba8From(frame, settings_.background.value_or(glm::vec3(0.0f)));
    else if (format == FrameFormat::exr)
        item.frame = exrFrameOf(frame, settings_.background);
    else
        item.picture = pictureOf(frame, format, settings_.background);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return queue_.size() < kQueue || error_; });
    if (error_) return tl::unexpected(*error_);
    queue_.push_back(std::move(item));
    changed_.notify_all();
    return {};
}

Result<void> FrameWriter::finish() {
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
    }
    changed_.notify_all();
    for (auto& t : threads_) t.join();
    if (error_) return tl::unexpected(*error_);
    if (streamFile_) STX_CHECK(streamFile_->commit());
    return {};
}

void FrameWriter::work() {
    while (true) {
        Item item;
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [this] { return !queue_.empty() || closed_; });
            if (queue_.empty() || error_) return;
            item = std::move(queue_.front());
            queue_.pop_front();
        }
        changed_.notify_all();
        if (auto ok = writeOne(item); !ok) {
            const std::lock_guard lock(mutex_);
            if (!error_) error_ = ok.error();
            changed_.notify_all();
            return;
        }
    }
}

Result<void> FrameWriter::writeOne(const Item& item) {
    if (settings_.stream != "y4m") {
        FrameOptions file;
        file.background = settings_.background;
        file.noClobber = settings_.noClobber;
        file.pngLevel = settings_.compression;
        file.camera = item.camera;
        file.origin = settings_.origin;
        file.around = settings_.around;
        return item.picture.empty() ? writeExrFrame(item.frame, nameOf(item.index), file)
                                    : writePicture(item.picture, nameOf(item.index), file);
    }
    if (!stream_) {
        STX_TRY(streamFile_, OutputFile::create("-"));
        Y4mOptions video;
        video.rateNumerator = settings_.rate.first;
        video.rateDenominator = settings_.rate.second;
        STX_TRY(stream_, Y4mWriter::create(*streamFile_, item.picture.width(),
                                           item.picture.height(), video));
    }
    return stream_->write(item.picture);
}

}  // namespace stx::tools
