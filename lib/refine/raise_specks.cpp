#include "lib/refine/raise_specks.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

// Looked at on a portrait whose edges are four to six samples wide, from 5 % of its distance aside.

/// Neighbours whose 1/z differ by a smaller share are one part: surface mode draws them as one
/// surface. 0.015 joins no more.
constexpr float kJoined = 0.03f;
/// Parts of fewer samples are specks. A third of it leaves bits of a face on the wall beside it,
/// three times as many change nothing.
constexpr double kSpeckSamples = 10;
/// Colours that differ by this (of 0..1) are hardly alike, and what a contact counts anyway.
constexpr float kUnlikeColour = 0.06f, kAnyway = 0.02f;

constexpr glm::ivec2 kSides[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

class Specks {
  public:
    Specks(Image<float>& depth, const Texture& picture, std::size_t fewest)
        : depth_(depth),
          picture_(picture),
          fewest_(fewest),
          kind_(depth.width(), depth.height(), kUnseen) {}

    void join() {
        findEdges();
        std::vector<std::vector<glm::ivec2>> specks;
        std::vector<glm::ivec2> part;
        for (const glm::ivec2 p : edges_)
            if (kindAt(p) == kUnseen && isSpeck(p, part)) specks.push_back(part);
        std::vector<float> joined(specks.size());
        for (std::size_t i = 0; i < specks.size(); ++i) joined[i] = inverseBeside(specks[i]);
        for (std::size_t i = 0; i < specks.size(); ++i)
            for (const glm::ivec2 p : specks[i])
                if (joined[i] > 0) depth_.at(p.x, p.y) = 1 / joined[i];
    }

  private:
    enum : std::uint8_t { kUnseen, kLarge, kSmall };

    [[nodiscard]] bool isThere(glm::ivec2 p) const {
        return depth_.contains(p.x, p.y) && hasPoint(depth_.at(p.x, p.y));
    }
    [[nodiscard]] std::uint8_t& kindAt(glm::ivec2 p) { return kind_.at(p.x, p.y); }
    [[nodiscard]] bool areJoined(glm::ivec2 a, glm::ivec2 b) const {
        const float u = depth_.at(a.x, a.y), v = depth_.at(b.x, b.y);
        return std::abs(u - v) <= kJoined * std::max(u, v);
    }

    /// Pixels beside another part. Only these need be looked at: no speck is without one.
    void findEdges() {
        for (int y = 0; y < depth_.height(); ++y) {
            for (int x = 0; x < depth_.width(); ++x) {
                const glm::ivec2 p(x, y);
                if (isThere(p) && std::ranges::any_of(kSides, [&](glm::ivec2 side) {
                        return isThere(p + side) && !areJoined(p, p + side);
                    }))
                    edges_.push_back(p);
            }
        }
    }

    /// Whether the part that a pixel lies in is one; `part` gets its pixels. Marks what it saw.
    bool isSpeck(glm::ivec2 first, std::vector<glm::ivec2>& part) {
        part.assign(1, first);
        kindAt(first) = kSmall;
        bool small = true;
        for (std::size_t k = 0; k < part.size() && small; ++k) {
            for (const glm::ivec2 side : kSides) {
                const glm::ivec2 p = part[k] + side;
                if (!isThere(p) || !areJoined(part[k], p)) continue;
                if (kindAt(p) == kLarge || part.size() >= fewest_) small = false;
                if (kindAt(p) != kUnseen) continue;
                kindAt(p) = kSmall;
                part.push_back(p);
            }
        }
        if (!small)
            for (const glm::ivec2 p : part) kindAt(p) = kLarge;
        return small;
    }

    /// 1/z of the larger part that touches a speck where colours are most alike; 0: none does.
    [[nodiscard]] float inverseBeside(const std::vector<glm::ivec2>& speck) {
        struct Contact {
            float inverse, alike;
        };
        std::vector<Contact> contacts;
        for (const glm::ivec2 p : speck) {
            for (const glm::ivec2 side : kSides) {
                const glm::ivec2 q = p + side;
                if (!isThere(q) || kindAt(q) != kLarge) continue;
                const glm::vec3 unlike = colour(p) - colour(q);
                contacts.push_back({1 / depth_.at(q.x, q.y),
                                    kAnyway + std::exp(-glm::dot(unlike, unlike) /
                                                       (2 * kUnlikeColour * kUnlikeColour))});
            }
        }
        std::ranges::sort(contacts, {},
                          [](const Contact& c) { return std::pair(c.inverse, c.alike); });
        float best = 0, found = 0, alike = 0, sum = 0, before = 0;
        for (const Contact& c : contacts) {
            if (c.inverse - before > kJoined * c.inverse) alike = sum = 0;
            alike += c.alike;
            sum += c.alike * c.inverse;
            before = c.inverse;
            if (alike <= best) continue;
            best = alike;
            found = sum / alike;
        }
        return found;
    }
    [[nodiscard]] glm::vec3 colour(glm::ivec2 p) const { return glm::vec3(picture_.at(p.x, p.y)); }

    Image<float>& depth_;
    const Texture& picture_;
    const std::size_t fewest_;  ///< pixels of a part that is not a speck
    Image<std::uint8_t> kind_;
    std::vector<glm::ivec2> edges_;
};

}  // namespace

void joinSpecks(Image<float>& depth, const Texture& picture, double sample) {
    const double fewest = kSpeckSamples * sample * sample;
    Specks(depth, picture, static_cast<std::size_t>(std::max(2.0, fewest))).join();
}

}  // namespace stx
