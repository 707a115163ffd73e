#pragma once

#include <algorithm>
#include <exception>
#include <new>
#include <string>
#include <string_view>

#include "lib/base/result.hpp"

namespace stx::exr {

/// Where the exceptions of OpenEXR, and of our streams under it, become errors.
template <class Work>
auto adapt(ErrorCode code, const std::string& where, const Work& work) -> decltype(work()) {
    const auto failed = [&](ErrorCode why, std::string_view text) {
        // The library wraps a reason once for each layer; ours names the file already.
        for (auto quote = text.find("\". "); quote != std::string_view::npos;
             quote = text.find("\". "))
            text.remove_prefix(quote + 3);
        std::string line(text);
        std::replace(line.begin(), line.end(), '\n', ' ');
        while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
        return failAt(where, why, "{}", line);
    };
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return failed(ErrorCode::failed, "there is not enough memory for the OpenEXR file");
    } catch (const std::exception& e) {
        return failed(code, e.what());
    } catch (...) {
        return failed(ErrorCode::failed, "the OpenEXR library failed without a reason");
    }
}

}  // namespace stx::exr
