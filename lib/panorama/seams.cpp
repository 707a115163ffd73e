#include <algorithm>
#include <atomic>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/panorama/footprints.hpp"
#include "lib/panorama/max_flow.hpp"

namespace stx::panorama {
namespace {

// All costs are differences of sRGB-coded colour, 0..255, so that they can be added up.

/// Cost of a seam for each cell that it passes, whatever the pictures show: of two seams that are
/// seen as little the shorter one wins.
constexpr float kSeamLength = 2;
/// Cost of a seam in a cell where one of its two pictures ends.
constexpr float kEndOfPicture = 60;
/// Cost of showing a cell at a picture's edge; it falls to 0 towards the picture's middle.
constexpr float kEdge = 1.5f;
/// Cost of showing a cell whose light is clipped, above this linear light: another picture may have
/// it.
constexpr float kClipped = 4, kClippedLight = 0.97f;
/// Cost of showing a cell that a picture does not fill: more than any other.
constexpr float kNotFilled = 1e6f;
/// Of a mover that is seen at the very edge of a picture and so is cut off, this share of its cost
/// counts; of one that is at 0.4 of the way to the middle and farther in, all.
constexpr float kCutOff = 0.2f, kWholeByInside = 2;
/// Of movers, cells so near to each other are one.
constexpr int kSameMover = 2;
/// The edge of what is seen goes on by so many cells, so that its pixels get a whole picture.
constexpr int kExtended = 2;
/// The least difference of colours before any was looked at: more than any.
constexpr float kUnlike = 1e9f;
/// A cell shows a mover where nothing within this many cells of another picture is like it, while
/// all that the other one shows there is also in this one: leaves, waves and parallax are in both.
constexpr int kMoverReach = 3;
/// A mover costs its difference of colour less this.
constexpr float kMoverDifference = 25;
/// Movers whose costs sum up to less than this may be noise.
constexpr float kWeakMover = 250;
/// Cells around a mover that belong to it.
constexpr int kMoverMargin = 2;
/// How often each picture may take cells from the others.
constexpr int kRounds = 2;

glm::vec3 codedOf(glm::vec3 light) {
    return 255.0f * glm::vec3(srgbByTable(light.r), srgbByTable(light.g), srgbByTable(light.b));
}

/// Something that one picture shows and others do not.
struct Mover {
    std::size_t picture = 0;
    std::vector<glm::ivec2> cells;  ///< of the picture's box
    float strength = 0;
};

/// Everything that the seams are found with.
class SeamGrid {
  public:
    SeamGrid(const std::vector<Footprint>& prints, const std::vector<glm::dvec3>& gains,
             int gridWidth)
        : prints_(prints), width_(gridWidth), height_(gridWidth / 2) {
        // Differences are seen in coded colours.
        coded_.resize(prints.size());
        cost_.resize(prints.size());
        parallelFor(0, prints.size(), [&](std::size_t k) {
            const Footprint& f = prints[k];
            coded_[k] = Image<glm::vec3>(f.box.width, f.box.height, glm::vec3(0));
            cost_[k] = Image<float>(f.box.width, f.box.height, 0.0f);
            for (std::size_t p = 0; p < coded_[k].count(); ++p) {
                const glm::vec3 light = cleared(f.colour.pixels()[p], f.clearingAt(p));
                const glm::vec3 gain(gains[k]);
                const glm::vec3 shown = codedOf(withGain(light, gain));
                coded_[k].pixels()[p] = shown;
                const float out = 1 - std::min(1.0f, f.inside.pixels()[p]);
                // Beside the edge, what the gain would have changed and the clipped light does not
                // let it.
                const glm::vec3 held = shown - codedOf(light * gain);
                cost_[k].pixels()[p] = kEdge * out * out + std::max({held.r, held.g, held.b});
                const glm::vec3 raw = f.colour.pixels()[p];
                if (std::max({raw.r, raw.g, raw.b}) > kClippedLight)
                    cost_[k].pixels()[p] += kClipped;
            }
        });
        labels_ = Image<int>(width_, height_, -1);
        startWithMiddles();
    }

    Image<int>& labels() { return labels_; }

