#include <algorithm>
#include <atomic>
#include <cmath>

#include "lib/base/counted.hpp"
#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/panorama/order.hpp"
#include "lib/panorama/panorama.hpp"
#include "lib/panorama/patches.hpp"
#include "lib/panorama/work_copies.hpp"

namespace stx {

using namespace panorama;

namespace {

/// Pictures of a panorama at most: every two are compared, which takes time by their square.
constexpr int kMostPictures = 500;
/// Features of a picture: one for so many pixels of its copy, at least and at most.
constexpr std::size_t kPixelsOfFeature = 350, kFewestFeatures = 450, kMostFeatures = 900;
/// A pair whose matches differ by more than this once all is adjusted is a mistake, work pixels.
constexpr double kWrongPairPixels = 8;
/// Focal length of most cameras, halves of the diagonal: 29 mm for 36x24 mm.
constexpr double kUsualFocal = 1.35;
/// How well a focal length is known beforehand, standard deviation of its logarithm: one that a
/// picture's EXIF tells, and the usual one.
constexpr double kHintSpread = 0.04, kUsualSpread = 0.35;
/// Pairs that turn out to be mistakes are dropped and the order is found anew, at most so often.
constexpr int kMostRounds = 6;
/// Matches that a pair of pictures must have to count for anything.
constexpr std::size_t kFewestMatches = 4;
/// Pairs with fewer matches of patches take those of features, too.
constexpr std::size_t kFewPatches = 10;
/// Differences beyond which matches count less (Huber), work pixels, one adjustment for each: from
/// what a first order may be off by down to what a match may be.
constexpr double kCoarseToFine[] = {60, 15, 4, 2};
/// The lens is taken for one without distortion while differences above this count in full, work
/// pixels.
constexpr double kDistortionBelow = 20;
/// How far patches may move, work pixels: after features, and once more after the first patches.
constexpr double kPatchReaches[] = {8, 3};
constexpr double kAfterPatches[] = {4, 1};  ///< as kCoarseToFine
/// Matches farther off are dropped, work pixels, one adjustment after each: what is left is as good
/// as patches are aligned.
constexpr double kFits[] = {3, 2, 1.3, 0.75};
constexpr double kFitHuber = 0.5;  ///< in these adjustments, as kCoarseToFine
/// Parallax below this is not noted: pixels, and a share of the diagonal.
constexpr double kLeastParallax = 2, kParallaxShare = 1e-3;

/// Focal lengths that are tried where none is known, halves of the diagonal: fields of view of 110
/// to 21 degrees across it, each so many times the one before.
constexpr double kShortestFocal = 0.7, kLongestFocal = 5.5, kFocalStep = 1.15;
/// Those that are tried around one that EXIF tells, as shares of it: it may be some percent off.
constexpr double kAroundHint[] = {0.93, 1.0, 1.07};
/// Pictures may overlap where at least so many places of a grid (so many along each side) over one,
/// which reaches to 0.95 of its width and height, are seen in the other.
constexpr int kFewestSeen = 3, kGridOfOverlap = 9;
constexpr double kGridReach = 4.2;  ///< steps of the grid from the middle to the border
/// Matches of a pair stay that are off by no more than so many times its median, and in any case by
/// no more than this, work pixels.
constexpr double kFitOfMedian = 2.5, kAlwaysFits = 0.7;
/// What differences are when a pair has no matches: larger than any.
constexpr double kNoMatches = 1e9;
/// Nine tenths of values that are normally distributed in two dimensions are within so many
/// standard deviations.
constexpr double kDeviationsOfMost = 2.15;
/// How far matches may be off on the whole, pixels, at least and at most: what is expected of a
/// lens counts for something always, and never for all.
constexpr double kLeastNoise = 0.01, kMostNoise = 20;
/// Differences beyond which matches count less (Cauchy) where they are brought to what most agree
/// on, work pixels, one adjustment for each.
constexpr double kToMost[] = {2, 1, 0.5};
/// Pairs with fewer matches say nothing of parallax.
constexpr int kFewestOfParallax = 8;
/// Names of pictures that a note lists; it counts the others.
constexpr std::size_t kMostNames = 4;

/// A field of view that is given is another one than that of a closed turn from this share of the
/// focal length on. The tests ask it to be noted from 3 % on; nothing finer was measured.
constexpr double kOtherFocal = 0.01;
/// What a closed turn may be off by with the best focal length, radians; mistakes are more.
constexpr double kClosedGap = 0.02;

/// What is known and found while pictures are aligned.
struct Series {
    std::vector<WorkCopy> copies;
    std::vector<Features> features;
    std::vector<Pyramid> pyramids;
    std::vector<Pair> pairs;
    TurnModel model;
    AdjustSettings adjusting;
};

/// Halves of the diagonal; `hint`: what EXIF tells or was given, 0 = nothing.
std::vector<double> focalsToTry(double hint) {
    std::vector<double> focals;
    for (double f = kShortestFocal; f < kLongestFocal; f *= kFocalStep) focals.push_back(f);
    if (hint > 0)
        for (const double f : kAroundHint) focals.push_back(f * hint);
    return focals;
}

/// Rotations, focal length and distortion of all that belong together, from coarse to fine.
void adjustCoarseToFine(TurnModel& model, const std::vector<Pair>& pairs,
                        AdjustSettings& adjusting) {
    for (const double pixels : kCoarseToFine) {
        adjusting.huberPixels = pixels;
        adjusting.fixDistortion = pixels > kDistortionBelow;
        adjust(model, pairs, adjusting);
    }
}

/// By how much the matches of a pair are off, multiples of `pixel` (halves of the diagonal).
std::vector<double> differencesOf(const Series& s, const Pair& pair, double pixel) {
    std::vector<double> differences;
    for (const Match& m : pair.matches)
        differences.push_back(differenceOf(s.model, pair, m, pixel));
    return differences;
}

double medianDifference(const Series& s, const Pair& pair) {
    return medianOf(differencesOf(s, pair, s.adjusting.pixel), kNoMatches);
}

/// The pair of the same two pictures; the end where there is none.
template <class Pairs>
auto findSame(Pairs& pairs, const Pair& pair) {
    return std::find_if(pairs.begin(), pairs.end(),
                        [&](const Pair& p) { return p.a == pair.a && p.b == pair.b; });
}

/// Drops pairs that do not fit to the others; true when there were some.
bool dropWrongPairs(Series& s) {
    const auto before = s.pairs.size();
    std::erase_if(s.pairs, [&](const Pair& pair) {
        const bool known = s.model.known[pair.a];
        return known && medianDifference(s, pair) > kWrongPairPixels;
    });
    return s.pairs.size() != before;
}

/// Whether two pictures may see the same, by the model.
bool mayOverlap(const Series& s, int a, int b) {
    const auto& copy = s.copies[a];
    const glm::dvec2 other = s.copies[b].extent(), own = copy.extent();
    int seen = 0;
    constexpr int kMiddle = kGridOfOverlap / 2;
    for (int y = 0; y < kGridOfOverlap; ++y)
        for (int x = 0; x < kGridOfOverlap; ++x) {
            const auto p =
                seenBy(s.model, a, b,
                       own * glm::dvec2((x - kMiddle) / kGridReach, (y - kMiddle) / kGridReach));
            seen += p && std::abs(p->x) < other.x && std::abs(p->y) < other.y;
        }
    return seen >= kFewestSeen;
}

/// Matches of patches for all pairs that overlap; those of features where patches say too little.
Result<void> matchPatches(Series& s, const std::vector<Pair>& fromFeatures,
                          const std::vector<std::pair<int, int>>& forbidden, double reach,
                          Job& job) {
    std::vector<Pair> pairs;
    const auto count = static_cast<int>(s.copies.size());
    for (int a = 0; a < count; ++a)
        for (int b = a + 1; b < count; ++b) {
            if (!s.model.known[a] || !s.model.known[b] || !mayOverlap(s, a, b)) continue;
            if (std::find(forbidden.begin(), forbidden.end(), std::pair(a, b)) != forbidden.end())
                continue;
            Pair pair;
            pair.a = a;
            pair.b = b;
            pairs.push_back(std::move(pair));
        }
    std::atomic<std::int64_t> done = 0;
    PatchSettings settings;
    settings.reach = reach;
    parallelFor(0, pairs.size(), [&](std::size_t i) {
        if (job.cancelled) return;
        Pair& pair = pairs[i];
        const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
        pair.matches =
            alignPatches(s.copies, s.pyramids, s.features, s.model, pair.a, pair.b, settings);
        pair.bFromA = glm::inverse(s.model.worldFromCamera[b]) * s.model.worldFromCamera[a];
        job.progress(++done, static_cast<std::int64_t>(pairs.size()), "aligning patches");
    });
    STX_CHECK(job.checkCancelled());
    for (const Pair& old : fromFeatures) {
        const auto it = findSame(pairs, old);
        if (it == pairs.end()) continue;
        if (it->matches.size() < kFewPatches)
            it->matches.insert(it->matches.end(), old.matches.begin(), old.matches.end());
    }
    std::erase_if(pairs, [](const Pair& pair) { return pair.matches.size() < kFewestMatches; });
    s.pairs = std::move(pairs);
    return {};
}

/// Matches far from what all agree on are movers, parallax and mistakes.
void keepWhatFits(Series& s, double most) {
    for (Pair& pair : s.pairs) {
        const double limit =
            std::clamp(kFitOfMedian * medianDifference(s, pair), kAlwaysFits, most);
        std::erase_if(pair.matches, [&](const Match& m) {
            return differenceOf(s.model, pair, m, s.adjusting.pixel) > limit;
        });
    }
    std::erase_if(s.pairs, [](const Pair& pair) { return pair.matches.size() < kFewestMatches; });
}

/// What is left between two pictures is parallax and the lens more than noise, and all matches of a
/// pair are off by that together: they count as so many that are independent.
constexpr double kIndependentMatches = 12;

/// How far matches are off, pixels, as if each were independent of the others.
double noiseOf(const Series& s) {
    double squares = 0, matches = 0;
    for (const Pair& pair : s.pairs) {
        std::vector<double> differences = differencesOf(s, pair, s.adjusting.pixel);
        std::sort(differences.begin(), differences.end());
        const double off = differences[differences.size() * 9 / 10] / kDeviationsOfMost;
        squares += off * off;
        matches += static_cast<double>(differences.size());
    }
    const double pairs = std::max(1.0, static_cast<double>(s.pairs.size()));
    return std::clamp(
        std::sqrt(squares / pairs * std::max(1.0, matches / pairs / kIndependentMatches)),
        kLeastNoise, kMostNoise);
}

/// Half of all matches differ by no more than this, work pixels.
double medianOfAll(const Series& s) {
    std::vector<double> all;
    for (const Pair& pair : s.pairs)
        for (const double d : differencesOf(s, pair, s.adjusting.pixel)) all.push_back(d);
    return medianOf(std::move(all), kNoMatches);
}

/// Where half of the matches or less are right, brings together what agrees.
void adjustToMost(Series& s) {
    s.adjusting.cauchy = true;
    for (const double pixels : kToMost) {
        s.adjusting.huberPixels = pixels;
        adjust(s.model, s.pairs, s.adjusting);
    }
    s.adjusting.cauchy = false;
}

/// Cameras that focus anew have another focal length then: each picture gets its own where that
/// brings matches clearly nearer to each other.
void tryOwnFocals(Series& s) {
    // A share of the median difference before; and where that is less, work pixels, there is
    // nothing to win.
    constexpr double kNearer = 0.8, kNearEnough = 0.1;
    const double before = medianOfAll(s);
    if (before < kNearEnough) return;
    const TurnModel one = s.model;
    s.adjusting.ownFocals = true;
    adjustToMost(s);
    if (medianOfAll(s) <= kNearer * before) return;
    s.adjusting.ownFocals = false;
    s.model = one;
}

/// What pairs have in common, from the matches that fit and those that were found `before`.
void describePairs(const Series& s, const std::vector<Pair>& before, PanoramaAlignment& out) {
    double squares = 0;
    std::size_t all = 0;
    for (const Pair& pair : s.pairs) {
        const double fullPixel =
            0.5 * (s.copies[pair.a].fullHalfDiagonal() + s.copies[pair.b].fullHalfDiagonal());
        const auto differences = [&](const Pair& of) {
            std::vector<double> values = differencesOf(s, of, 1.0);
            for (double& value : values) value *= fullPixel;
            std::sort(values.begin(), values.end());
            return values;
        };
        PanoramaPair p;
        p.a = pair.a;
        p.b = pair.b;
        p.matches = static_cast<int>(pair.matches.size());
        double own = 0;
        for (const double d : differences(pair)) own += d * d;
        p.rms = std::sqrt(own / static_cast<double>(pair.matches.size()));
        squares += own;
        all += pair.matches.size();
        const auto first = findSame(before, pair);
        const auto whole = differences(first == before.end() ? pair : *first);
        p.found = static_cast<int>(whole.size());
        p.parallax = whole[whole.size() * 9 / 10];
        out.pairs.push_back(p);
    }
    out.rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(all, 1)));
}

