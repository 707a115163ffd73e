// The table of nodes against the facts it was made from, and the scene graph's own rules.

#include <charconv>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/mpeg4/scene/scene.hpp"
#include "tests/same_scenes.hpp"
#include "tests/shared_data.hpp"

namespace stx::mpeg4 {
namespace {

/// The words of a default; numbers as floats, so that 0.785398 is 0.78539801.
std::vector<std::string> words(const std::string& text) {
    std::vector<std::string> all;
    std::string word;
    for (const char c : text + " ") {
        if (std::string_view(" ,[]\"").find(c) == std::string_view::npos) {
            word += c;
        } else if (!word.empty()) {
            float number = 0;
            const auto parsed = std::from_chars(word.data(), word.data() + word.size(), number);
            all.push_back(parsed.ec == std::errc{} ? fmt::format("{}", number) : word);
            word.clear();
        }
    }
    return all;
}

/// "[-I, 3]" as numbers; I is infinite.
std::pair<float, float> bounds(const std::string& text) {
    const auto number = [](std::string word) {
        const bool infinite = word.back() == 'I';
        const float sign = word.front() == '-' ? -1.0f : 1.0f;
        return infinite ? sign * std::numeric_limits<float>::max() : std::stof(word);
    };
    const auto comma = text.find(',');
    return {number(text.substr(1, comma - 1)),
            number(text.substr(comma + 2, text.size() - comma - 3))};
}

TEST(NodeTable, EveryNodeFieldCodeAndIdIsThatOfTheFacts) {
    REQUIRE_SHARED(path, "reference/facts/nodes-all.json");
    std::ifstream file(path);
    const auto all = nlohmann::json::parse(file);
    for (const auto& [type, versions] : all["ndt_bits"].items())
        for (int version = 1; version <= kNdtVersions; ++version) {
            const auto number = std::to_string(version);
            const int none = version == 2 ? 1 : 0;  // code 1 of version 2 is an instance of a PROTO
            ASSERT_TRUE(ndtOfName(type)) << type;
            EXPECT_EQ(codeBits(*ndtOfName(type), version),
                      versions.contains(number) ? versions[number].get<int>() : none)
                << type << " version " << version;
        }
    const auto& facts = all["nodes"];
    EXPECT_EQ(facts.size(), allNodes().size());
    for (const auto& [nodeName, fact] : facts.items()) {
        SCOPED_TRACE(nodeName);
        const NodeInfo* info = findNode(nodeName);
        ASSERT_NE(info, nullptr);
        for (const auto& code : fact["ndt"]) {
            const std::string type = code["ndt"];
            const NodeCode* ours = nullptr;
            for (const NodeCode& c : info->codes)
                if (name(c.type) == type) ours = &c;
            ASSERT_NE(ours, nullptr) << type;
            EXPECT_EQ(ours->version, code["version"]);
            // The facts number the nodes of a table; version 2 has the PROTOs before them.
            EXPECT_EQ(ours->code, code["code"].get<int>() + (ours->version == 2 ? 1 : 0));
            EXPECT_EQ(codeBits(ours->type, ours->version), code["bits"].get<int>());
            EXPECT_EQ(findNode(ours->type, ours->version, ours->code), info);
        }
        EXPECT_EQ(info->codes.size(), fact["ndt"].size());
        ASSERT_EQ(info->fields.size(), fact["fields"].size());
        for (const FieldInfo& field : info->fields) {
            const auto& f = fact["fields"][static_cast<std::size_t>(field.index)];
            SCOPED_TRACE(field.name);
            const auto number = [&](const char* key) {
                return f[key].is_null() ? -1 : f[key].get<int>();
            };
            EXPECT_EQ(field.name, f["name"]);
            EXPECT_EQ(name(field.kind), f["kind"]);
            EXPECT_EQ(name(field.type), f["type"]);
            if (!f["default"].is_null() && f["default"] != "NULL") {
                EXPECT_EQ(words(field.defaultText), words(f["default"]));
            }
            if (!f["bounds"].is_null()) {
                EXPECT_EQ(field.minimum, bounds(f["bounds"]).first);
                EXPECT_EQ(field.maximum, bounds(f["bounds"]).second);
            }
            EXPECT_EQ(field.defId, number("def"));
            EXPECT_EQ(field.inId, number("in"));
            EXPECT_EQ(field.outId, number("out"));
            EXPECT_EQ(field.dynId, number("dyn"));
            EXPECT_EQ(static_cast<int>(field.quantisation), std::max(0, number("quant")));
            EXPECT_EQ(field.quantisationBits, std::max(0, number("quant_bits")));
            EXPECT_EQ(name(field.nodeType),
                      f["node_ndt"].is_null() ? "none" : f["node_ndt"].get<std::string>());
        }
    }
}

TEST(NodeTable, DefaultsHaveTheBitsOfTheStandard) {
    const auto bits = [](float f) { return std::bit_cast<std::uint32_t>(f); };
    const NodePtr view = makeNode("DepthImage");
    EXPECT_EQ(bits(view->get<glm::vec2>("fieldOfView").x), 0x3F490FD8u);
    EXPECT_TRUE(view->get<bool>("orthographic"));
    EXPECT_EQ(view->get<glm::vec3>("position"), glm::vec3(0, 0, 10));
    EXPECT_EQ(view->get<Rotation>("orientation"), (Rotation{{0, 0, 1}, 0}));
    const NodePtr second = makeNode("DepthImageV2");
    EXPECT_EQ(bits(second->get<glm::vec2>("fieldOfView").x), 0x3F400000u);
    EXPECT_EQ(bits(second->get<glm::vec2>("splatMinMax").x), 0x3DEB851Fu);
    EXPECT_EQ(bits(second->get<glm::vec2>("splatMinMax").y), 0x3F79999Au);
    const NodePtr navigation = makeNode("NavigationInfo");
    EXPECT_EQ(navigation->get<std::vector<float>>("avatarSize"),
              (std::vector<float>{0.25f, 1.6f, 0.75f}));
    EXPECT_EQ(navigation->get<std::vector<std::string>>("type"),
              (std::vector<std::string>{"WALK", "ANY"}));
    EXPECT_EQ(makeNode("Background")->get<std::vector<Color>>("skyColor"),
              std::vector<Color>{Color{}});
    EXPECT_EQ(makeNode("Switch")->get<std::int32_t>("whichChoice"), -1);
    EXPECT_EQ(makeNode("QuantizationParameter")->get<float>("scaleMax"),
              std::numeric_limits<float>::max());
    EXPECT_EQ(makeNode("FAP")->get<std::int32_t>("open_jaw"),
              std::numeric_limits<std::int32_t>::max());
    EXPECT_EQ(makeNode("Quadric")->get<glm::vec4>("P0"), glm::vec4(-1, 0, 0, 1));
    EXPECT_EQ(makeNode("PositionAnimator")->get<std::vector<glm::vec2>>("keySpline"),
              (std::vector<glm::vec2>{{0, 0}, {1, 1}}));
    EXPECT_EQ(makeNode("FontStyle")->get<std::vector<std::string>>("justify"),
              std::vector<std::string>{"BEGIN"});
}

TEST(NodeTable, KnowsWhatMayStandWhere) {
    EXPECT_TRUE(mayStandIn(makeNode("SimpleTextureV2").get(), Ndt::SFDepthTextureNode));
    EXPECT_TRUE(mayStandIn(makeNode("DepthImageV2").get(), Ndt::SFDepthImageNode));
    EXPECT_TRUE(mayStandIn(nullptr, Ndt::SFTextureNode));
    EXPECT_FALSE(mayStandIn(makeNode("SimpleTexture").get(), Ndt::SF3DNode));
    EXPECT_FALSE(mayStandIn(makeNode("DepthImage").get(), Ndt::SF2DNode));
    EXPECT_FALSE(mayStandIn(makeNode("Transform").get(), Ndt::SFTopNode));
    EXPECT_EQ(makeNode("NoSuchNode"), nullptr);
    EXPECT_EQ(findNode("ImageTexture")->findIgnoringCase("REPEATs"), 1);
}

TEST(NodeTable, DefaultsOfAllFieldsAreOfTheirType) {
    std::size_t fields = 0;
    for (const NodeInfo& info : allNodes())
        for (const FieldInfo& field : info.fields) {
            EXPECT_EQ(typeOf(defaultValue(info, field.index)), field.type)
                << info.name << '.' << field.name;
            ++fields;
        }
    EXPECT_EQ(allNodes().size(), 195u);
    EXPECT_GT(fields, 1700u);
}

TEST(Scene, FieldsTakeTheirTypeOnly) {
    const NodePtr view = makeNode("DepthImage");
    EXPECT_FALSE(view->set("position", 1.0f));
    EXPECT_FALSE(view->set("noSuchField", 1.0f));
    EXPECT_FALSE(view->isSet("position"));
    EXPECT_TRUE(view->set("position", glm::vec3(1, 2, 3)));
    EXPECT_TRUE(view->isSet("position"));
    view->clear(view->info->find("position"));
    EXPECT_EQ(view->get<glm::vec3>("position"), glm::vec3(0, 0, 10));
    EXPECT_FALSE(makeNode("Group")->set("addChildren", NodeList{})) << "an event has no value";
}

TEST(Scene, ComparesSharingAndBits) {
    const auto build = [](bool shared, float far) {
        const NodePtr root = makeNode("Group");
        const NodePtr texture = makeNode("SimpleTexture");
        for (int i = 0; i < 2; ++i) {
            const NodePtr view = makeNode("DepthImage");
            view->set("diTexture", shared ? texture : makeNode("SimpleTexture"));
            view->set("farPlane", far);
            root->edit<NodeList>("children").push_back(view);
        }
        return root;
    };
    EXPECT_TRUE(sameNode(build(true, 3), build(true, 3)));
    EXPECT_TRUE(sameNode(build(false, 100), build(false, 100)));
    EXPECT_FALSE(sameNode(build(true, 3), build(false, 3)));
    EXPECT_FALSE(sameNode(build(true, 3), build(true, 4)));
    EXPECT_FALSE(sameNode(build(true, 0.0f), build(true, -0.0f)));
}

TEST(Scene, DeepChainsTakeNoStack) {
    NodePtr chain = makeNode("Group");
    for (int i = 0; i < 100'000; ++i) {
        const NodePtr outer = makeNode("Group");
        outer->edit<NodeList>("children").push_back(std::move(chain));
        chain = outer;
    }
    EXPECT_EQ(nestingDepth(chain).value_or(0), 100'001);
    EXPECT_TRUE(sameNode(chain, chain));
}

TEST(Scene, CyclesAreFound) {
    const NodePtr outer = makeNode("Group");
    const NodePtr inner = makeNode("Group");
    outer->edit<NodeList>("children").push_back(inner);
    EXPECT_EQ(nestingDepth(outer).value_or(0), 2);
    inner->edit<NodeList>("children").push_back(outer);
    EXPECT_FALSE(nestingDepth(outer));
    inner->setFields.clear();  // or it would never be freed

    // A command that would make one.
    CommandFrame frame;
    frame.commands.push_back(ReplaceScene{false, outer, {}});
    frame.commands.push_back(InsertNode{inner, {}, outer});
    const auto composed = composeScene({frame});
    ASSERT_FALSE(composed);
    EXPECT_NE(composed.error().text().find("command 2"), std::string::npos)
        << composed.error().text();
}

TEST(Scene, IdsAreGivenWhereTheyAreNeeded) {
    const NodePtr root = makeNode("Group");
    const NodePtr twice = makeNode("WorldInfo");
    const NodePtr named = makeNode("WorldInfo");
    const NodePtr numbered = makeNode("WorldInfo");
    const NodePtr plain = makeNode("WorldInfo");
    named->defName = "INFO";
    numbered->defId = 1;
    root->edit<NodeList>("children") = {twice, twice, named, numbered, plain};
    CommandFrame frame;
    frame.commands.push_back(ReplaceScene{false, root, {}});
    const NodeIds ids = assignNodeIds({frame});
    EXPECT_EQ(ids.nodes.at(numbered.get()), 1u);
    EXPECT_EQ(ids.nodes.at(twice.get()), 2u);
    EXPECT_EQ(ids.nodes.at(named.get()), 3u);
    EXPECT_FALSE(ids.nodes.contains(plain.get()));
    EXPECT_EQ(ids.highestNode, 3u);
}

}  // namespace
}  // namespace stx::mpeg4
