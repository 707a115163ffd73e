#include "formats/mpeg4/mapping/new_document.hpp"

#include "formats/mpeg4/mapping/picture_spool.hpp"

namespace stx::mpeg4 {

Url addPictureStream(UpdateObjectDescriptors& update, std::string fileName, Bytes bytes) {
    const int id = kFirstImageOd + static_cast<int>(update.descriptors.size());
    const bool png = bytes.size() > 1 && bytes[0] == std::byte{0x89};
    ElementaryStream stream;
    stream.esId = static_cast<std::uint32_t>(id + 1);
    stream.objectTypeIndication = png ? oti::kPng : oti::kJpeg;
    stream.streamType = StreamType::visual;
    stream.fileName = std::move(fileName) + (png ? ".png" : ".jpg");
    Sample sample;
    sample.duration = stream.timescale;
    sample.data = ByteRange::of(std::move(bytes));
    stream.samples.push_back(std::move(sample));
    ObjectDescriptor od;
    od.id = id;
    od.streams.push_back(std::move(stream));
    update.descriptors.push_back(std::move(od));
    Url url;
    url.objectDescriptorId = id;
    return url;
}

Result<Url> addPictureStream(UpdateObjectDescriptors& update, std::string fileName, Bytes bytes,
                             PictureSpool* spool) {
    ByteRange place;
    if (spool) STX_SET(place, spool->add(bytes));
    const Url url = addPictureStream(update, std::move(fileName), std::move(bytes));
    if (spool) update.descriptors.back().streams.front().samples.front().data = place;
    return url;
}

Document newDocument(NodePtr root, UpdateObjectDescriptors update, glm::ivec2 size) {
    Document document;
    document.sceneStream.esId = 1;
    document.sceneStream.streamType = StreamType::sceneDescription;
    document.sceneStream.objectTypeIndication = oti::kSystemsV1;
    document.bifsConfig.hasSize = true;
    document.bifsConfig.pixelWidth = size.x;
    document.bifsConfig.pixelHeight = size.y;
    ReplaceScene scene;
    scene.useNames = true;
    scene.root = std::move(root);
    CommandFrame frame;
    frame.commands.emplace_back(std::move(scene));
    document.frames.push_back(std::move(frame));
    if (!update.descriptors.empty()) {
        document.odStream.esId = 2;
        document.odStream.streamType = StreamType::objectDescriptor;
        document.odStream.objectTypeIndication = oti::kSystemsV1;
        OdFrame odFrame;
        odFrame.commands.emplace_back(std::move(update));
        document.odFrames.push_back(std::move(odFrame));
    }
    return document;
}

}  // namespace stx::mpeg4