std::string listOf(const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t i = 0; i < names.size() && i < kMostNames; ++i)
        text += (i == 0 ? "'" : ", '") + names[i] + "'";
    if (names.size() > kMostNames) text += fmt::format(" and {} more", names.size() - kMostNames);
    return text;
}

/// Notes how large the parallax is, where it is more than `pixels`.
void noteParallax(const std::vector<PanoramaPair>& pairs, PictureSource& source, double pixels,
                  bool focalGiven, Job& job) {
    const PanoramaPair* worst = nullptr;
    int some = 0;
    for (const auto& pair : pairs) {
        if (pair.matches < kFewestOfParallax || pair.parallax < pixels) continue;
        ++some;
        if (!worst || pair.parallax > worst->parallax) worst = &pair;
    }
    if (!worst) return;
    job.note(fmt::format(
        "parallax: {} by more than {:.1f} pixels that no rotation explains, '{}' and '{}' by "
        "{:.1f}; the camera moved, {}what it saw did",
        some == 1 ? std::string("1 pair of pictures differs")
                  : fmt::format("{} pairs of pictures differ", some),
        pixels, source.name(worst->a), source.name(worst->b), worst->parallax,
        focalGiven ? "its field of view is another one, or " : "or "));
}

/// Reads the pictures and finds their features. Gives for each the picture that it is equal to, -1
/// = none; such pictures get no features. Errors: what reading gives, all equal, cancelled.
Result<std::vector<int>> readPictures(PictureSource& source, Series& s, Job& job) {
    const int count = source.count();
    STX_TRY(s.copies, readWorkCopies(source, job));
    STX_TRY(auto twins, sameAs(s.copies, job));
    std::vector<std::string> equal;
    for (int k = 0; k < count; ++k)
        if (twins[k] >= 0) equal.push_back(source.name(k));
    if (static_cast<int>(equal.size()) == count - 1)
        return fail(ErrorCode::invalidInput,
                    "all {} pictures are equal; a camera that turned between them is needed",
                    count);
    if (!equal.empty())
        job.note(fmt::format("{} left out, equal to another: {}",
                             counted(equal.size(), "picture is", "pictures are"), listOf(equal)));

    s.features.resize(s.copies.size());
    std::atomic<std::int64_t> done = 0;
    parallelFor(0, count, [&](std::size_t i) {
        if (job.cancelled) return;
        const auto k = i;
        const std::size_t most =
            std::clamp(s.copies[k].grey.count() / kPixelsOfFeature, kFewestFeatures, kMostFeatures);
        if (twins[k] < 0) s.features[k] = findFeatures(s.copies[k], static_cast<int>(most));
        job.progress(++done, count, "looking for features");
    });
    STX_CHECK(job.checkCancelled());
    return twins;
}

