#include <fstream>

#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"

namespace stx {
namespace {

using nlohmann::json;

void expectError(const Error& error, ErrorCode code, const std::string& words) {
    EXPECT_EQ(static_cast<int>(error.code), static_cast<int>(code)) << error.text();
    EXPECT_NE(error.text().find(words), std::string::npos) << error.text();
    EXPECT_EQ(error.text().find('\n'), std::string::npos) << error.text();
}

TEST(MalformedFiles, AllEndInOneSentenceOrAMesh) {
    REQUIRE_SHARED(folder, "data/malformed/meshes");
    int files = 0, read = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (!entry.is_regular_file() || !isMesh(entry.path())) continue;
        SCOPED_TRACE(entry.path().string());
        ++files;
        Job job;
        job.limits.maxMemoryBytes = 256 << 20;
        const auto mesh = readMesh(entry.path(), job);
        if (mesh) {
            ++read;
            EXPECT_TRUE(mesh->check());
            continue;
        }
        EXPECT_TRUE(mesh.error().code == ErrorCode::invalidInput ||
                    mesh.error().code == ErrorCode::io ||
                    mesh.error().code == ErrorCode::unsupported)
            << mesh.error().text();
        EXPECT_FALSE(mesh.error().message.empty());
        EXPECT_EQ(mesh.error().message.find('\n'), std::string::npos) << mesh.error().message;
    }
    EXPECT_GE(files, 180);
    EXPECT_GE(read, 20);  // many of them can be read in spite of all
}

TEST(MalformedFiles, ErrorsNameTheirObject) {
    REQUIRE_SHARED(folder, "data/malformed/meshes");
    struct Case {
        const char* file;
        ErrorCode code;
        const char* words;
    };
    for (const auto& [file, code, words] : {
             Case{"assimp/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb",
                  ErrorCode::invalidInput,
                  "accessors[2] (meshes[0].primitives[0] POSITION): vertex 0"},
             {"assimp/IndexOutOfRange/IndexOutOfRange.gltf", ErrorCode::invalidInput,
              "accessors[0]"},
             {"assimp/MissingBin/BoxTextured.gltf", ErrorCode::io, "buffers[0]"},
             {"assimp/RecursiveNodes/RecursiveNodes.gltf", ErrorCode::invalidInput,
              "its own ancestor"},
             {"assimp/SchemaFailures/sceneWrongType.gltf", ErrorCode::invalidInput, "is a string"},
             {"assimp/wrongTypes/badUint.gltf", ErrorCode::invalidInput,
              "baseColorTexture.index is -1"},
             {"assimp/empty.obj", ErrorCode::invalidInput, "empty"},
             {"draco/inf_nan.obj", ErrorCode::invalidInput, "vertex 0 is at (inf"},
             {"draco/degenerate_mesh.obj", ErrorCode::invalidInput, "none with an area"},
             {"glTF-Validator/glb/truncated_chunk_data.glb", ErrorCode::invalidInput, "chunk"},
             {"glTF-Validator/glb/invalid_magic.glb", ErrorCode::invalidInput,
              "begins with 'glTF'"},
             {"glTF-Validator/glb/invalid_json_chunk.glb", ErrorCode::invalidInput, "JSON"},
             {"glTF-Validator/mesh/accessor_unequal_count.gltf", ErrorCode::invalidInput,
              "COLOR_0 has 4 elements, POSITION has 3"},
             {"tinyobj/issue-140-zero-face-idx.obj", ErrorCode::invalidInput, "face index"},
             {"trimesh/empty.stl", ErrorCode::invalidInput, "neither triangles nor points"},
         }) {
        SCOPED_TRACE(file);
        Job job;
        const auto mesh = readMesh(folder / file, job);
        ASSERT_FALSE(mesh);
        expectError(mesh.error(), code, words);
        // The file is named, too.
        EXPECT_NE(mesh.error().text().find(std::filesystem::path(file).filename().string()),
                  std::string::npos);
    }
}

TEST(Malformed, MissingFilesAndFolders) {
    Job job;
    const auto missing = readMesh("no/such/model.glb", job);
    ASSERT_FALSE(missing);
    expectError(missing.error(), ErrorCode::io, "no/such/model.glb");
    const auto folder = readMesh(std::filesystem::temp_directory_path(), job);
    ASSERT_FALSE(folder);
    EXPECT_EQ(folder.error().code, ErrorCode::io);
    expectError(readBadText("hello", "a.txt"), ErrorCode::invalidInput, "not a model");
    expectError(readBadText("\x89PNG\r\n\x1a\n....", "a.glb"), ErrorCode::invalidInput, "'glTF'");
    expectError(readBadText("\x89PNG\r\n\x1a\n....", "a.ply"), ErrorCode::invalidInput, "'ply'");
    expectError(readBadText("\x89PNG\r\n\x1a\n....", "a.drc"), ErrorCode::invalidInput, "Draco");
}

TEST(Malformed, GltfClaimsAreHeldAgainstTheData) {
    const auto with = [](auto change) {
        GltfText gltf;
        gltf.addQuad();
        change(gltf);
        Limits limits;
        limits.maxMemoryBytes = 64 << 20;
        return readBadText(gltf.text(), "a.gltf", limits);
    };
    expectError(with([](GltfText& g) { g.root["accessors"][0]["count"] = 4000000000u; }),
                ErrorCode::invalidInput, "accessors[0]");
    expectError(with([](GltfText& g) { g.root["accessors"][0]["byteOffset"] = 9007199254740991; }),
                ErrorCode::invalidInput, "accessors[0]");
    expectError(with([](GltfText& g) {
                    g.root["accessors"][0] = {
                        {"componentType", 5126}, {"type", "VEC3"}, {"count", 1000000000}};
                }),
                ErrorCode::invalidInput, "memory limit");
    expectError(with([](GltfText& g) { g.root["bufferViews"][0]["byteLength"] = 1 << 30; }),
                ErrorCode::invalidInput, "bufferViews[0]");
    expectError(with([](GltfText& g) { g.root["bufferViews"][0]["byteStride"] = 4; }),
                ErrorCode::invalidInput, "byteStride");
    expectError(with([](GltfText& g) { g.root["nodes"][0]["children"] = {7}; }),
                ErrorCode::invalidInput, "nodes[0] has the child 7");
    expectError(with([](GltfText& g) { g.root["nodes"][0]["mesh"] = 3; }), ErrorCode::invalidInput,
                "meshes[3]");
    expectError(with([](GltfText& g) { g.root["extensionsRequired"] = {"FOO_bar"}; }),
                ErrorCode::unsupported, "FOO_bar");
    expectError(with([](GltfText& g) { g.root["asset"]["version"] = "1.0"; }),
                ErrorCode::unsupported, "1.0");
    expectError(with([](GltfText& g) { g.root["meshes"][0]["primitives"][0]["mode"] = 9; }),
                ErrorCode::invalidInput, "mode is 9");
    expectError(with([](GltfText& g) {
                    g.root["nodes"][0]["scale"] = {1, 2};
                }),
                ErrorCode::invalidInput, "nodes[0].scale has 2 elements");
}

TEST(Malformed, NodesWithManyParentsDoNotExplode) {
    GltfText gltf;
    gltf.addQuad();
    // 40 levels, each showing the next twice: 2^40 quads.
    auto& nodes = gltf.root["nodes"];
    nodes = json::array();
    for (int i = 0; i < 40; ++i) nodes.push_back({{"children", {i + 1, i + 1}}});
    nodes.push_back({{"mesh", 0}});
    expectError(readBadText(gltf.text(), "a.gltf"), ErrorCode::invalidInput,
                "more than 1048576 nodes");
}

TEST(Malformed, DeepNestingIsNoTrouble) {
    std::string deep(1000000, '[');
    expectError(readBadText("{\"asset\":" + deep, "a.gltf"), ErrorCode::invalidInput, "JSON");
    GltfText gltf;
    gltf.addQuad();
    auto& nodes = gltf.root["nodes"];
    nodes = json::array();
    for (int i = 0; i < 20000; ++i) nodes.push_back({{"children", {i + 1}}});
    nodes.push_back({{"mesh", 0}});
    EXPECT_EQ(readGoodText(gltf.text(), "a.gltf").mesh.triangles.size(), 2u);
}

TEST(Malformed, PlyClaimsAreHeldAgainstTheData) {
    const std::string head = "ply\nformat ascii 1.0\n";
    expectError(readBadText(head + "element vertex 4000000000\nproperty float x\nproperty float y\n"
                                   "property float z\nend_header\n0 0 0\n",
                            "a.ply"),
                ErrorCode::invalidInput, "4000000000 vertex elements");
    expectError(
        readBadText(head +
                        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                        "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
                    "a.ply"),
        ErrorCode::invalidInput, "face 0 uses vertex 7, but there are only 3");
    expectError(readBadText(head + "element vertex 2\nproperty float x\nproperty float y\n"
                                   "property float z\nend_header\n0 0 0\n1 zero 0\n",
                            "a.ply"),
                ErrorCode::invalidInput, "vertex 1 of 2");
    expectError(readBadText(head + "element vertex 1\nproperty floot x\nend_header\n0\n", "a.ply"),
                ErrorCode::invalidInput, "line 4: unknown property type 'floot'");
    expectError(readBadText("ply\nformat ascii 1.0\nelement vertex 3\n", "a.ply"),
                ErrorCode::invalidInput, "end_header");
    // Points of the second list have colours, those of the first do not; one has no place.
    const std::string place = "property float x\nproperty float y\nproperty float z\n";
    expectError(readBadText(head + "element vertex 2\n" + place + "element vertex 1\n" + place +
                                "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                                "end_header\n0 0 0\n1e999 0 0\n1 0 0 9 9 9\n",
                            "a.ply"),
                ErrorCode::invalidInput, "two lists of 'vertex'");
}

TEST(Malformed, DracoStreamsCutShort) {
    REQUIRE_SHARED(path, "data/meshes/drc/car.drc");
    Job job;
    auto whole = readFile(path, job.limits);
    ASSERT_TRUE(whole);
    for (const std::size_t size : {5u, 11u, 12u, 20u, 100u, 1000u, 10000u, 69000u}) {
        SCOPED_TRACE(size);
        const auto mesh = readMesh(Bytes(whole->begin(), whole->begin() + size), "car.drc", job);
        ASSERT_FALSE(mesh);
        EXPECT_EQ(mesh.error().code, ErrorCode::invalidInput);
    }
    // A point cloud that claims 2^31 - 1 points.
    const unsigned char claim[] = {'D', 'R', 'A',  'C',  'O',  2,    3, 0, 0,
                                   0,   0,   0xff, 0xff, 0xff, 0x7f, 1, 0, 0};
    expectError(
        readBadText(std::string(reinterpret_cast<const char*>(claim), sizeof claim), "a.drc"),
        ErrorCode::invalidInput, "memory limit");
}

TEST(Malformed, MaterialFilesOutsideAreNotRead) {
    TemporaryFolder folder;
    std::filesystem::create_directories(folder / "model");
    const auto write = [&](const std::string& name, const std::string& text) {
        std::ofstream(folder / name) << text;
    };
    const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    write("secret.mtl", "newmtl red\nKd 1 0 0\n");
    write("model/a.obj", "mtllib ../secret.mtl\n" + triangle);
    const auto without = readGood(folder / "model/a.obj");
    EXPECT_FALSE(without.mesh.materials.at(without.mesh.triangleMaterial[0]).hasColour);
    EXPECT_TRUE(without.hasNote("--allow-outside"));
    // The same name with the file beside the model.
    write("model/secret.mtl", "newmtl red\nKd 0 0 1\n");
    const auto beside = readGood(folder / "model/a.obj");
    EXPECT_EQ(beside.mesh.materials.at(beside.mesh.triangleMaterial[0]).baseColour,
              glm::vec4(0, 0, 1, 1));
    EXPECT_TRUE(beside.hasNote("'../secret.mtl' is not there; 'secret.mtl' is taken instead"));
}

}  // namespace
}  // namespace stx
