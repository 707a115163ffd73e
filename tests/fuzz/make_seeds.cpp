// Makes the seeds of corpus/mp4, corpus/bifs, corpus/od and corpus/photos: `make_seeds
// tests/fuzz/corpus`.

#include <cstdio>
#include <filesystem>

#include "formats/files/byte_io.hpp"
#include "formats/mpeg4/bifs/descriptors.hpp"
#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "tests/made_photos.hpp"

using namespace stx;
using namespace stx::mpeg4;

namespace {

std::filesystem::path corpus;

void save(const std::string& name, ByteSpan bytes) {
    std::filesystem::create_directories((corpus / name).parent_path());
    if (auto done = writeFile(corpus / name, bytes); !done)
        std::fprintf(stderr, "%s\n", done.error().text().c_str());
}

Bytes png() {
    ByteWriter out;
    out.u64(0x89504E470D0A1A0Aull);
    out.u32(13);
    out.u32(0x49484452);
    out.u32(2);
    out.u32(2);
    for (const std::uint8_t b : {8, 2, 0, 0, 0}) out.u8(b);
    return out.take();
}

NodePtr image(int od) {
    const NodePtr node = makeNode("ImageTexture");
    node->set("url", std::vector<Url>{Url{od, ""}});
    return node;
}

NodePtr view(const char* type, const char* texture) {
    const NodePtr node = makeNode(type);
    const NodePtr inside = makeNode(texture);
    for (const FieldInfo& field : inside->info->fields)
        if (field.nodeType == Ndt::SFTextureNode) inside->set(field.index, image(10 + field.index));
    node->set("diTexture", inside);
    node->set("orthographic", false);
    node->set("position", glm::vec3(1, 2, 3));
    return node;
}

CommandFrame scene(NodeList children, std::vector<Route> routes = {}, bool names = false) {
    const NodePtr root = makeNode("Group");
    root->set("children", std::move(children));
    return {0, {ReplaceScene{names, root, std::move(routes)}}};
}

/// Every node type of the table that may stand among children, with all fields set.
NodeList oneOfEach() {
    NodeList nodes;
    for (const NodeInfo& info : allNodes()) {
        if (info.codeIn(Ndt::SF3DNode) == nullptr || info.name == "QuantizationParameter") continue;
        const NodePtr node = makeNode(info);
        for (const FieldInfo& field : info.fields)
            if (field.hasValue() && itemType(field.type) != FieldType::SFNode)
                node->set(field.index, defaultValue(info, field.index));
        nodes.push_back(node);
    }
    return nodes;
}

/// A PROTO with a Script in it, its instance, and a Script with fields of its own.
std::vector<CommandFrame> protos() {
    Job job;
    const auto document = readBt(R"(
EXTERNPROTO Far [ field SFColor c 1 0 0 ] ["far.mp4#Far"]
PROTO View [ field SFVec3f place 0 0 10 exposedField SFVec3f shift 0 0 0 eventIn SFBool hit ] {
  PROTO Inner [ field MFNode more [] ] { Group { children IS more } }
  DEF T Transform { translation IS shift children [ DepthImage { position IS place } Inner { } ] }
  DEF S Script { eventIn SFBool go IS hit eventOut SFVec3f out url "javascript: function go() { out = 1; }" }
  ROUTE S.out TO T.translation
}
Group { children [
  DEF A View { place 1 2 3 } USE A View { shift 5 0 0 } Far { }
  DEF S Script { eventIn SFBool go field SFInt32 count 3 field SFNode target USE A url
    "javascript: function go(v) { for (var i = 0; i < 10; i++) { if (v && !(i % 2)) count += -i * 2.5e-1; else break; }
     switch (count) { case 1: return 'x'; default: o.f(a[1], new B()); } while (true) i = v ? 1 : 2; }" }
  DEF TOUCH TouchSensor { }
] }
ROUTE TOUCH.isActive TO S.go
)",
                                 "seed.bt", job);
    if (!document) std::fprintf(stderr, "%s\n", document.error().text().c_str());
    return document ? document->frames : std::vector<CommandFrame>();
}