/// The focal length that is given or that EXIF tells, halves of the diagonal; 0 = none.
double focalHintOf(PictureSource& source, const PanoramaSettings& settings, const Series& s) {
    if (settings.fieldOfView > 0)
        return s.copies[0].extent().x / std::tan(0.5 * settings.fieldOfView);
    std::vector<double> hints;
    for (int k = 0; k < source.count(); ++k)
        if (const double hint = source.focalHint(k); hint > 0) hints.push_back(hint);
    return medianOf(hints);
}

/// What features say, before patches say it better.
struct Start {
    std::vector<Pair> pairs;
    std::vector<std::pair<int, int>> forbidden;  ///< pairs that go all around, of an open series
    double focal = 1;                            ///< that most matches agree with
};

/// By which angle pairs that close a turn disagree with `model`: the strongest pair, or the mean by
/// matches.
double gapOf(const TurnModel& model, const std::vector<Pair>& pairs,
             const std::vector<int>& closing, bool strongest) {
    double gap = 0, sum = 0, all = 0;
    std::size_t most = 0;
    for (const int p : closing) {
        const Pair& pair = pairs[p];
        const auto& a = model.worldFromCamera[pair.a];
        const auto& b = model.worldFromCamera[pair.b];
        const double off = angleBetween(
            turnOf(pair.matches, model.lensOf(pair.a), model.lensOf(pair.b), pair.bFromA),
            glm::inverse(b) * a);
        const auto weight = static_cast<double>(pair.matches.size());
        sum += weight * off;
        all += weight;
        if (pair.matches.size() <= most) continue;
        most = pair.matches.size();
        gap = off;
    }
    return strongest ? gap : sum / std::max(all, 1.0);
}

