#include "formats/imagesets/json_values.hpp"

#include <cmath>

namespace stx::imagesets {
namespace {

std::string shown(const Json& value) {
    std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() > 60) text = text.substr(0, 57) + "...";
    return text;
}

const Json* find(const Json& object, const char* key) {
    const auto it = object.find(key);
    return it == object.end() || it->is_null() ? nullptr : &*it;
}

tl::unexpected<Error> missing(const char* key, const std::string& where) {
    return failAt(where, ErrorCode::invalidInput, "'{}' is missing", key);
}

}  // namespace

Result<std::optional<double>> findNumber(const Json& object, const char* key,
                                         const std::string& where) {
    const Json* value = find(object, key);
    if (!value) return std::optional<double>();
    if (!value->is_number() || !std::isfinite(value->get<double>()))
        return failAt(where, ErrorCode::invalidInput, "'{}' is {}; a finite number is expected",
                      key, shown(*value));
    return std::optional<double>(value->get<double>());
}

Result<double> needNumber(const Json& object, const char* key, const std::string& where) {
    STX_TRY(const auto value, findNumber(object, key, where));
    if (!value) return missing(key, where);
    return *value;
}

Result<std::optional<std::vector<double>>> findNumbers(const Json& object, const char* key,
                                                       std::size_t count,
                                                       const std::string& where) {
    const Json* value = find(object, key);
    if (!value) return std::optional<std::vector<double>>();
    std::vector<double> numbers;
    if (value->is_array() && value->size() == count) {
        for (const Json& item : *value)
            if (item.is_number() && std::isfinite(item.get<double>()))
                numbers.push_back(item.get<double>());
    }
    if (numbers.size() != count)
        return failAt(where, ErrorCode::invalidInput,
                      "'{}' is {}; a list of {} finite numbers is expected", key, shown(*value),
                      count);
    return std::optional<std::vector<double>>(std::move(numbers));
}

Result<std::vector<double>> needNumbers(const Json& object, const char* key, std::size_t count,
                                        const std::string& where) {
    STX_TRY(auto value, findNumbers(object, key, count, where));
    if (!value) return missing(key, where);
    return std::move(*value);
}

Result<glm::dmat4> needMatrix(const Json& object, const char* key, const std::string& where) {
    const auto it = object.find(key);
    if (it == object.end()) return missing(key, where);
    glm::dmat4 m(1.0);
    const bool fine = [&] {
        if (!it->is_array() || it->size() < 3 || it->size() > 4) return false;
        for (std::size_t r = 0; r < it->size(); ++r) {
            const Json& row = (*it)[r];
            if (!row.is_array() || row.size() != 4) return false;
            for (std::size_t k = 0; k < 4; ++k) {
                if (!row[k].is_number() || !std::isfinite(row[k].get<double>())) return false;
                m[static_cast<int>(k)][static_cast<int>(r)] = row[k].get<double>();
            }
        }
        return true;
    }();
    if (!fine)
        return failAt(where, ErrorCode::invalidInput, "'{}' must be 4 rows of 4 finite numbers",
                      key);
    if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1)
        return failAt(where, ErrorCode::invalidInput, "the last row of '{}' must be 0 0 0 1", key);
    return m;
}

Result<std::optional<std::string>> findText(const Json& object, const char* key,
                                            const std::string& where) {
    const Json* value = find(object, key);
    if (!value) return std::optional<std::string>();
    if (!value->is_string() || value->get_ref<const std::string&>().find('\0') != std::string::npos)
        return failAt(where, ErrorCode::invalidInput, "'{}' is {}; a text is expected", key,
                      shown(*value));
    return std::optional<std::string>(value->get<std::string>());
}

Result<std::string> needText(const Json& object, const char* key, const std::string& where) {
    STX_TRY(auto value, findText(object, key, where));
    if (!value) return missing(key, where);
    return std::move(*value);
}

Result<int> imageSide(double value, const char* key, int largest, const std::string& where) {
    if (!(value >= 1 && value <= largest && value == std::floor(value)))
        return failAt(where, ErrorCode::invalidInput,
                      "'{}' is {:g}; a whole number of 1 to {} is expected", key, value, largest);
    return static_cast<int>(value);
}

}  // namespace stx::imagesets