std::vector<std::vector<CommandFrame>> scenes() {
    std::vector<std::vector<CommandFrame>> all;
    all.push_back({scene({view("DepthImage", "SimpleTexture")})});
    all.push_back(
        {scene({view("DepthImageV2", "SimpleTextureV2"), view("DepthImage", "PointTexture")})});
    all.push_back({scene(oneOfEach())});

    const NodePtr clock = makeNode("TimeSensor");
    const NodePtr path = makeNode("PositionInterpolator");
    const NodePtr transform = makeNode("Transform");
    clock->defName = "CLOCK";
    path->set("key", std::vector<float>{0, 1});
    path->set("keyValue", std::vector<glm::vec3>{{0, 0, 0}, {1, 1, 1}});
    const NodePtr shared = view("DepthImage", "SimpleTexture");
    transform->set("children", NodeList{shared, shared});
    const auto route = [](const NodePtr& from, const char* out, const NodePtr& to, const char* in) {
        return Route{0, "", from, from->info->find(out), to, to->info->find(in)};
    };
    all.push_back({scene({clock, path, transform},
                         {route(clock, "fraction_changed", path, "set_fraction"),
                          route(path, "value_changed", transform, "translation")},
                         true)});

    const NodePtr group = makeNode("Group");
    const NodePtr texture = image(12);
    CommandFrame first = scene({group});
    CommandFrame second{1000, {}};
    second.commands.push_back(InsertNode{group, {}, view("DepthImage", "SimpleTexture")});
    second.commands.push_back(InsertNode{group, {0}, makeNode("Viewpoint")});
    second.commands.push_back(
        ReplaceIndexed{group, group->info->find("children"), {0}, FieldValue(makeNode("Group"))});
    second.commands.push_back(DeleteIndexed{group, group->info->find("children"), {1}});
    second.commands.push_back(
        ReplaceField{group, group->info->find("children"), NodeList{makeNode("WorldInfo")}});
    CommandFrame third{2000, {ReplaceNode{group, makeNode("Transform")}}};
    all.push_back({first, second, third});

    const NodePtr quantisation = makeNode("QuantizationParameter");
    for (const char* name : {"position3DQuant", "scaleQuant", "sizeQuant"})
        quantisation->set(name, true);
    quantisation->set("position3DMin", glm::vec3(-16));
    quantisation->set("position3DMax", glm::vec3(16));
    quantisation->set("useEfficientCoding", true);
    const NodePtr light = makeNode("DirectionalLight");
    light->set("direction", glm::vec3(0, 1, 0));
    const NodePtr turned = makeNode("Transform");
    turned->set("rotation", Rotation{{0, 1, 0}, 0.5f});
    turned->set("translation", glm::vec3(1, 2, 3));
    turned->set("children", NodeList{view("DepthImage", "PointTexture"), makeNode("OctreeImage")});
    all.push_back({scene({quantisation, light, turned})});

    const NodePtr pixels = makeNode("PixelTexture");
    pixels->set("image", PixelImage{2, 2, 4, std::vector<std::uint8_t>(16, 200)});
    const NodePtr depthImage = makeNode("DepthImage");
    const NodePtr simple = makeNode("SimpleTexture");
    simple->set("texture", pixels);
    depthImage->set("diTexture", simple);
    all.push_back({scene({depthImage})});
    all.push_back(protos());
    return all;
}