/// The focal length with which a turn that is closed fits best to itself, whatever is given: by the
/// matches of features. Nothing where no turn is closed.
std::optional<double> focalOfClosedTurn(const Series& s, const PairSearch& search) {
    const PictureTree tree = treeOf(static_cast<int>(s.copies.size()), search.pairs);
    if (tree.order.size() < 3) return std::nullopt;
    const double start = focalByClosing(tree, search.pairs, search.focal);
    TurnModel model = chain(tree, search.pairs, {start, 0});
    const auto closing = pairsThatClose(tree, search.pairs, model);
    if (closing.empty()) return std::nullopt;
    AdjustSettings adjusting = s.adjusting;
    adjusting.fixFocal = false;
    adjusting.expectedFocal = model.lens.focal;
    adjusting.focalSpread = kUsualSpread;
    adjustCoarseToFine(model, search.pairs, adjusting);
    if (gapOf(model, search.pairs, closing, false) > kClosedGap) return std::nullopt;
    return model.lens.focal;
}

/// Notes when a field of view that was given is not that of a closed turn. It is found from pairs
/// of its own, since few agree with a field of view that is far off. Errors: cancelled.
Result<void> noteOtherFocal(const Series& s, double given, Job& job) {
    STX_TRY(const auto found, searchPairs(s.copies, s.features, focalsToTry(given), job));
    const auto focal = focalOfClosedTurn(s, found);
    if (!focal || std::abs(*focal / given - 1) < kOtherFocal) return {};
    const auto degrees = [&](double f) {
        return glm::degrees(2 * std::atan(s.copies[0].extent().x / f));
    };
    job.note(
        fmt::format("a field of view of {:.1f}° is given, but the pictures close a full turn at "
                    "{:.1f}°; leave --fov out, and that is used",
                    degrees(given), degrees(*focal)));
    return {};
}

