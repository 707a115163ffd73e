#include "lib/packing/rectangles.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/packing/skyline.hpp"

namespace stx {
namespace {

constexpr int kLargest = 65535;

/// Look-ups of a rectangle in a gap that the whole search may cost.
constexpr std::int64_t kWork = 12'000'000;

/// One way to fill a page, and what it led to.
struct Attempt {
    int width = 0;
    std::vector<int> order;
    GapRule rule = GapRule::firstFit;
    bool turn = false;
    int height = 0;  ///< 0 = not all rectangles found a place

    [[nodiscard]] std::int64_t area() const {
        return height > 0 ? static_cast<std::int64_t>(width) * height
                          : std::numeric_limits<std::int64_t>::max();
    }
    /// The area, and a little more for pages longer than 3:2, which hardly anyone wants.
    [[nodiscard]] double cost() const {
        const double aspect =
            static_cast<double>(std::max(width, height)) / std::min(width, height);
        return static_cast<double>(area()) * (1 + 0.02 * std::max(0.0, aspect - 1.5));
    }
    /// Smaller first, then the squarer one.
    [[nodiscard]] bool betterThan(const Attempt& o) const {
        if (height == 0 || o.height == 0) return height > o.height;
        if (cost() != o.cost()) return cost() < o.cost();
        return std::max(width, height) < std::max(o.width, o.height);
    }
};

struct Problem {
    std::vector<RectangleGroup> groups;
    std::vector<int> counts;
    std::int64_t area = 0;
    std::int64_t rectangles = 0;
    glm::ivec2 most{0};  ///< largest page
    int width = 0;       ///< of the page; 0: what gives the smallest
    int height = 0;      ///< of the page, where its width is given

