// Novel views before a background that was remembered, against the truth: what a view uncovers now
// and showed at another time.

#include <cmath>

#include <gtest/gtest.h>

#include "lib/render/renderer.hpp"
#include "tests/golden/background/frames_of.hpp"
#include "tests/moving_frames.hpp"
#include "tests/shared_data.hpp"

namespace stx {
namespace {

/// Squared errors over some pixels of several frames.
struct Error {
    double sum = 0;
    std::int64_t count = 0;

    void add(glm::vec4 drawn, glm::u8vec4 truth) {
        for (int c = 0; c < 3; ++c) {
            const double d = std::round(std::clamp(drawn[c], 0.0f, 1.0f) * 255.0) -
                             static_cast<double>(truth[c]);
            sum += d * d / 3;
        }
        ++count;
    }
    [[nodiscard]] double psnr() const {
        return 10 * std::log10(255.0 * 255.0 * static_cast<double>(count) / sum);
    }
};

Frame draw(const Bundle& bundle, const Camera& camera, Fill fill, Quality quality, Job& job,
           RenderMode mode = RenderMode::surface) {
    RenderSettings settings;
    settings.quality = quality;
    settings.fill = fill;
    settings.mode = mode;
    auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    EXPECT_TRUE(renderer) << renderer.error().text();
    auto frame = (*renderer)->render(camera);
    EXPECT_TRUE(frame) << frame.error().text();
    return *std::move(frame);
}

/// The middle of each channel over all pictures: what stands still.
Image<glm::u8vec4> medianOf(const std::vector<Image<glm::u8vec4>>& pictures) {
    Image<glm::u8vec4> out(pictures[0].width(), pictures[0].height());
    std::vector<std::uint8_t> values(pictures.size());
    for (std::size_t i = 0; i < out.count(); ++i) {
        for (int c = 0; c < 3; ++c) {
            for (std::size_t k = 0; k < values.size(); ++k) values[k] = pictures[k].data()[i][c];
            std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
            out.data()[i][c] = values[values.size() / 2];
        }
    }
    return out;
}

bool near(glm::u8vec4 a, glm::u8vec4 b) {
    for (int c = 0; c < 3; ++c)
        if (std::abs(a[c] - b[c]) > 8) return false;
    return true;
}

struct Figures {
    Error spatialHoles, holes, spatialFrame, frame, perfect;
    double flicker = 0, spatialFlicker = 0;
};

/// View v1 of moving-room alone, drawn at another camera in every frame.
Figures measure(const moving::MovingRoom& room, const std::string& novel, Quality quality) {
    Job job;
    const auto model = backgroundOf([&](int i) { return room.view("v1", i); },
                                    moving::MovingRoom::time, moving::MovingRoom::kFrames, job);
    std::vector<Image<glm::u8vec4>> truths;
    for (int i = 0; i < moving::MovingRoom::kFrames; ++i)
        truths.push_back(moving::picture(room.picturePath(novel, i)));
    const Image<glm::u8vec4> still = medianOf(truths);
    const Camera camera = room.cameras.at(novel)[0];
    Bundle alone;
    alone.views = {model.view};
    const Frame behind = draw(alone, camera, Fill::none, quality, job);
    Figures f;
    std::optional<Frame> lastSpatial, last;
    Image<std::uint8_t> lastHole;
    double change = 0, spatialChange = 0;
    std::int64_t changes = 0;
    for (int i = 0; i < moving::MovingRoom::kFrames; ++i) {
        Bundle now;
        now.views = {room.view("v1", i)};
        const Frame open = draw(now, camera, Fill::none, quality, job);
        Frame spatial = draw(now, camera, Fill::spatial, quality, job);
        now.views.push_back(model.view);
        Frame temporal = draw(now, camera, Fill::background, quality, job);
        Image<std::uint8_t> isHole(camera.width, camera.height, std::uint8_t{0});
        for (std::size_t p = 0; p < still.count(); ++p) {
            const glm::u8vec4 truth = truths[static_cast<std::size_t>(i)].data()[p];
            const bool hole = open.colour.data()[p].a < 0.5f && behind.colour.data()[p].a > 0.5f &&
                              near(truth, still.data()[p]);
            isHole.data()[p] = hole;
            const glm::vec4 a = spatial.colour.data()[p], b = temporal.colour.data()[p];
            f.spatialFrame.add(a, truth);
            f.frame.add(b, truth);
            f.perfect.add(hole ? glm::vec4(truth) / 255.0f : b, truth);
            if (!hole) continue;
            f.spatialHoles.add(a, truth);
            f.holes.add(b, truth);
            if (!last || !lastHole.data()[p]) continue;
            for (int c = 0; c < 3; ++c) {
                change += 255 * std::abs(b[c] - last->colour.data()[p][c]) / 3;
                spatialChange += 255 * std::abs(a[c] - lastSpatial->colour.data()[p][c]) / 3;
            }
            ++changes;
        }
        {
            static double cat[8][2]; static std::int64_t n[8];
            const int w = camera.width, h = camera.height;
            for (int y = 0; y < h; ++y) for (int x = 0; x < w; ++x) {
                const glm::u8vec4 truth = truths[static_cast<std::size_t>(i)].at(x, y);
                const float a = open.colour.at(x, y).a;
                const bool st = near(truth, still.at(x, y)), seen = behind.colour.at(x, y).a > 0.5f;
                bool close = false;
                for (int j = -3; j <= 3; ++j) for (int k = -3; k <= 3; ++k) if (isHole.contains(x + k, y + j) && open.colour.at(x + k, y + j).a < 0.5f) close = true;
                int c = !st ? (a < 0.5f ? 0 : close ? 1 : 2) : a < 0.5f ? (seen ? 3 : 4) : a < 0.999f ? 5 : close ? 6 : 7;
                Error e; e.add(temporal.colour.at(x, y), truth); cat[c][0] += e.sum;
                Error f2; f2.add(behind.colour.at(x, y), truth); cat[c][1] += f2.sum;
                ++n[c];
            }
            if (i == 15) { const char* names[] = {"moving open", "moving edge", "moving covered", "hole seen", "hole unseen", "partly", "static edge", "static covered"};
                double total = 0; for (auto& c : cat) total += c[0];
                for (int c = 0; c < 8; ++c) { fmt::print("   {:16} {:.4f} of pixels, error share {:.4f}, {:.2f} dB, behind {:.2f} dB\n", names[c], n[c] / (16.0 * w * h), cat[c][0] / total, 10 * std::log10(65025.0 * n[c] / cat[c][0]), 10 * std::log10(65025.0 * n[c] / cat[c][1])); cat[c][0] = cat[c][1] = 0; n[c] = 0; }
            }
            if (i == 6) {
                Image<glm::u8vec4> out(w, h * 3);
                for (int y = 0; y < h; ++y) for (int x = 0; x < w; ++x) {
                    const glm::vec4 c = glm::clamp(temporal.colour.at(x, y), 0.0f, 1.0f) * 255.0f; const glm::u8vec4 t = truths[6].at(x, y);
                    out.at(x, y) = {c.r, c.g, c.b, 255};
                    int d = 0; for (int k = 0; k < 3; ++k) d = std::max(d, std::abs(int(c[k]) - int(t[k])));
                    d = std::min(255, d * 3);
                    out.at(x, y + h) = {d, d, d, 255};
                    const int o = int(255 * open.colour.at(x, y).a);
                    out.at(x, y + 2 * h) = {isHole.at(x, y) ? 255 : o, o, o, 255};
                }
                const auto bytes = encodePng(w, h * 3, 4, 8, out.data(), true, 1);
                std::FILE* file = std::fopen(fmt::format("/tmp/h7/draw_{}.png", novel).c_str(), "wb");
                std::fwrite(bytes->data(), 1, bytes->size(), file);
                std::fclose(file);
            }
        }
        { Error e; for (std::size_t p = 0; p < still.count(); ++p) if (isHole.data()[p]) e.add(temporal.colour.data()[p], truths[static_cast<std::size_t>(i)].data()[p]); fmt::print("{:.1f} ", e.psnr()); }
        lastHole = std::move(isHole);
        lastSpatial = std::move(spatial);
        last = std::move(temporal);
    }
    f.flicker = change / static_cast<double>(changes);
    f.spatialFlicker = spatialChange / static_cast<double>(changes);
    return f;
}

TEST(RenderBackground, MovingRoom) {
    REQUIRE_SHARED(folder, "data/motion/moving-room");
    const moving::MovingRoom room(folder);
    for (const char* novel : {"o0", "n0"}) {
        const Figures f = measure(room, novel, Quality::best);
        fmt::print(
            "v1 -> {}: {} pixels: {:.2f} -> {:.2f} dB, frame {:.2f} -> {:.2f} (perfect {:.2f}), "
            "flicker {:.3f} -> {:.3f}\n",
            novel, f.holes.count, f.spatialHoles.psnr(), f.holes.psnr(), f.spatialFrame.psnr(),
            f.frame.psnr(), f.perfect.psnr(), f.spatialFlicker, f.flicker);
    }
}

}  // namespace
}  // namespace stx
