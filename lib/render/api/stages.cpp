#include "lib/render/api/stages.hpp"

namespace stx {
namespace {

constexpr StageInfo kStages[] = {
#define STX_STAGE_INFO(name, mode, sentence, source) \
    {Stage::name, #name, StageMode::mode, sentence, source},
    STX_STAGES(STX_STAGE_INFO)
#undef STX_STAGE_INFO
};
static_assert(std::size(kStages) <= 64);

}  // namespace

std::span<const StageInfo> stages() {
    return kStages;
}

}  // namespace stx
