#include "tools/view_changes.hpp"

#include "lib/render/around/around.hpp"
#include "lib/render/factory.hpp"
#include "tools/drawn_views.hpp"

namespace stx::tools {

ViewChange withDepthBits(int bits, CodedDepth& codes) {
    ViewChange change;
    change.change = [bits, &codes](ReferenceView& view, Job&) -> Result<void> {
        if (setDepthBits(view, bits)) codes.add(view);
        return {};
    };
    change.header = [bits](ViewHeader& header) { header.depthBits = bits; };
    return change;
}

Result<std::unique_ptr<ViewTable>> cubeOf(std::unique_ptr<ViewTable> table,
                                          const std::filesystem::path& folder, Job& job) {
    std::unique_ptr<FileSpool> spool;  // outlives the bundle
    Bundle bundle;
    if (table->whole())
        STX_SET(bundle, wholeBundle(std::move(table), job));
    else
        STX_SET(bundle, viewsToDraw(*table, drawingMemory({}),
                                    std::vector<bool>(table->count(), true), folder, spool, job));
    STX_TRY(auto cube, cubeFromInside(bundle, job, spool.get()));
    return tableOf(std::move(cube));
}

}  // namespace stx::tools
