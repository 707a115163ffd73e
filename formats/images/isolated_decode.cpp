#include "formats/images/isolated_decode.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "formats/files/child_process.hpp"
#include "formats/files/pipes.hpp"
#include "lib/base/result.hpp"

namespace stx {

namespace {

using codecs::DecodeRequest;
using codecs::Failure;
using codecs::Header;

enum class Tag : std::uint32_t { header = 1, pixels = 2, failure = 3 };

constexpr int kPatienceMs = ChildProcess::kPatienceMs;

std::size_t bytesOf(const Header& header) {
    return static_cast<std::size_t>(header.width) * header.height * header.channels *
           (header.bits / 8);
}

bool receive(int fd, void* bytes, std::size_t size) {
    return receiveAll(fd, bytes, size, kPatienceMs);
}

/// What the child's allocate() needs.
struct Child {
    const DecodeRequest& outer;
    int fd;
    Header header;
    void* values = nullptr;
};

void* allocateAndTell(void* context, const Header& header, Failure& failure) {
    auto& child = *static_cast<Child*>(context);
    child.header = header;
    child.values = child.outer.allocate(child.outer.context, header, failure);
    if (!child.values) return nullptr;
    const Tag tag = Tag::header;
    bool sent = sendAll(child.fd, &tag, sizeof(tag)) && sendAll(child.fd, &header, sizeof(header));
    for (int i = 0; sent && i < header.channels; ++i) {
        const auto length = static_cast<std::uint32_t>(std::strlen(header.channelNames[i]));
        sent = sendAll(child.fd, &length, sizeof(length)) &&
               sendAll(child.fd, header.channelNames[i], length);
    }
    if (!sent) ::_exit(1);
    return child.values;
}

[[noreturn]] void runChild(const codecs::Table& table, const DecodeRequest& request, int fd,
                           std::uint64_t maxMemoryBytes) {
    const rlimit time = {kPatienceMs / 1000, kPatienceMs / 1000 + 1};
    ::setrlimit(RLIMIT_CPU, &time);
    confineChild(maxMemoryBytes + (maxMemoryBytes >> 1) + (256u << 20));

    Child child{request, fd, {}};
    DecodeRequest inner = request;
    inner.context = &child;
    inner.allocate = allocateAndTell;
    Failure failure;
    const bool good = table.decode(inner, failure);
    const Tag tag = good ? Tag::pixels : Tag::failure;
    bool sent = sendAll(fd, &tag, sizeof(tag));
    sent = sent && (good ? sendAll(fd, child.values, bytesOf(child.header))
                         : sendAll(fd, &failure, sizeof(failure)));
    ::_exit(sent ? 0 : 1);
}

bool failWith(Failure& failure, ErrorCode code, const std::string& message) {
    failure.code = static_cast<int>(code);
    const std::size_t length = std::min(message.size(), sizeof(failure.message) - 1);
    std::memcpy(failure.message, message.data(), length);
    failure.message[length] = 0;
    return false;
}

}  // namespace

bool decodeIsolated(const codecs::Table& table, const DecodeRequest& request,
                    std::uint64_t maxMemoryBytes, Failure& failure) {
    // The decoding itself runs side by side with others.
    const auto child =
        ChildProcess::start([&](int socket) { runChild(table, request, socket, maxMemoryBytes); });
    if (!child) return failWith(failure, child.error().code, child.error().message);
    const int in = (*child)->socket();

    const auto died = [&] {
        return failWith(failure, ErrorCode::invalidInput,
                        "its decoder crashed or did not end; the file is damaged");
    };
    Header header;
    void* values = nullptr;
    for (;;) {
        Tag tag{};
        if (!receive(in, &tag, sizeof(tag))) return died();
        if (tag == Tag::failure) {
            if (!receive(in, &failure, sizeof(failure))) return died();
            failure.message[sizeof(failure.message) - 1] = 0;
            return false;
        }
        if (tag == Tag::pixels && values) return receive(in, values, bytesOf(header)) || died();
        if (tag != Tag::header || values || !receive(in, &header, sizeof(header))) return died();
        if (header.channels < 1 || header.channels > 1024) return died();
        std::vector<std::string> names(static_cast<std::size_t>(header.channels));
        std::vector<const char*> pointers;
        for (auto& name : names) {
            std::uint32_t length = 0;
            if (!receive(in, &length, sizeof(length)) || length > 65536) return died();
            name.resize(length);
            if (!receive(in, name.data(), length)) return died();
            pointers.push_back(name.c_str());
        }
        header.channelNames = pointers.data();
        values = request.allocate(request.context, header, failure);
        if (!values) return false;
    }
}

}  // namespace stx