void saveScene(const std::vector<CommandFrame>& frames, std::size_t number) {
    for (const bool shortest : {false, true}) {
        const BifsStyle style = shortest ? BifsStyle::shortest() : BifsStyle::maskAndVector();
        const std::string name = fmt::format("scene{}_{}", number, shortest ? "shortest" : "mask");
        const NodeIds ids = assignNodeIds(frames);
        const BifsConfig config = fitBifsConfig({}, ids);
        BifsEncoder encoder(config, style, ids);
        ByteWriter units;
        units.u8(static_cast<std::uint8_t>(config.nodeIdBits | (config.version == 2 ? 128 : 0)));
        units.u8(static_cast<std::uint8_t>(config.routeIdBits | config.protoIdBits << 5));
        for (const CommandFrame& frame : frames) {
            const auto bytes = encoder.encode(frame.commands);
            if (!bytes)
                return static_cast<void>(
                    std::fprintf(stderr, "%s\n", bytes.error().text().c_str()));
            units.u8(bytes->size() < 256 ? static_cast<std::uint8_t>(bytes->size()) : 0);
            units.bytes(*bytes);
        }
        save("bifs/" + name, units.view());

        Document document;
        document.frames = frames;
        UpdateObjectDescriptors update;
        for (int id = 10; id < 15; ++id) {
            ElementaryStream stream;
            stream.samples.emplace_back().data = ByteRange::of(png());
            update.descriptors.push_back({id, "", {stream}});
        }
        document.odFrames.push_back({0, {update}});
        Job job;
        const auto mp4 = writeMp4(document, job, {style});
        if (mp4) save("mp4/" + name + ".mp4", *mp4);
    }
}

void saveDescriptors() {
    const auto withKind = [](std::uint8_t kind, ByteSpan bytes) {
        ByteWriter out;
        out.u8(kind);
        out.bytes(bytes);
        return out.take();
    };
    const auto referenceOf = [](std::uint32_t) { return 1u; };
    ElementaryStream reference;
    reference.esId = 10;
    std::vector<OdCommand> commands;
    commands.push_back(
        UpdateObjectDescriptors{{{10, "", {reference}}, {11, "http://example.org/od", {}}}});
    commands.push_back(RemoveObjectDescriptors{{10, 11, 1022}});
    commands.push_back(UpdateStreams{10, {reference}});
    commands.push_back(RemoveStreams{10, {10}});
    commands.push_back(OtherOdCommand{5, Bytes(3)});
    for (std::size_t i = 0; i < commands.size(); ++i)
        if (const auto bytes = encodeOdFrame({commands[i]}, referenceOf))
            save(fmt::format("od/command{}", i), withKind(0, *bytes));
    if (const auto bytes = encodeOdFrame(commands, referenceOf))
        save("od/commands", withKind(0, *bytes));
    const std::vector<std::uint32_t> tracks = {1, 2};
    if (const auto bytes = encodeIod({}, tracks)) save("od/iod", withKind(1, *bytes));
    ElementaryStream stream;
    stream.objectTypeIndication = oti::kJpeg;
    stream.streamType = StreamType::visual;
    stream.decoderSpecificInfo = Bytes(7, std::byte{1});
    stream.ocrEsId = 1;
    stream.dependsOnEsId = 2;
    stream.url = "x";
    if (const auto bytes = encodeEsDescriptor(stream)) save("od/stream", withKind(2, *bytes));
}

void savePhotos() {
    save("photos/apple.jpg", made::applePhoto(6));
    save("photos/gdepth.jpg", made::gdepthPhoto());
    save("photos/dynamic.jpg", made::dynamicPhoto());
    save("photos/samsung.jpg", made::samsungPhoto());
    save("photos/huawei.jpg", made::huaweiPhoto());
    save("photos/two_targets.heic", made::heicBoxes(1, 2));
    const std::string xmp = made::appleXmp();
    save("photos/apple.xmp", std::as_bytes(std::span(xmp)));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 1;
    corpus = argv[1];
    const auto all = scenes();
    for (std::size_t i = 0; i < all.size(); ++i) saveScene(all[i], i);
    saveDescriptors();
    savePhotos();
    return 0;
}