    /// Makes what shows a mover cost more, where another picture does not show it.
    void avoidMovers() {
        std::vector<Image<float>> movers(prints_.size());
        parallelFor(0, prints_.size(), [&](std::size_t k) {
            const Footprint& f = prints_[k];
            movers[k] = Image<float>(f.box.width, f.box.height, 0.0f);
            std::vector<float> found;
            for (int y = 0; y < f.box.height; ++y)
                for (int x = 0; x < f.box.width; ++x) {
                    if (f.inside.at(x, y) <= 0) continue;
                    const glm::ivec2 p = wrapped({f.box.x + x, f.box.y + y});
                    found.clear();
                    for (std::size_t other = 0; other < prints_.size(); ++other) {
                        if (other == k || !sees(other, p)) continue;
                        const float own = newIn(k, other, p, kMoverDifference);
                        found.push_back(own > kMoverDifference ? own - newIn(other, k, p, 0) : 0);
                    }
                    if (found.empty()) continue;
                    // Half of the others must be without it.
                    std::sort(found.begin(), found.end());
                    movers[k].at(x, y) =
                        std::max(0.0f, found[(found.size() - 1) / 2] - kMoverDifference);
                }
        });
        drawOnce(moversIn(movers));
    }

    /// Pictures in groups: those of one group have no cells next to each other, so that they may
    /// take cells at the same time and nobody sees in which order.
    [[nodiscard]] std::vector<std::vector<std::size_t>> groups() const {
        std::vector<std::vector<std::size_t>> out;
        for (std::size_t k = 0; k < prints_.size(); ++k) {
            const auto free = std::find_if(out.begin(), out.end(), [&](const auto& group) {
                return std::none_of(group.begin(), group.end(),
                                    [&](std::size_t other) { return near(k, other); });
            });
            if (free == out.end())
                out.push_back({k});
            else
                free->push_back(k);
        }
        return out;
    }

    /// Whether cells of two pictures' boxes are the same or next to each other.
    [[nodiscard]] bool near(std::size_t a, std::size_t b) const {
        const GridBox &boxA = prints_[a].box, &boxB = prints_[b].box;
        if (boxA.y > boxB.y + boxB.height || boxB.y > boxA.y + boxA.height) return false;
        // How far to the right of one the other begins.
        const int right = ((boxB.x - boxA.x) % width_ + width_) % width_;
        return right <= boxA.width || width_ - right <= boxB.width;
    }

    /// Lets one picture take cells from others where that makes the whole better; true when it
    /// took some.
    bool expand(std::size_t k) {
        const Footprint& f = prints_[k];
        const auto own = static_cast<int>(k);
        Image<int> nodeOf(f.box.width, f.box.height, -1);
        // How far each cell is from what is shown there now.
        Image<float> change(f.box.width, f.box.height, kEndOfPicture);
        std::vector<glm::ivec2> cells;
        for (int y = 0; y < f.box.height; ++y)
            for (int x = 0; x < f.box.width; ++x) {
                const glm::ivec2 p = wrapped({f.box.x + x, f.box.y + y});
                const int old = labels_.at(p.x, p.y);
                if (old >= 0 && old != own) change.at(x, y) = difference(own, old, p);
                if (!f.whole.at(x, y) || old == own) continue;
                nodeOf.at(x, y) = static_cast<int>(cells.size());
                cells.emplace_back(x, y);
            }
        MaxFlow flow(static_cast<int>(cells.size()));
        // Cells on the sink's side of the cut are taken by the picture; they pay for their edge
        // from the source.
        for (std::size_t i = 0; i < cells.size(); ++i) {
            const auto n = static_cast<int>(i);
            const glm::ivec2 cell = cells[i];
            const glm::ivec2 p = wrapped({f.box.x + cell.x, f.box.y + cell.y});
            const int old = labels_.at(p.x, p.y);
            flow.addTerminal(n, cost_[k].at(cell.x, cell.y), dataCost(old, p));
            for (const glm::ivec2 d :
                 {glm::ivec2(1, 0), glm::ivec2(0, 1), glm::ivec2(-1, 0), glm::ivec2(0, -1)}) {
                if (p.y + d.y < 0 || p.y + d.y >= height_) continue;
                const glm::ivec2 q = wrapped(p + d);
                const int other = labels_.at(q.x, q.y);
                if (other < 0) continue;
                const glm::ivec2 c = neighbour(f.box, cell + d);
                const int m = c.x >= 0 ? nodeOf.at(c.x, c.y) : -1;
                const float atP = change.at(cell.x, cell.y);
                const float atQ = c.x >= 0 ? change.at(c.x, c.y) : kEndOfPicture;
                // What the seam between both costs when neither is taken, and when only p is.
                const float both = seamCost(old, other, p, q);
                const float theirs =
                    other == own
                        ? 0
                        : kSeamLength + (other == old ? atP : difference(own, other, p)) + atQ;
                if (m < 0) {
                    flow.addTerminal(n, theirs, both);
                    continue;
                }
                if (d.x < 0 || d.y < 0) continue;  // each two once
                // When only q is taken.
                const float mine =
                    old < 0 ? kEndOfPicture
                            : kSeamLength + atP + (other == old ? atQ : difference(old, own, q));
                flow.addTerminal(n, theirs - both, 0);
                flow.addTerminal(m, -theirs, 0);
                if (const float capacity = mine + theirs - both; capacity > 0)
                    flow.addEdge(n, m, capacity);
            }
        }
        const std::vector<bool> taken = flow.sinkSide();
        bool changed = false;
        for (std::size_t i = 0; i < cells.size(); ++i) {
            if (!taken[i]) continue;
            const glm::ivec2 p = wrapped({f.box.x + cells[i].x, f.box.y + cells[i].y});
            changed = changed || labels_.at(p.x, p.y) != own;
            labels_.at(p.x, p.y) = own;
        }
        return changed;
    }

