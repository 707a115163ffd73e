#include "lib/base/job.hpp"

#include <algorithm>

namespace stx {

Result<void> Limits::checkAllocation(std::uint64_t count, std::uint64_t bytesEach,
                                     std::string_view what) const {
    if (bytesEach == 0 || count <= maxMemoryBytes / bytesEach) return {};
    // In whole MiB; nobody has what does not fit into 64 bits.
    const bool sane = count <= UINT64_MAX / 2 / bytesEach;
    return fail(ErrorCode::invalidInput,
                "{} would need {} x {} bytes, more than the memory limit of {} MiB; raise it with "
                "--max-memory{} if the file is to be trusted",
                what, count, bytesEach, maxMemoryBytes >> 20,
                sane ? fmt::format(" {}", ((count * bytesEach - 1) >> 20) + 1) : "");
}

void Job::note(std::string text) {
    const std::lock_guard lock(mutex_);
    for (auto& known : notes_) {
        if (known.text == text) {
            ++known.count;
            return;
        }
    }
    notes_.push_back({std::move(text)});
}

void Job::workFor(Job& whole) {
    limits = whole.limits;
    whole_ = &whole;
}

void Job::passNotesOn() {
    for (std::string& text : takeNotes()) whole_->note(std::move(text));
}

void Job::noteAbove(std::string text) {
    if (whole_)
        whole_->noteAbove(std::move(text));
    else
        note(std::move(text));
}

void Job::noteOnce(std::string text) {
    if (whole_) return whole_->noteOnce(std::move(text));
    const std::lock_guard lock(mutex_);
    const auto known = std::ranges::find(notes_, text, &Note::text);
    if (known == notes_.end()) notes_.push_back({std::move(text)});
}

void Job::noteUnused(const std::vector<std::string>& names, std::string_view of,
                     std::string_view why) {
    if (names.empty()) return;
    note(fmt::format("{} {} {}{}not used: {}", fmt::join(names, ", "),
                     names.size() == 1 ? "is" : "are", of, of.empty() ? "" : " and ", why));
}

std::vector<std::string> Job::takeNotes() {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> lines;
    for (auto& n : notes_)
        lines.push_back(n.count > 1 ? fmt::format("{} ({} times)", n.text, n.count) : n.text);
    notes_.clear();
    return lines;
}

Result<void> Job::checkCancelled() const {
    if (cancelled.load(std::memory_order_relaxed)) return fail(ErrorCode::failed, "stopped");
    return whole_ ? whole_->checkCancelled() : Result<void>();
}

}  // namespace stx
