#include <algorithm>
#include <cmath>

#include "lib/model/light_ratio.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

/// The number of points at which light is compared.
constexpr double kLightPoints = 20000;
/// The same surface: depths that differ by no more than this share.
constexpr float kSameDepth = 0.01f;
/// A gain nearer to 1 than this moves no 8-bit value and counts as none.
constexpr float kNoGain = 0.5f / 255;

/// Colours of two views of one camera, where both show the same surface.
std::vector<LitPair> samePoints(const PageSet& a, std::size_t viewA, const PageSet& b,
                                std::size_t viewB) {
    const Camera& c = a.views()[viewA].camera;
    const double pixels = static_cast<double>(c.width) * c.height;
    const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kLightPoints))));
    std::vector<LitPair> pairs;
    const auto colour = [](const PageSet& set, const PageRectangle& r, int x, int y) {
        return glm::vec3(set.pages()[r.page].texture->at(r.texel(x, y)));
    };
    for (int y = step / 2; y < c.height; y += step) {
        for (int x = step / 2; x < c.width; x += step) {
            const PageRectangle *ra = a.find(viewA, x, y), *rb = b.find(viewB, x, y);
            if (!ra || !rb) continue;
            const float za = a.depth(viewA, x, y), zb = b.depth(viewB, x, y);
            if (!hasPoint(za) || !hasPoint(zb) || std::abs(za - zb) > kSameDepth * za) continue;
            pairs.push_back({colour(a, *ra, x, y), colour(b, *rb, x, y)});
        }
    }
    return pairs;
}

}  // namespace

PageSet PageSet::part(bool background) const {
    std::vector<bool> kept;
    for (const PageView& view : views()) kept.push_back(view.background == background);
    return only(kept);
}

PageSet PageSet::only(const std::vector<bool>& kept) const {
    auto data = std::make_shared<Data>();
    data->padding = data_->padding;
    data->bounds = data_->bounds;
    data->farAway = data_->farAway;
    data->spool = data_->spool;
    data->unpacked = data_->unpacked;
    data->changed = data_->changed;
    data->refined = data_->refined;
    std::vector<int> pageOf(data_->pages.size(), -1);
    std::vector<std::uint32_t> rectangleOf(data_->rectangles.size(), 0);
    for (std::size_t i = 0; i < data_->views.size(); ++i) {
        PageView view = data_->views[i];
        if (!kept[i]) continue;
        const auto first = static_cast<std::uint32_t>(data->rectangles.size());
        for (std::uint32_t k = 0; k < view.rectangleCount; ++k) {
            PageRectangle r = data_->rectangles[view.firstRectangle + k];
            int& page = pageOf[r.page];
            if (page < 0) {
                page = static_cast<int>(data->pages.size());
                data->pages.push_back(data_->pages[r.page]);
                if (!data_->captured.empty()) data->captured.push_back(data_->captured[r.page]);
            }
            r.page = page;
            r.view = static_cast<int>(data->views.size());
            rectangleOf[view.firstRectangle + k] = first + k;
            data->rectangles.push_back(r);
        }
        ViewIndex index = data_->index[i];
        for (std::uint32_t& number : index.near) number = rectangleOf[number];
        view.firstRectangle = first;
        data->pruned = data->pruned || view.pruned;
        data->views.push_back(std::move(view));
        data->index.push_back(std::move(index));
    }
    return PageSet(std::move(data));
}

PageSet PageSet::inLightOf(const PageSet& other) const {
    std::shared_ptr<Data> data;
    std::vector<std::shared_ptr<Texture>> textures(data_->pages.size());
    for (std::size_t i = 0; i < data_->views.size(); ++i) {
        const auto theirs = other.views();
        const auto same = std::find_if(theirs.begin(), theirs.end(), [&](const PageView& v) {
            return sameCamera(v.camera, data_->views[i].camera);
        });
        if (same == theirs.end()) continue;
        const glm::vec3 gain = lightRatio(
            samePoints(*this, i, other, static_cast<std::size_t>(same - theirs.begin())));
        if (glm::all(glm::lessThan(glm::abs(gain - 1.0f), glm::vec3(kNoGain)))) continue;
        if (!data) data = std::make_shared<Data>(*data_);
        for (const PageRectangle& r : rectanglesOf(i)) {
            const auto page = static_cast<std::size_t>(r.page);
            auto& texture = textures[page];
            if (!texture) texture = std::make_shared<Texture>(*data_->pages[page].texture);
            const int width = texture->width();
            for (int y = r.pageY - r.top; y < r.pageY + r.height + r.bottom; ++y) {
                for (int x = r.pageX - r.left; x < r.pageX + r.width + r.right; ++x) {
                    const std::size_t texel = static_cast<std::size_t>(y) * width + x;
                    if (auto* bytes = texture->rgba8()) {
                        glm::u8vec4& c = bytes->data()[texel];
                        const glm::vec3 lit = glm::vec3(glm::u8vec3(c)) * gain + 0.5f;
                        c = glm::u8vec4(glm::u8vec3(glm::min(lit, 255.0f)), c.a);
                    }
                    if (auto* floats = texture->rgbaFloat())
                        floats->data()[texel] *= glm::vec4(gain, 1.0f);
                }
            }
        }
    }
    if (!data) return *this;
    for (std::size_t i = 0; i < textures.size(); ++i) {
        if (!textures[i]) continue;
        textures[i]->moveTo(spool());
        data->pages[i].texture = textures[i].get();
        data->changed.push_back(std::move(textures[i]));
    }
    return PageSet(std::move(data));
}

}  // namespace stx
