#pragma once

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/mapping/picture_spool.hpp"
#include "lib/model/sequence.hpp"

namespace stx::mpeg4 {

/// A presentation of a sequence: sceneFromBundle() of its first frame, in which images that change
/// are MovieTextures of PNG or JPEG access units with the sequence's times, and views whose camera
/// changes are replaced by commands (REPLACE of the DepthImage, which keeps its id). One depth
/// range and one range of splats serve a view for the whole sequence, so that what stands still
/// keeps its codes; every frame is gone through twice for it, one view for each thread at a time
/// (forEachView()), and of the frame before hashes are kept. A picture that repeats the one before
/// it lasts longer, colour and depth of a view alike. With options.h264 colour and depth that
/// change are H.264 tracks of full range in place of pictures. All frames count from one origin,
/// near the first where floats would round its coordinates (originOf()). How long the film is
/// shown is in the WorldInfo where its pictures and commands do not tell. Errors: those of
/// sceneFromBundle() and of the frames, with the frame's time; (unsupported) PointTexture and
/// OctreeImage, which cannot move, and JPEG colour of pruned views; (invalidInput) views that come,
/// go or change their size.
[[nodiscard]] Result<Document> sceneFromSequence(Sequence& frames, const SceneWriteOptions& options,
                                                 PictureSpool& spool, Job& job);

}  // namespace stx::mpeg4