    /// Cells beside what is seen show what is shown there.
    void extend() {
        for (int pass = 0; pass < kExtended; ++pass) {
            const Image<int> before = labels_;
            for (int y = 0; y < height_; ++y)
                for (int x = 0; x < width_; ++x) {
                    if (before.at(x, y) >= 0) continue;
                    for (const glm::ivec2 d :
                         {glm::ivec2(1, 0), glm::ivec2(-1, 0), glm::ivec2(0, 1), glm::ivec2(0, -1),
                          glm::ivec2(1, 1), glm::ivec2(-1, 1), glm::ivec2(1, -1),
                          glm::ivec2(-1, -1)}) {
                        if (y + d.y < 0 || y + d.y >= height_) continue;
                        const glm::ivec2 q = wrapped({x + d.x, y + d.y});
                        if (before.at(q.x, q.y) < 0) continue;
                        labels_.at(x, y) = before.at(q.x, q.y);
                        break;
                    }
                }
        }
    }

  private:
    /// Of columns that are at most a whole turn away.
    [[nodiscard]] glm::ivec2 wrapped(glm::ivec2 p) const {
        return {p.x < 0 ? p.x + width_ : p.x >= width_ ? p.x - width_ : p.x, p.y};
    }
    /// A cell beside one of a box's; x is -1 outside of it.
    [[nodiscard]] glm::ivec2 neighbour(const GridBox& box, glm::ivec2 c) const {
        if (box.width >= width_) c.x = wrapped(c).x;
        if (c.x < 0 || c.x >= box.width || c.y < 0 || c.y >= box.height) return {-1, -1};
        return c;
    }
    /// The cell of a picture's box; x is -1 outside of it.
    [[nodiscard]] glm::ivec2 cellOf(std::size_t k, glm::ivec2 p) const {
        const Footprint& f = prints_[k];
        const int y = p.y - f.box.y;
        if (y < 0 || y >= f.box.height) return {-1, -1};
        return {f.column(p.x, width_), y};
    }
    /// Connected cells, the strongest first.
    [[nodiscard]] std::vector<Mover> moversIn(const std::vector<Image<float>>& costs) const {
        std::vector<Mover> movers;
        for (std::size_t k = 0; k < costs.size(); ++k) {
            Image<float> left = costs[k];
            for (int y = 0; y < left.height(); ++y)
                for (int x = 0; x < left.width(); ++x) {
                    if (left.at(x, y) <= 0) continue;
                    Mover mover;
                    mover.picture = k;
                    float inside = 0;
                    std::vector<glm::ivec2> open = {{x, y}};
                    while (!open.empty()) {
                        const glm::ivec2 c = open.back();
                        open.pop_back();
                        const float cost = left.at(c.x, c.y);
                        if (cost <= 0) continue;
                        left.at(c.x, c.y) = 0;
                        mover.cells.push_back(c);
                        mover.strength += cost;
                        inside += cost * prints_[k].inside.at(c.x, c.y);
                        for (int dy = -kSameMover; dy <= kSameMover; ++dy)
                            for (int dx = -kSameMover; dx <= kSameMover; ++dx)
                                if (left.contains(c.x + dx, c.y + dy) &&
                                    left.at(c.x + dx, c.y + dy) > 0)
                                    open.emplace_back(c.x + dx, c.y + dy);
                    }
                    mover.strength *=
                        std::min(1.0f, kCutOff + kWholeByInside * inside / mover.strength);
                    movers.push_back(std::move(mover));
                }
        }
        std::stable_sort(movers.begin(), movers.end(),
                         [](const Mover& a, const Mover& b) { return a.strength > b.strength; });
        return movers;
    }
    /// Keeps the movers of one picture, the one whose movers are strongest, and drops those of all
    /// others: at one moment nobody is in two places, and colours cannot tell whether two movers
    /// are one person. Where the kept movers are, all other pictures cost more; where the others
    /// are, their own picture does.
    void drawOnce(const std::vector<Mover>& movers) {
        std::vector<float> strengths(prints_.size(), 0.0f);
        for (const Mover& mover : movers)
            if (mover.strength >= kWeakMover) strengths[mover.picture] += mover.strength;
        const auto strongest = static_cast<std::size_t>(
            std::max_element(strengths.begin(), strengths.end()) - strengths.begin());
        for (const Mover& mover : movers) {
            const bool keep = mover.picture == strongest && mover.strength >= kWeakMover;
            const float cost =
                mover.strength / static_cast<float>(mover.cells.size()) + kMoverDifference;
            const Footprint& f = prints_[mover.picture];
            Image<std::uint8_t> around(f.box.width, f.box.height, 0);
            for (const glm::ivec2 c : mover.cells)
                for (int dy = -kMoverMargin; dy <= kMoverMargin; ++dy)
                    for (int dx = -kMoverMargin; dx <= kMoverMargin; ++dx)
                        if (around.contains(c.x + dx, c.y + dy)) around.at(c.x + dx, c.y + dy) = 1;
            for (int y = 0; y < around.height(); ++y)
                for (int x = 0; x < around.width(); ++x) {
                    if (!around.at(x, y)) continue;
                    if (!keep) {
                        cost_[mover.picture].at(x, y) += cost;
                        continue;
                    }
                    const glm::ivec2 p = wrapped({f.box.x + x, f.box.y + y});
                    for (std::size_t other = 0; other < prints_.size(); ++other) {
                        const glm::ivec2 c = cellOf(other, p);
                        if (other != mover.picture && c.x >= 0) cost_[other].at(c.x, c.y) += cost;
                    }
                }
        }
    }
    [[nodiscard]] bool sees(std::size_t k, glm::ivec2 p) const {
        const glm::ivec2 c = cellOf(k, p);
        return c.x >= 0 && prints_[k].inside.at(c.x, c.y) > 0;
    }
    /// The least difference between a cell's colour in one picture and the colours that another
    /// picture shows around that cell. The search stops at the first one below `enough`.
    [[nodiscard]] float newIn(std::size_t k, std::size_t other, glm::ivec2 p, float enough) const {
        const glm::ivec2 own = cellOf(k, p), there = cellOf(other, p);
        const Footprint& f = prints_[other];
        const glm::vec3 colour = coded_[k].at(own.x, own.y);
        float least = kUnlike;
        const auto look = [&](glm::ivec2 c) {
            if (f.inside.at(c.x, c.y) <= 0) return;
            const glm::vec3 d = colour - coded_[other].at(c.x, c.y);
            least = std::min(least, glm::dot(d, d));
        };
        // The cell itself is looked at first: mostly it is the one that is alike.
        look(there);
        const int top = std::max(0, there.y - kMoverReach);
        const int bottom = std::min(f.box.height - 1, there.y + kMoverReach);
        const int left = std::max(0, there.x - kMoverReach);
        const int right = std::min(f.box.width - 1, there.x + kMoverReach);
        for (int y = top; y <= bottom && least > enough * enough; ++y)
            for (int x = left; x <= right; ++x) look({x, y});
        return std::sqrt(least);
    }
    [[nodiscard]] float dataCost(int label, glm::ivec2 p) const {
        if (label < 0) return kNotFilled;
        const glm::ivec2 c = cellOf(static_cast<std::size_t>(label), p);
        const auto k = static_cast<std::size_t>(label);
        // Cells that a picture fills in part are shown only where no picture fills them.
        if (c.x < 0 || !prints_[k].whole.at(c.x, c.y)) return kNotFilled;
        return cost_[k].at(c.x, c.y);
    }
    [[nodiscard]] float seamCost(int a, int b, glm::ivec2 p, glm::ivec2 q) const {
        if (a == b) return 0;
        if (a < 0 || b < 0) return kEndOfPicture;
        return kSeamLength + difference(a, b, p) + difference(a, b, q);
    }
    [[nodiscard]] float difference(int a, int b, glm::ivec2 p) const {
        const auto ka = static_cast<std::size_t>(a), kb = static_cast<std::size_t>(b);
        const glm::ivec2 ca = cellOf(ka, p), cb = cellOf(kb, p);
        if (ca.x < 0 || cb.x < 0 || prints_[ka].inside.at(ca.x, ca.y) <= 0 ||
            prints_[kb].inside.at(cb.x, cb.y) <= 0)
            return kEndOfPicture;
        return glm::distance(coded_[ka].at(ca.x, ca.y), coded_[kb].at(cb.x, cb.y));
    }
    /// Each cell shows the picture whose middle it is nearest to.
    void startWithMiddles() {
        // Cells that a picture fills wholly are shown before all that it fills in part (0..1).
        constexpr float kWholeFirst = 10;
        Image<float> best(width_, height_, 0.0f);
        for (std::size_t k = 0; k < prints_.size(); ++k) {
            const Footprint& f = prints_[k];
            for (int y = 0; y < f.box.height; ++y)
                for (int x = 0; x < f.box.width; ++x) {
                    float inside = f.inside.at(x, y);
                    if (inside <= 0) continue;
                    if (f.whole.at(x, y)) inside += kWholeFirst;
                    const glm::ivec2 p = wrapped({f.box.x + x, f.box.y + y});
                    if (inside <= best.at(p.x, p.y)) continue;
                    best.at(p.x, p.y) = inside;
                    labels_.at(p.x, p.y) = static_cast<int>(k);
                }
        }
    }

