#include "formats/images/damage.hpp"

#include <mutex>
#include <utility>

namespace stx {
namespace {

struct Keeping {
    std::mutex mutex;
    std::function<void(std::string)> note;
};

Keeping& keeping() {
    static Keeping one;
    return one;
}

}  // namespace

KeepDamaged::KeepDamaged(std::function<void(std::string)> note) {
    const std::lock_guard lock(keeping().mutex);
    keeping().note = std::move(note);
}

KeepDamaged::~KeepDamaged() {
    const std::lock_guard lock(keeping().mutex);
    keeping().note = nullptr;
}

bool keepsDamaged() {
    const std::lock_guard lock(keeping().mutex);
    return keeping().note != nullptr;
}

void noteDamaged(std::string note) {
    const std::lock_guard lock(keeping().mutex);
    if (keeping().note) keeping().note(std::move(note));
}

}  // namespace stx