/// Finds pairs by features, their order, and a first model; again while pairs turn out to be
/// mistakes. Errors: no two pictures that show the same, cancelled.
Result<Start> startByFeatures(Series& s, const PanoramaSettings& settings, double hint, Job& job) {
    const bool given = settings.fieldOfView > 0;
    const auto count = static_cast<int>(s.copies.size());
    STX_TRY(auto search, searchPairs(s.copies, s.features,
                                     given ? std::vector<double>{hint} : focalsToTry(hint), job));
    if (given && settings.closeLoop) STX_CHECK(noteOtherFocal(s, hint, job));
    s.pairs = std::move(search.pairs);
    s.adjusting.fixFocal = given;
    s.adjusting.expectedFocal = hint > 0 ? hint : kUsualFocal;
    s.adjusting.focalSpread = hint > 0 ? kHintSpread : kUsualSpread;
    Start start;
    start.focal = search.focal;
    double focal = search.focal;
    for (int round = 0; round < kMostRounds; ++round) {
        const PictureTree tree = treeOf(count, s.pairs, settings.closeLoop);
        if (tree.order.size() < 2)
            return fail(ErrorCode::invalidInput,
                        "no two of the {} pictures show the same from one place; neighbours must "
                        "overlap by a quarter or more, and the camera must only turn",
                        count);
        if (settings.closeLoop && !given) focal = focalByClosing(tree, s.pairs, focal);
        s.model = chain(tree, s.pairs, {focal, 0});
        if (!settings.closeLoop) {
            const auto closing = dropPairsThatClose(tree, s.pairs, s.model);
            start.forbidden.insert(start.forbidden.end(), closing.begin(), closing.end());
            if (!closing.empty()) continue;
        }
        adjustCoarseToFine(s.model, s.pairs, s.adjusting);
        focal = s.model.lens.focal;
        if (!dropWrongPairs(s)) break;
    }
    start.pairs = s.pairs;
    return start;
}

