#include "lib/render/gl/gl_renderer.hpp"
namespace stx::gl {
Result<std::unique_ptr<Renderer>> makeGlRenderer(const Bundle&, const RenderSettings&, int, Job&) {
    return fail(ErrorCode::unsupported,
                "the gl backend is not in this build; use --backend gpu or cpu");
}
}  // namespace stx::gl
