#pragma once

#include <functional>
#include <string>

namespace stx {

/// While one lives, a damaged JPEG is drawn as far as it goes, and `note` is given which and why,
/// from any thread; else it is an error. For the whole process, as ThreadLimit is: the person who
/// runs it says once what a damaged picture is worth (`--damaged keep`). One at a time.
class KeepDamaged {
  public:
    explicit KeepDamaged(std::function<void(std::string)> note);
    ~KeepDamaged();
    KeepDamaged(const KeepDamaged&) = delete;
    KeepDamaged& operator=(const KeepDamaged&) = delete;
};

/// True while a KeepDamaged lives.
[[nodiscard]] bool keepsDamaged();
/// Tells it of a picture that was kept.
void noteDamaged(std::string note);

}  // namespace stx
