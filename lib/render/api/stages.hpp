#pragma once

#include <bitset>
#include <cstddef>
#include <span>
#include <string_view>

namespace stx {

// clang-format off
/// The stages of rendering that may be left out (stx render --without), in the order in which they
/// are done: name, mode, sentence, source of the method (or ""). A stage asks
/// RenderSettings::does() whether it is wanted. Steps of refining are beside: lib/refine/refine.hpp.
#define STX_STAGES(STAGE) \
    STAGE(twins, both, "views that repeat another are drawn as one", "") \
    STAGE(coarse, splat, "points that another view shows twice as finely are left out", "") \
    STAGE(solid, surface, "what is translucent inside of the object is drawn opaque", "") \
    STAGE(unmeasured, both, "colours without depth are drawn where nothing else is", \
          "Bleyer, Rhemann & Rother 2011") \
    STAGE(creases, surface, "pixels that mix two faces give their colour to neither", "") \
    STAGE(rims, surface, "pixels at inner edges with the colour of the front are all front", "") \
    STAGE(levels, surface, "outlines run where the covered parts of pixels tell", "Youngs 1982") \
    STAGE(sharpen, surface, "colours are as much sharper as fitting them blurs them", "") \
    STAGE(blend, surface, "captured views that disagree are blended where they show the same", "") \
    STAGE(places, surface, "tiles get the sources of places that few of their own show", "") \
    STAGE(mean, surface, "best is the mean of what few and what all sources of a tile show", \
          "Breiman 1996") \
    STAGE(settle, surface, "one sample settles a pixel within a surface (cpu)", "") \
    STAGE(holes, surface, "holes that no view looks into continue what is around", "") \
    STAGE(surroundings, surface, "in scenes that fill the frame hidden background is filled", "") \
    STAGE(outlines, surface, "surfaces that turn away end at the outermost points of all views", "") \
    STAGE(nearer, splat, "points that other views show much better are left out", "") \
    STAGE(cull, splat, "blocks that others hide are left out (gpu)", "") \
    STAGE(closing, splat, "single open pixels are closed", "") \
    STAGE(coverage, splat, "edges have the coverage that the views' alpha saw", "") \
    STAGE(footprint, both, "small pictures are averaged from larger ones", "")
// clang-format on

/// A stage of rendering that may be left out.
enum class Stage {
#define STX_STAGE_NAME(name, mode, sentence, source) name,
    STX_STAGES(STX_STAGE_NAME)
#undef STX_STAGE_NAME
};

/// The modes that have a stage.
enum class StageMode { both, surface, splat };

struct StageInfo {
    Stage stage;
    std::string_view name;  ///< as in --without
    StageMode mode;
    std::string_view sentence;  ///< what it does
    std::string_view source;    ///< of the method; empty: our own
};
/// All, in the order in which they are done.
[[nodiscard]] std::span<const StageInfo> stages();

/// Some of the stages.
class StageSet {
  public:
    [[nodiscard]] bool has(Stage stage) const { return bits_[static_cast<std::size_t>(stage)]; }
    void add(Stage stage) { bits_.set(static_cast<std::size_t>(stage)); }

  private:
    std::bitset<64> bits_;
};

}  // namespace stx