/// Adjusts by matches of patches, and drops those that do not fit. Gives the pairs with all their
/// matches. Errors: cancelled.
Result<std::vector<Pair>> adjustByPatches(Series& s, const Start& start,
                                          const PanoramaSettings& settings, Job& job) {
    const auto count = static_cast<int>(s.copies.size());
    s.pyramids.resize(s.copies.size());
    parallelFor(0, s.copies.size(), [&](std::size_t k) {
        if (s.model.known[k]) s.pyramids[k] = pyramidOf(s.copies[k].grey);
    });
    std::vector<Pair> all;
    for (const double reach : kPatchReaches) {
        STX_CHECK(matchPatches(s, start.pairs, start.forbidden, reach, job));
        // Features did not see all pairs that patches do.
        if (!settings.closeLoop)
            dropPairsThatClose(treeOf(count, s.pairs, false), s.pairs, s.model);
        if (all.empty()) all = s.pairs;
        for (const double pixels : kAfterPatches) {
            s.adjusting.noisePixels = noiseOf(s);
            s.adjusting.huberPixels = pixels;
            adjust(s.model, s.pairs, s.adjusting);
        }
        adjustToMost(s);
        if (settings.fieldOfView <= 0 && !s.adjusting.ownFocals) tryOwnFocals(s);
    }
    for (const double most : kFits) {
        keepWhatFits(s, most);
        s.adjusting.huberPixels = kFitHuber;
        adjust(s.model, s.pairs, s.adjusting);
    }
    return all;
}

/// Leaves out pictures that are in no pair any more, with a note; the tree of the others. Errors:
/// fewer than two are left.
Result<PictureTree> leaveOutStrangers(PictureSource& source, const std::vector<int>& twins,
                                      bool closeLoop, Series& s, Job& job) {
    const int count = source.count();
    PictureTree tree = treeOf(count, s.pairs, closeLoop);
    std::vector<std::string> strangers;
    for (int k = 0; k < count; ++k) {
        const auto i = static_cast<std::size_t>(k);
        s.model.known[i] = std::find(tree.order.begin(), tree.order.end(), k) != tree.order.end();
        if (!s.model.known[i] && twins[i] < 0) strangers.push_back(source.name(k));
    }
    if (tree.order.size() < 2)
        return fail(ErrorCode::invalidInput,
                    "no two of the {} pictures fit together by a rotation alone; the camera must "
                    "only turn, and neighbours overlap by a quarter or more",
                    count);
    if (!strangers.empty())
        job.note(fmt::format("{} left out, since nothing in {} fits to the others: {}",
                             counted(strangers.size(), "picture is", "pictures are"),
                             strangers.size() == 1 ? "it" : "them", listOf(strangers)));
    return tree;
}

