#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "formats/files/files.hpp"
#include "formats/images/frames.hpp"
#include "formats/yuv/y4m_writer.hpp"
#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/texture.hpp"
#include "lib/render/api/frame.hpp"

namespace stx::tools {

/// Writes rendered frames while the next ones are drawn: encoding runs on its own threads, with a
/// short queue between, so memory stays the same for any number of frames.
class FrameWriter {
  public:
    struct Settings {
        std::string pattern;  ///< file, name_%04d.png, or - for a stream
        std::optional<glm::vec3> background;
        std::string stream;               ///< on stdout: "y4m", or "png", "exr" for one picture
        std::pair<int, int> rate{25, 1};  ///< frames per second, a fraction
        int compression = 1;              ///< of PNG, 0 (fast, large) to 9
        bool noClobber = false;
        bool around = false;     ///< pictures are equirectangular
        glm::dvec3 origin{0.0};  ///< what cameras count from
    };
    /// Errors (usage) when the ending or the stream makes no sense.
    [[nodiscard]] static Result<void> check(const Settings& settings);

    FrameWriter(Settings settings, Job& job);
    ~FrameWriter();
    FrameWriter(const FrameWriter&) = delete;
    FrameWriter& operator=(const FrameWriter&) = delete;

    [[nodiscard]] std::string nameOf(int frame) const;
    /// Makes of a frame what its file will hold, and has that written; blocks while the queue is
    /// full. The error of an earlier frame comes back here or from finish().
    [[nodiscard]] Result<void> write(int index, const Frame& frame, const Camera& camera);
    /// Waits until everything is on disk.
    [[nodiscard]] Result<void> finish();

  private:
    struct Item {
        int index = 0;
        ExrFrame frame;      ///< for OpenEXR
        Rgba8Image picture;  ///< for the others
        Camera camera;
    };
    void work();
    [[nodiscard]] Result<void> writeOne(const Item& item);

    Settings settings_;
    Job& job_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Item> queue_;
    bool closed_ = false;
    std::optional<Error> error_;
    std::optional<OutputFile> streamFile_;
    std::optional<Y4mWriter> stream_;
    std::vector<std::thread> threads_;
};

}  // namespace stx::tools