    /// Nothing better is looked for.
    [[nodiscard]] bool done(const Attempt& attempt) const {
        return width > 0 ? attempt.height > 0 && attempt.height <= height : attempt.area() <= area;
    }
    /// Look-ups of one run, about.
    [[nodiscard]] std::int64_t cost() const {
        const auto g = static_cast<std::int64_t>(groups.size());
        return 40 * rectangles + (rectangles * g) / 2;
    }
};

Problem groupSizes(const std::vector<glm::ivec2>& sizes, glm::ivec2 most) {
    std::map<std::pair<int, int>, std::vector<int>> bySize;
    Problem p;
    p.most = most;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        bySize[{sizes[i].x, sizes[i].y}].push_back(static_cast<int>(i));
        p.area += static_cast<std::int64_t>(sizes[i].x) * sizes[i].y;
        ++p.rectangles;
    }
    for (auto& [size, members] : bySize) {
        p.counts.push_back(static_cast<int>(members.size()));
        p.groups.push_back({size.first, size.second, std::move(members)});
    }
    return p;
}

/// Tries an attempt on one page; gives up above the height that would make it worse than `best`.
void run(const Problem& problem, Skyline& skyline, std::vector<int>& left, std::int64_t best,
         Attempt& attempt) {
    left = problem.counts;
    const std::int64_t most = std::min<std::int64_t>(problem.most.y, best / attempt.width);
    const int height = skyline.fill(attempt.width, problem.most.y, attempt.order, attempt.rule,
                                    attempt.turn, static_cast<int>(most), left, nullptr);
    const bool all = std::all_of(left.begin(), left.end(), [](int n) { return n == 0; });
    attempt.height = all && height <= most ? height : 0;
}

std::vector<std::vector<int>> sortOrders(const std::vector<RectangleGroup>& groups) {
    const auto sortedBy = [&](auto key) {
        std::vector<int> order(groups.size());
        std::iota(order.begin(), order.end(), 0);
        std::stable_sort(order.begin(), order.end(),
                         [&](int a, int b) { return key(groups[a]) > key(groups[b]); });
        return order;
    };
    return {sortedBy([](const RectangleGroup& g) {
                return static_cast<std::int64_t>(g.width) * g.height;
            }),
            sortedBy([](const RectangleGroup& g) { return std::pair(g.height, g.width); }),
            sortedBy([](const RectangleGroup& g) { return std::pair(g.width, g.height); }),
            sortedBy([](const RectangleGroup& g) {
                return std::pair(std::max(g.width, g.height), std::min(g.width, g.height));
            }),
            sortedBy([](const RectangleGroup& g) { return g.width + g.height; })};
}

/// Page widths worth trying: around the square, and whole multiples of frequent sizes.
std::vector<int> pageWidths(const Problem& problem, bool turn, int steps) {
    if (problem.width > 0) return {problem.width};
    int least = 1;
    std::vector<std::pair<int, int>> frequent;  // count, size
    for (std::size_t i = 0; i < problem.groups.size(); ++i) {
        const auto& g = problem.groups[i];
        least = std::max(least, turn ? std::min(g.width, g.height) : g.width);
        frequent.emplace_back(problem.counts[i], g.width);
        if (turn) frequent.emplace_back(problem.counts[i], g.height);
    }
    const auto needed = static_cast<int>((problem.area + problem.most.y - 1) / problem.most.y);
    least = std::max(least, needed);
    if (least > problem.most.x) return {};
    const double square = std::sqrt(static_cast<double>(problem.area) * 1.04);
    std::vector<int> widths;
    const auto add = [&](double w) {
        widths.push_back(std::clamp(static_cast<int>(std::min(w, 70000.0)), least, problem.most.x));
    };
    add(square);
    for (int i = 0; i < steps; ++i) add(square * (0.76 + 0.56 * (i + 0.5) / steps));
    std::sort(frequent.rbegin(), frequent.rend());
    for (std::size_t i = 0; i < std::min<std::size_t>(frequent.size(), 4); ++i) {
        if (frequent[i].first < 2) break;
        const int size = frequent[i].second;
        const int whole = std::max(1, static_cast<int>(square / size));
        for (int k = std::max(1, whole - 1); k <= whole + 2; ++k)
            add(static_cast<double>(size) * k);
        // Few of a size: a row or a column of all of them may be the tightest.
        add(static_cast<double>(size) * frequent[i].first);
        for (int k = 1; k <= std::min(frequent[i].first, 16); ++k) {
            const double across = static_cast<double>(size) * k;
            if (across > square * 0.4 && across < square * 2.5) add(across);
        }
    }
    add(problem.most.x);
    std::sort(widths.begin(), widths.end());
    widths.erase(std::unique(widths.begin(), widths.end()), widths.end());
    return widths;
}

/// All widths, orders and rules once; the best few, best first.
std::vector<Attempt> explore(const Problem& problem, bool turn, std::int64_t work) {
    const auto orders = sortOrders(problem.groups);
    constexpr GapRule kRules[] = {GapRule::firstFit, GapRule::avoidWaste, GapRule::widest};
    const std::int64_t runs =
        std::max<std::int64_t>(work / std::max<std::int64_t>(problem.cost(), 1), 3);
    const int steps = static_cast<int>(std::clamp<std::int64_t>(runs / 11, 1, 40));
    std::vector<Attempt> attempts;
    for (const int width : pageWidths(problem, turn, steps)) {
        for (const auto& order : orders) {
            for (const auto rule : kRules) {
                if (rule == GapRule::widest && &order != &orders[0]) continue;
                Attempt a;
                a.width = width;
                a.order = order;
                a.rule = rule;
                a.turn = turn;
                attempts.push_back(std::move(a));
            }
        }
    }
    // Over the budget (thousands of unlike rectangles) only every n-th is tried.
    const auto every = static_cast<std::int64_t>(attempts.size()) / (2 * runs) + 1;
    std::vector<Attempt> tried;
    for (std::size_t i = 0; i < attempts.size(); i += static_cast<std::size_t>(every))
        tried.push_back(std::move(attempts[i]));
    parallelForBlocks(0, tried.size(), 16, [&](auto from, auto to) {
        Skyline skyline(problem.groups);
        std::vector<int> left;
        for (auto i = from; i < to; ++i)
            run(problem, skyline, left, std::numeric_limits<std::int64_t>::max(), tried[i]);
    });
    std::stable_sort(tried.begin(), tried.end(),
                     [](const Attempt& a, const Attempt& b) { return a.betterThan(b); });
    if (tried.size() > 8) tried.resize(8);
    while (!tried.empty() && tried.back().height == 0) tried.pop_back();
    return tried;
}

/// Exchanges places in the order and moves the width a little, as long as nothing gets worse.
void improve(const Problem& problem, std::int64_t work, std::uint64_t seed, Attempt& best) {
    Skyline skyline(problem.groups);
    std::vector<int> left;
    const auto random = [&seed](std::uint64_t below) {
        seed += 0x9e3779b97f4a7c15ull;
        std::uint64_t z = seed;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return (z ^ (z >> 31)) % below;
    };
    const std::int64_t rounds = work / std::max<std::int64_t>(problem.cost(), 1);
    const std::size_t groups = problem.groups.size();
    Attempt next;
    for (std::int64_t i = 0; i < rounds; ++i) {
        next = best;
        if (groups > 1) {
            const std::size_t a = random(groups), b = random(groups);
            if (random(2)) {
                std::swap(next.order[a], next.order[b]);
            } else {
                const int moved = next.order[a];
                next.order.erase(next.order.begin() + static_cast<std::ptrdiff_t>(a));
                next.order.insert(next.order.begin() + static_cast<std::ptrdiff_t>(b), moved);
            }
        }
        if (next.rule == GapRule::widest) next.rule = GapRule::avoidWaste;
        if (problem.done(best)) return;
        if (problem.width == 0 && random(2)) {
            const int span = std::max(best.width / 24, 2);
            const int moved = best.width + static_cast<int>(random(2 * span + 1)) - span;
            next.width = std::clamp(moved, 1, problem.most.x);
        }
        run(problem, skyline, left, best.area(), next);
        if (next.height > 0 && !best.betterThan(next)) std::swap(best, next);
    }
}

/// The best single page, or none.
std::optional<Attempt> bestPage(const Problem& problem, bool turn, std::int64_t work) {
    auto starts = explore(problem, turn, work / 2);
    if (starts.empty()) return std::nullopt;
    if (!problem.done(starts[0])) {
        if (starts.size() > 4) starts.resize(4);
        const auto share = work / 2 / static_cast<std::int64_t>(starts.size());
        parallelFor(0, starts.size(), [&](std::int64_t i) {
            improve(problem, share, 0x51ed2701u + static_cast<std::uint64_t>(i), starts[i]);
        });
    }
    return *std::min_element(starts.begin(), starts.end(),
                             [](const Attempt& a, const Attempt& b) { return a.betterThan(b); });
}

/// Fills up to `pages` pages of width x height; empty when something is left over.
std::vector<std::vector<SkylinePlace>> fillPages(const Problem& problem, int width, int height,
                                                 int pages, GapRule rule, bool turn,
                                                 const std::vector<int>& order) {
    Skyline skyline(problem.groups);
    std::vector<int> left = problem.counts;
    std::vector<std::vector<SkylinePlace>> places(pages);
    for (auto& page : places)
        skyline.fill(width, height, order, rule, turn, std::numeric_limits<int>::max(), left,
                     &page);
    if (std::any_of(left.begin(), left.end(), [](int n) { return n > 0; })) return {};
    return places;
}

RectanglePacking toPacking(const Problem& problem, int width, int height,
                           const std::vector<std::vector<SkylinePlace>>& pages) {
    RectanglePacking packing;
    packing.width = width;
    packing.height = height;
    packing.pages = static_cast<int>(pages.size());
    packing.places.resize(problem.rectangles);
    std::vector<std::size_t> taken(problem.groups.size(), 0);
    for (std::size_t page = 0; page < pages.size(); ++page) {
        for (const auto& p : pages[page])
            packing.places[problem.groups[p.group].members[taken[p.group]++]] = {
                static_cast<int>(page), p.x, p.y, p.turned};
    }
    return packing;
}

/// Several pages of one size, the smallest square, as far as the limit allows one, that holds all.
std::optional<RectanglePacking> severalPages(const Problem& problem, int pages, bool turn) {
    const auto orders = sortOrders(problem.groups);
    const auto attempt = [&](int size) -> std::optional<RectanglePacking> {
        const glm::ivec2 page = glm::min(glm::ivec2(size), problem.most);
        for (const auto rule : {GapRule::avoidWaste, GapRule::widest, GapRule::firstFit}) {
            for (const auto& order : orders) {
                const auto filled = fillPages(problem, page.x, page.y, pages, rule, turn, order);
                if (!filled.empty()) return toPacking(problem, page.x, page.y, filled);
                if (problem.cost() > kWork / 8) break;
            }
        }
        return std::nullopt;
    };
    int holds = std::max(problem.most.x, problem.most.y);
    auto best = attempt(holds);
    if (!best) return best;
    int fails = static_cast<int>(std::sqrt(static_cast<double>(problem.area) / pages)) - 1;
    while (holds - fails > std::max(1, holds / 128)) {
        const int middle = fails + (holds - fails) / 2;
        if (auto found = attempt(middle)) {
            best = std::move(found);
            holds = middle;
        } else {
            fails = middle;
        }
    }
    return best;
}

/// Pages of exactly this size, at most `most` of them.
std::optional<RectanglePacking> pagesOf(const Problem& problem, glm::ivec2 size, int most,
                                        bool tryTurns) {
    const auto pageArea = static_cast<std::int64_t>(size.x) * size.y;
    // How the search for a page of this width goes on: a lower one is better, above the height,
    // too.
    Problem fixed = problem;
    fixed.width = size.x;
    fixed.height = size.y;
    fixed.most = glm::ivec2(kLargest);
    for (int pages = 1; pages <= most; ++pages) {
        if (problem.area > pages * pageArea) continue;
        for (const bool turn : {false, true}) {
            if (turn && !tryTurns) continue;
            if (pages == 1) {
                const auto best = bestPage(fixed, turn, kWork / 4);
                if (!best || !fixed.done(*best)) continue;
                return toPacking(
                    problem, size.x, size.y,
                    fillPages(problem, size.x, kLargest, 1, best->rule, turn, best->order));
            }
            for (const auto rule : {GapRule::avoidWaste, GapRule::widest, GapRule::firstFit}) {
                for (const auto& order : sortOrders(problem.groups)) {
                    const auto filled =
                        fillPages(problem, size.x, size.y, pages, rule, turn, order);
                    if (!filled.empty()) return toPacking(problem, size.x, size.y, filled);
                }
            }
        }
    }
    return std::nullopt;
}

/// The smallest pages whose sides are powers of two, none four times the other.
std::optional<RectanglePacking> powerOfTwoPages(const Problem& problem, int maxPages,
                                                bool tryTurns) {
    for (int pages = 1; pages <= maxPages; ++pages) {
        for (std::int64_t area = 1; area <= std::int64_t{kLargest} * kLargest; area *= 2) {
            if (area * pages < problem.area) continue;
            std::int64_t width = 1;
            while (width * width < area) width *= 2;
            const std::int64_t height = area / width;
            for (const glm::ivec2 size : {glm::ivec2(width, height), glm::ivec2(height, width)}) {
                if (size.x > problem.most.x || size.y > problem.most.y) continue;
                if (auto found = pagesOf(problem, size, pages, tryTurns)) return found;
                if (size.x == size.y) break;
            }
        }
    }
    return std::nullopt;
}

/// "1300x1290 would do", of what was refused; empty where nothing does.
std::string whatWouldDo(const std::vector<glm::ivec2>& sizes, RectangleLimits limits) {
    if (limits.size.x == 0 && limits.maxPage.x == 0 && limits.maxSize == kLargest) return {};
    limits.size = {0, 0};
    limits.maxSize = kLargest;
    limits.maxPage = {0, 0};
    const auto free = packRectangles(sizes, limits);
    if (!free) return {};
    return fmt::format("; {}{}x{} would do", free->pages > 1 ? "two of " : "", free->width,
                       free->height);
}

}  // namespace

