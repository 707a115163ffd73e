#pragma once

#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <unistd.h>

#include "formats/decoders/wire.hpp"
#include "formats/images/picture_wire.hpp"

namespace stx::codecs {

/// A picture on its way to who asked for it.
class PictureAnswer {
  public:
    explicit PictureAnswer(int socket) : socket_(socket) {}

    /// Tells what it is, and gives room for its pixels, which are 0. Whoever does not want it ends
    /// this process.
    void* begin(const decoders::PictureFacts& facts, const std::vector<std::string>& channelNames) {
        decoders::Packer content;
        content.put(facts);
        for (const auto& name : channelNames) content.putText(name);
        if (!decoders::sendMessage(socket_, decoders::Tag::pictureHeader, content.bytes))
            ::_exit(1);
        size_ = static_cast<std::size_t>(facts.bits / 8);
        for (const std::int32_t side : {facts.width, facts.height, facts.channels})
            if (side < 1 || __builtin_mul_overflow(size_, static_cast<std::size_t>(side), &size_))
                throw std::bad_alloc();
        values_.reset(std::calloc(size_, 1));
        if (!values_) throw std::bad_alloc();
        return values_.get();
    }
    void end() const {
        if (!decoders::sendHead(socket_, decoders::Tag::pixels, size_) ||
            !sendAll(socket_, values_.get(), size_))
            ::_exit(1);
    }

  private:
    struct Free {
        void operator()(void* memory) const { std::free(memory); }
    };
    int socket_;
    std::size_t size_ = 0;
    std::unique_ptr<void, Free> values_;
};

}  // namespace stx::codecs
