#include "formats/panorama/panorama_files.hpp"

namespace stx {

Result<void> writePanoramaScene(const PanoramaFaces& faces, const std::filesystem::path& path,
                                const PanoramaWriteOptions& options, Job& job) {
    (void)faces;
    (void)options;
    (void)job;
    return checkPanoramaFormat(path);
}

}  // namespace stx