    const std::vector<Footprint>& prints_;
    int width_, height_;
    std::vector<Image<glm::vec3>> coded_;  ///< 0..255, with gains
    std::vector<Image<float>> cost_;       ///< of showing a picture's cell
    Image<int> labels_;
};

}  // namespace

Result<Image<int>> findSeams(const std::vector<Footprint>& prints,
                             const std::vector<glm::dvec3>& gains, int gridWidth, bool hideSeams,
                             Job& job) {
    SeamGrid grid(prints, gains, gridWidth);
    if (hideSeams) {
        grid.avoidMovers();
        const auto groups = grid.groups();
        // A picture is tried again only after a cell in or beside its box has changed: before that
        // it would take nothing.
        std::vector<std::uint8_t> open(prints.size(), 1), changed(prints.size(), 0);
        std::atomic<std::int64_t> done = 0;
        const auto total = static_cast<std::int64_t>(prints.size()) * kRounds;
        for (int round = 0; round < kRounds; ++round)
            for (const auto& group : groups) {
                parallelFor(0, group.size(), [&](std::size_t i) {
                    const std::size_t k = group[i];
                    changed[k] = !job.cancelled && open[k] && grid.expand(k);
                    job.progress(++done, total, "finding seams");
                });
                STX_CHECK(job.checkCancelled());
                for (const std::size_t k : group) open[k] = 0;
                for (const std::size_t k : group)
                    for (std::size_t other = 0; other < prints.size() && changed[k]; ++other)
                        if (other != k && grid.near(k, other)) open[other] = 1;
            }
    }
    grid.extend();
    return std::move(grid.labels());
}

}  // namespace stx::panorama
