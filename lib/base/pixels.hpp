#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

namespace stx {

/// Room for pixels that memory has none for. They are read and written as others are, but take
/// memory only while somebody does so. Safe for threads.
class PixelSpool {
  public:
    virtual ~PixelSpool() = default;
    /// Room for so many bytes, aligned for all values. Errors: std::bad_alloc, std::system_error.
    [[nodiscard]] virtual void* take(std::size_t bytes) = 0;
    /// Room for so many bytes that holds those of `data`. A spool may have a shorter way to it than
    /// through memory.
    [[nodiscard]] virtual void* keep(const void* data, std::size_t bytes) {
        return std::memcpy(take(bytes), data, bytes);
    }
    virtual void give(void* room, std::size_t bytes) noexcept = 0;
    /// Gives memory back now, if much is in use. For who goes over many pixels.
    virtual void settle() noexcept = 0;
};

/// An array of plain values, in memory or in a spool, which must outlive it. Copies are in memory.
template <class T>
class Pixels {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

  public:
    Pixels() = default;
    explicit Pixels(std::size_t count, T fill = {}, PixelSpool* spool = nullptr)
        : count_(count), spool_(spool) {
        if (count == 0) return;
        if (count > PTRDIFF_MAX / sizeof(T)) throw std::bad_array_new_length();
        first_ = spool ? static_cast<T*>(spool->take(count * sizeof(T)))
                       : std::allocator<T>().allocate(count);
        std::uninitialized_fill_n(first_, count, fill);
    }
    Pixels(const Pixels& other) : Pixels(other, nullptr) {}
    Pixels(const Pixels& other, PixelSpool* spool) : count_(other.count_), spool_(spool) {
        if (count_ == 0) return;
        if (spool) {
            first_ = static_cast<T*>(spool->keep(other.first_, count_ * sizeof(T)));
        } else {
            first_ = std::allocator<T>().allocate(count_);
            std::uninitialized_copy_n(other.first_, count_, first_);
        }
    }
    Pixels(Pixels&& other) noexcept { swap(other); }
    Pixels& operator=(const Pixels& other) {
        if (this != &other) *this = Pixels(other);
        return *this;
    }
    Pixels& operator=(Pixels&& other) noexcept {
        Pixels(std::move(other)).swap(*this);
        return *this;
    }
    ~Pixels() {
        if (!first_) return;
        spool_ ? spool_->give(first_, count_ * sizeof(T))
               : std::allocator<T>().deallocate(first_, count_);
    }

    [[nodiscard]] bool empty() const { return count_ == 0; }
    [[nodiscard]] std::size_t size() const { return count_; }
    [[nodiscard]] T* data() { return first_; }
    [[nodiscard]] const T* data() const { return first_; }
    [[nodiscard]] T& operator[](std::size_t i) { return first_[i]; }
    [[nodiscard]] const T& operator[](std::size_t i) const {
        return first_[i];  // NOLINT(clang-analyzer-core.uninitialized.UndefReturn): `i` is in them
    }

    bool operator==(const Pixels& other) const {
        return count_ == other.count_ && std::equal(first_, first_ + count_, other.first_);
    }

  private:
    void swap(Pixels& other) noexcept {
        std::swap(first_, other.first_);
        std::swap(count_, other.count_);
        std::swap(spool_, other.spool_);
    }

    T* first_ = nullptr;
    std::size_t count_ = 0;
    PixelSpool* spool_ = nullptr;
};

}  // namespace stx