Result<RectanglePacking> packRectangles(const std::vector<glm::ivec2>& sizes,
                                        const RectangleLimits& limits) {
    const bool exact = limits.size.x > 0;
    const bool narrowed = limits.maxPage != glm::ivec2(0);
    if (limits.maxSize < 1 || limits.maxSize > kLargest || limits.maxPages < 1 ||
        std::max(limits.size.x, limits.size.y) > limits.maxSize ||
        (narrowed && std::min(limits.maxPage.x, limits.maxPage.y) < 1))
        return fail(ErrorCode::usage, "pages of {} pixels, {} of them, cannot be packed",
                    limits.maxSize, limits.maxPages);
    const glm::ivec2 largest = narrowed ? glm::min(limits.maxPage, glm::ivec2(limits.maxSize))
                                        : glm::ivec2(limits.maxSize);
    const glm::ivec2 most = exact ? limits.size : largest;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        if (sizes[i].x < 1 || sizes[i].y < 1)
            return fail(ErrorCode::invalidInput, "rectangle {} is {}x{}", i, sizes[i].x,
                        sizes[i].y);
        const auto fits = [&](int w, int h) { return w <= most.x && h <= most.y; };
        if (!fits(sizes[i].x, sizes[i].y) && !(limits.mayTurn && fits(sizes[i].y, sizes[i].x)))
            return fail(ErrorCode::invalidInput,
                        "a rectangle of {}x{} (padding included) is larger than a texture of "
                        "{}x{}{}",
                        sizes[i].x, sizes[i].y, most.x, most.y, whatWouldDo(sizes, limits));
    }
    if (sizes.empty()) return RectanglePacking{limits.size.x, limits.size.y, 1, {}};
    const Problem problem = groupSizes(sizes, largest);

    const bool square =
        std::all_of(sizes.begin(), sizes.end(), [](glm::ivec2 s) { return s.x == s.y; });
    const bool tryTurns = limits.mayTurn && !square;
    const auto refused = [&] {
        return fail(ErrorCode::invalidInput,
                    "{} rectangles with {} pixels do not fit on {} of {}{}x{}{}",
                    problem.rectangles, problem.area,
                    limits.maxPages > 1 ? fmt::format("{} textures", limits.maxPages) : "a texture",
                    exact ? "" : "at most ", most.x, most.y, whatWouldDo(sizes, limits));
    };
    if (exact || limits.powerOfTwo) {
        auto packing = exact ? pagesOf(problem, limits.size, limits.maxPages, tryTurns)
                             : powerOfTwoPages(problem, limits.maxPages, tryTurns);
        if (packing) return *packing;
        return refused();
    }
    auto best = bestPage(problem, false, tryTurns ? kWork / 2 : kWork);
    if (tryTurns && (!best || best->area() > problem.area)) {
        const auto turned = bestPage(problem, true, kWork / 2);
        if (turned && (!best || turned->area() < best->area() - best->area() / 200)) best = turned;
    }
    if (best) {
        const auto pages =
            fillPages(problem, best->width, problem.most.y, 1, best->rule, best->turn, best->order);
        return toPacking(problem, best->width, best->height, pages);
    }
    for (int pages = 2; pages <= limits.maxPages; ++pages) {
        if (problem.area > static_cast<std::int64_t>(pages) * largest.x * largest.y) continue;
        for (const bool turn : {false, true}) {
            if (turn && !tryTurns) continue;
            if (auto packing = severalPages(problem, pages, turn)) return *packing;
        }
    }
    return refused();
}

}  // namespace stx
