#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <span>
#include <utility>

#include <glm/glm.hpp>

#include "lib/base/pixels.hpp"

namespace stx {

/// A plain raster: width x height values, row 0 on top, rows stored one after the other.
template <class T>
class Image {
  public:
    using Pixel = T;

    Image() = default;
    /// Errors of allocation are std::bad_alloc; sizes from files are checked against Limits before.
    Image(int width, int height, T fill = {})
        : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * height, fill) {}
    Image(const Image&) = default;
    Image& operator=(const Image&) = default;
    /// What is moved from is empty.
    Image(Image&& other) noexcept { swap(other); }
    Image& operator=(Image&& other) noexcept {
        Image(std::move(other)).swap(*this);
        return *this;
    }
    ~Image() = default;

    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] glm::ivec2 size() const { return {width_, height_}; }
    [[nodiscard]] bool empty() const { return pixels_.empty(); }
    [[nodiscard]] std::size_t count() const { return pixels_.size(); }

    [[nodiscard]] T& at(int x, int y) {
        assert(contains(x, y));
        return pixels_[static_cast<std::size_t>(y) * width_ + x];
    }
    [[nodiscard]] const T& at(int x, int y) const {
        assert(contains(x, y));
        return pixels_[static_cast<std::size_t>(y) * width_ + x];
    }
    [[nodiscard]] bool contains(int x, int y) const {
        return x >= 0 && y >= 0 && x < width_ && y < height_;
    }

    [[nodiscard]] std::span<T> row(int y) {
        return {pixels_.data() + static_cast<std::size_t>(y) * width_,
                static_cast<std::size_t>(width_)};
    }
    [[nodiscard]] std::span<const T> row(int y) const {
        return {pixels_.data() + static_cast<std::size_t>(y) * width_,
                static_cast<std::size_t>(width_)};
    }
    /// Columns `left` to left + width - 1 of rows `top` to top + height - 1, which are in the
    /// image; of an empty one: empty.
    [[nodiscard]] Image part(int left, int top, int width, int height) const {
        if (empty()) return {};
        assert(contains(left, top) && left + width <= width_ && top + height <= height_);
        Image out(width, height);
        for (int y = 0; y < height; ++y)
            std::copy_n(row(top + y).begin() + left, width, out.row(y).begin());
        return out;
    }
    [[nodiscard]] std::span<T> pixels() { return {pixels_.data(), pixels_.size()}; }
    [[nodiscard]] std::span<const T> pixels() const { return {pixels_.data(), pixels_.size()}; }
    [[nodiscard]] T* data() { return pixels_.data(); }
    [[nodiscard]] const T* data() const { return pixels_.data(); }

    /// Moves the pixels into a spool, which must outlive them; null: they stay where they are.
    void moveTo(PixelSpool* spool) {
        if (spool) pixels_ = Pixels<T>(pixels_, spool);
    }

    bool operator==(const Image&) const = default;

  private:
    void swap(Image& other) noexcept {
        std::swap(width_, other.width_);
        std::swap(height_, other.height_);
        std::swap(pixels_, other.pixels_);
    }

    int width_ = 0;
    int height_ = 0;
    Pixels<T> pixels_;
};

}  // namespace stx
