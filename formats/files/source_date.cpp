#include "formats/files/source_date.hpp"

#include <chrono>
#include <cstdlib>

#include <fmt/format.h>

#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

constexpr std::uint64_t kEndOf9999 = 253402300799;

}  // namespace

std::optional<std::uint64_t> sourceDate() {
    const char* text = std::getenv("SOURCE_DATE_EPOCH");
    if (text == nullptr) return std::nullopt;
    const auto seconds = wholeNumber<std::uint64_t>(text);
    return seconds && *seconds <= kEndOf9999 ? seconds : std::nullopt;
}

Result<void> checkSourceDate() {
    const char* text = std::getenv("SOURCE_DATE_EPOCH");
    if (text == nullptr || *text == 0 || sourceDate()) return {};
    return fail(ErrorCode::usage,
                "SOURCE_DATE_EPOCH is '{}'; whole seconds since 1970 up to the year 9999 are "
                "expected: correct it, or unset it for outputs without a date",
                text);
}

std::string exrDate(std::uint64_t seconds) {
    using namespace std::chrono;
    const sys_seconds moment{std::chrono::seconds(static_cast<std::int64_t>(seconds))};
    const sys_days day = floor<days>(moment);
    const year_month_day date(day);
    const hh_mm_ss time(moment - day);
    return fmt::format("{:04}:{:02}:{:02} {:02}:{:02}:{:02}", static_cast<int>(date.year()),
                       static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                       time.hours().count(), time.minutes().count(), time.seconds().count());
}

}  // namespace stx
