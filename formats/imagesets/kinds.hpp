#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/imagesets/camera_file.hpp"
#include "formats/imagesets/json_values.hpp"
#include "formats/imagesets/set_view.hpp"

/// One describe function for each kind of set: cameras, and where the images are. None reads a
/// pixel. `path` is the file or folder given.
namespace stx::imagesets {

using std::filesystem::path;

[[nodiscard]] Result<SetDescription> describeTransforms(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeMiv(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeMsr(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeColmap(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeMiddlebury(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeRgbd(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeSevenScenes(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeOpen3d(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeExr(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeCamerasJson(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describeAzureKinect(const path&, const ImageSetOptions&, Job&);
[[nodiscard]] Result<SetDescription> describePanorama(const path&, const ImageSetOptions&, Job&);
/// Of one photograph. Decodes depth, but no colour, where that has no scale.
[[nodiscard]] Result<SetDescription> describePhoto(const path&, const ImageSetOptions&, Job&);

/// By options.from, or whatever kind the path is recognised as. Files that the set names and that
/// are not there are no errors yet: PictureSource::missing.
[[nodiscard]] Result<SetDescription> describeSet(const path&, const ImageSetOptions&, Job&);

/// Whether the names of the pictures in the options are those of films.
[[nodiscard]] bool namesFilms(const ImageSetOptions& options);
/// Frames of films, a colour and a depth one for each camera of a JSON file; several poses for one
/// film are those of a camera that moves.
[[nodiscard]] Result<SetDescription> describeFilms(const path&, const ImageSetOptions&, Job&);

/// Of transforms.json: what its integers of depth are, by integer_depth_scale or depth_coding;
/// nothing where it does not say.
[[nodiscard]] Result<std::optional<Distances>> transformsDistances(const Json& file,
                                                                   const std::string& where);
/// Of a camera of MIV's list.
[[nodiscard]] Result<Distances> mivDistances(const Json& camera, const std::string& where);
/// Of a camera of our cameras.json. `depthUnit`: integers times that are distances, 0 is none;
/// `nearPlane` and `farPlane`: the code of DepthImage; neither: nothing.
[[nodiscard]] Result<std::optional<Distances>> camerasDistances(const Json& camera,
                                                                const ImageSetOptions& options,
                                                                const std::string& where);

/// The file in `folder` with the poses of Open3D's or Redwood's recordings; empty: none.
[[nodiscard]] std::string trajectoryLogIn(const path& folder);

/// What a JSON file with cameras is.
enum class JsonKind { transforms, miv, cameras, cameraPath, none };
[[nodiscard]] JsonKind jsonKindOf(const Json& file);
/// Reads and parses a JSON file; errors name it.
[[nodiscard]] Result<Json> readJson(const path& file, const Limits& limits);
/// A file of a set that says where its cameras or pictures are; no output takes its place.
[[nodiscard]] Result<Bytes> readSetFile(const path& file, const Limits& limits);

/// The views of a JSON's cameras without their images, in the file's order.
[[nodiscard]] Result<std::vector<SetView>> transformsViews(const Json& file, Job& job);
[[nodiscard]] Result<std::vector<SetView>> mivViews(const Json& file, Job& job);
[[nodiscard]] Result<std::vector<SetView>> camerasJsonViews(const Json& file, Job& job);
/// Cameras without images: camera_path.json, as nerfstudio's viewer writes it.
[[nodiscard]] Result<std::vector<SetView>> cameraPathViews(const Json& file, Job& job);
/// Takes poses out of the world that nerfstudio trains and shows in, with what its
/// dataparser_transforms.json says: normalised = scale * transform * world. The world is that of
/// the images before nerfstudio prepared them (COLMAP's), or that of their transforms.json, where
/// one is given that names the difference (applied_transform, applied_scale), which is part of the
/// transform and of the scale.
[[nodiscard]] Result<void> undoDataparser(const Json& dataparser, const Json* transforms,
                                          std::vector<SetView>& views, Job& job);
/// Those of a COLMAP model (its folder, the workspace, or one of its files), by their names.
[[nodiscard]] Result<std::vector<SetView>> colmapViews(const path& given, Job& job);

/// What our own export writes beside a camera (stx:name, stx:quaternion, stx:position, stx:window,
/// nearPlane, farPlane, depthBits), so that a bundle comes back to the bit. Values that contradict
/// the camera are passed over.
[[nodiscard]] Result<void> readOwnKeys(const Json& camera, const std::string& where, SetView& view);

/// stx:environment of such an export: the file in its folder; empty: none. Errors: names that leave
/// the folder, a file that is not there.
[[nodiscard]] Result<path> environmentOf(const Json& file, const path& folder,
                                         const std::string& where, const Limits& limits);

/// stx:origin of such an export.
[[nodiscard]] Result<std::optional<glm::dvec3>> originOf(const Json& file,
                                                         const std::string& where);

/// The file in `folder` that has one of these names, in that order; empty when there is none.
[[nodiscard]] std::string firstThere(const path& folder, const std::vector<std::string>& names);
/// `name` as given, or with the ending of a usual image format.
[[nodiscard]] std::string withImageEnding(const path& folder, const std::string& name);
/// resolveInside with the place of the error; fills path and name. A file that is not there is no
/// error, but PictureSource::missing.
[[nodiscard]] Result<PictureSource> sourceInside(const path& folder, const std::string& name,
                                                 const std::string& where, const Limits& limits);
/// The same for the two files of a view. One that does not exist is not an error: it is in
/// view.missing.
[[nodiscard]] Result<void> findPictures(const path& folder, const std::string& texture,
                                        const std::string& depth, const std::string& where,
                                        const Limits& limits, SetView& view);
/// Whether `a` comes before `b` where numbers in names count as numbers: 9.png, 10.png, 010.png.
/// The digits of a fraction (1305031102.25.png) count as such. A total order.
[[nodiscard]] bool numbersInOrder(std::string_view a, std::string_view b);
/// Names of the regular files in a folder, sorted by numbersInOrder().
[[nodiscard]] std::vector<std::string> filesIn(const path& folder);
/// Errors when there are more views than limits.maxViews.
[[nodiscard]] Result<void> checkViewCount(std::uint64_t count, const Limits& limits,
                                          const std::string& where);

}  // namespace stx::imagesets
