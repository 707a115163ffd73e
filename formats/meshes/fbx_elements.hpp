#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "formats/files/files.hpp"

namespace stx {

/// A value behind the name of an element of FBX. What is in quotes, or bytes, is text alone.
struct FbxValue {
    std::string_view text;
    std::int64_t integer = 0;
    double number = 0;
};

/// An element of an FBX file, and the names of those that it is in, outermost first.
struct FbxElement {
    std::string_view name;
    std::span<const FbxValue> values;  ///< the first eight; arrays of binary files are left out
    std::span<const std::string_view> inside;
};

/// Calls visit(element) for each element of an FBX file of version 7, text or binary, in their
/// order, until the file ends or makes no sense. What is given lives as long as the call, texts as
/// long as `bytes`.
void eachFbxElement(ByteSpan bytes, const std::function<void(const FbxElement&)>& visit);

}  // namespace stx