/// The rotation into a world that is level; a note where up is a guess.
glm::dquat levelOf(const Series& s, PictureSource& source, bool closed, Job& job) {
    std::vector<bool> oriented;
    for (int k = 0; k < source.count(); ++k) oriented.push_back(source.oriented(k));
    const UpOfTurn found = findUp(s.model, oriented);
    if (found.byOwnTops)
        job.note(
            "the pictures are one above the other, or on their sides: their own tops are taken for "
            "up; turn them upright where that is wrong, or --up first takes the first one's frame");
    return levelTurn(s.model, found.up, closed);
}

/// The cameras of the model in the world that `up` asks for.
void describeCameras(const Series& s, PictureSource& source, PanoramaUp up, PanoramaAlignment& out,
                     Job& job) {
    const auto first = static_cast<std::size_t>(
        std::find(s.model.known.begin(), s.model.known.end(), true) - s.model.known.begin());
    const glm::dquat turn = up == PanoramaUp::first ? glm::inverse(s.model.worldFromCamera[first])
                                                    : levelOf(s, source, out.closed, job);
    out.focal = s.model.lens.focal;
    out.k1 = s.model.lens.k1;
    for (std::size_t k = 0; k < s.copies.size(); ++k) {
        PanoramaCamera camera;
        camera.used = s.model.known[k];
        camera.size = s.copies[k].fullSize;
        camera.focal = s.model.lensOf(static_cast<int>(k)).focal * s.copies[k].fullHalfDiagonal();
        if (camera.used) camera.worldFromCamera = glm::normalize(turn * s.model.worldFromCamera[k]);
        out.cameras.push_back(camera);
    }
}

}  // namespace

int PanoramaAlignment::used() const {
    return static_cast<int>(
        std::count_if(cameras.begin(), cameras.end(), [](const auto& c) { return c.used; }));
}

Result<PanoramaAlignment> alignPanorama(PictureSource& source, const PanoramaSettings& settings,
                                        Job& job) {
    const int count = source.count();
    if (count < 2)
        return fail(ErrorCode::invalidInput,
                    "a panorama is made of at least 2 pictures, and {} is here", count);
    if (count > kMostPictures)
        return fail(ErrorCode::invalidInput,
                    "{} pictures are too many for one panorama; {} are possible", count,
                    kMostPictures);
    Series s;
    STX_TRY(const auto twins, readPictures(source, s, job));
    double pixel = 1, largest = 0;
    for (const WorkCopy& copy : s.copies) {
        pixel = std::min(pixel, 1 / copy.halfDiagonal());
        largest = std::max(largest, copy.fullHalfDiagonal());
    }
    s.adjusting.pixel = pixel;
    STX_TRY(const auto start, startByFeatures(s, settings, focalHintOf(source, settings, s), job));
    const bool focalGiven = settings.fieldOfView > 0;
    STX_TRY(const auto all, adjustByPatches(s, start, settings, job));

    PanoramaAlignment out;
    describePairs(s, all, out);
    STX_TRY(const auto tree, leaveOutStrangers(source, twins, settings.closeLoop, s, job));
    const auto closing = pairsThatClose(tree, s.pairs, s.model);
    out.closed = settings.closeLoop && !closing.empty();
    if (out.closed) {
        const TurnModel byPairs = chain(tree, s.pairs, {start.focal, 0});
        out.gapBefore = gapOf(byPairs, s.pairs, closing, true);
        out.gapAfter = gapOf(s.model, s.pairs, closing, false);
    }
    describeCameras(s, source, settings.up, out, job);
    noteParallax(out.pairs, source, std::max(kLeastParallax, 2 * kParallaxShare * largest),
                 focalGiven, job);
    return out;
}

}  // namespace stx
