#include "formats/atlas/atlas_json.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace stx {

namespace {

using Json = nlohmann::ordered_json;

/// 3: several objects; 2: quaternions are x y z w, as in all JSON here; 1 had w x y z. What has one
/// model is written as 2.
constexpr int kVersion = 3;

Json arrayOf(glm::dvec2 v) {
    return Json::array({v.x, v.y});
}
Json arrayOf(glm::dvec3 v) {
    return Json::array({v.x, v.y, v.z});
}
Json arrayOf(glm::dvec4 v) {
    return Json::array({v.x, v.y, v.z, v.w});
}

Json jsonOf(const ReferenceView& v) {
    const Camera& c = v.camera;
    Json j;
    j["name"] = v.name;
    j["width"] = c.width;
    j["height"] = c.height;
    j["position"] = arrayOf(c.position);
    j["orientation"] = arrayOf(axisAngleFromQuat(c.orientation));
    j["quaternion"] =
        Json::array({c.orientation.x, c.orientation.y, c.orientation.z, c.orientation.w});
    j["fieldOfView"] = arrayOf(c.fieldOfView());
    j["orthographic"] = c.orthographic;
    j["fx"] = c.fx;
    j["fy"] = c.fy;
    j["cx"] = c.cx;
    j["cy"] = c.cy;
    j["nearPlane"] = v.nearPlane;
    j["farPlane"] = v.farPlane;
    j["depthBits"] = v.depthBits;
    if (v.noDepth == NoDepth::unknown) j["noDepth"] = nameOf(v.noDepth);
    if (v.masked) j["masked"] = *v.masked;
    if (!v.refined.steps.empty()) j["refined"] = v.refined.text();
    j["pruned"] = v.pruned;
    if (v.background) j["background"] = true;
    return j;
}

Json jsonOf(const AtlasRectangle& r) {
    return {{"view", r.view},     {"page", r.page},     {"viewX", r.viewX},
            {"viewY", r.viewY},   {"width", r.width},   {"height", r.height},
            {"atlasX", r.atlasX}, {"atlasY", r.atlasY}, {"turned", r.turned}};
}

Json jsonOf(const Bounds& bounds) {
    return {{"min", arrayOf(bounds.min)}, {"max", arrayOf(bounds.max)}};
}

Json jsonOf(const AtlasObject& o) {
    Json j = {{"name", o.name}};
    if (!o.title.empty()) j["title"] = o.title;
    j["firstView"] = o.firstView;
    j["views"] = o.views;
    if (o.bounds && !o.bounds->empty()) j["bounds"] = jsonOf(*o.bounds);
    if (o.origin != glm::dvec3(0.0)) j["origin"] = arrayOf(o.origin);
    j["pixels"] = {{"source", o.sourcePixels}, {"kept", o.keptPixels}};
    return j;
}

/// The second picture of a texture.
const char* secondName(const AtlasTexture& t) {
    return t.attribute == "splat" ? "splatV" : "alpha";
}

Json jsonOf(const AtlasTexture& t) {
    Json j = {{"attribute", t.attribute}, {"page", t.page}};
    if (!t.file.empty()) j["file"] = t.file;
    j["coding"] = t.coding;
    j["width"] = t.width;
    j["height"] = t.height;
    if (t.coding == "snorm16" || t.coding == "sRGB8-emissive") j["scale"] = t.scale;
    if (t.hasSecond()) j[secondName(t)] = Json::array({t.secondX, t.secondY});
    return j;
}

/// "name": [ one entry a line ]. Long lists stay readable, and a diff shows what changed.
template <class List>
std::string linesOf(const char* name, const List& list) {
    std::string text = fmt::format("  \"{}\": [", name);
    const char* separator = "\n    ";
    for (const auto& entry : list) {
        text += separator + jsonOf(entry).dump(-1, ' ', false, Json::error_handler_t::replace);
        separator = ",\n    ";
    }
    return text + (list.empty() ? "]" : "\n  ]");
}

/// Typed access that says where in the document something is wrong.
class Reader {
  public:
    Reader(const Json& json, std::string path, const std::string& where, AtlasChecks checks)
        : json_(json), path_(std::move(path)), where_(where), checks_(checks) {}

    /// Whether values that break a rule of the validator are errors.
    [[nodiscard]] bool checksRules() const { return checks_ == AtlasChecks::all; }

    template <class T>
    Result<void> number(const char* name, T& to, double least, double most) const {
        const auto it = json_.find(name);
        if (it == json_.end()) return wrong(name, "is missing");
        constexpr bool whole = std::is_integral_v<T>;
        if (whole ? !it->is_number_integer() : !it->is_number())
            return wrong(name, whole ? "must be a whole number" : "must be a number");
        const double value = it->template get<double>();
        if (!(value >= least && value <= most))
            return wrong(name, fmt::format("is {}; {} to {} is possible", value, least, most));
        to = it->template get<T>();
        return {};
    }
    Result<void> positive(const char* name, double& to, double most) const {
        STX_CHECK(number(name, to, 0, most));
        if (!(to > 0)) return wrong(name, "is 0; it must be above 0");
        return {};
    }
    [[nodiscard]] bool has(const char* name) const { return json_.contains(name); }
    Result<void> finite(const char* name, double& to) const {
        return number(name, to, -1e300, 1e300);
    }
    Result<void> flag(const char* name, bool& to, bool needed = true) const {
        const auto it = json_.find(name);
        if (it == json_.end() && !needed) return {};
        if (it == json_.end() || !it->is_boolean()) return wrong(name, "must be true or false");
        to = it->get<bool>();
        return {};
    }
    Result<void> text(const char* name, std::string& to, bool needed = true) const {
        const auto it = json_.find(name);
        if (it == json_.end() && !needed) return {};
        if (it == json_.end() || !it->is_string()) return wrong(name, "must be a text");
        to = it->get<std::string>();
        return {};
    }
    template <std::size_t N>
    Result<void> vector(const char* name, std::array<double, N>& to) const {
        const auto it = json_.find(name);
        if (it == json_.end() || !it->is_array() || it->size() != N)
            return wrong(name, fmt::format("must be a list of {} numbers", N));
        for (std::size_t i = 0; i < N; ++i) {
            if (!(*it)[i].is_number()) return wrong(name, "holds something that is not a number");
            to[i] = (*it)[i].get<double>();
            if (!std::isfinite(to[i])) return wrong(name, "holds a number that is not finite");
        }
        return {};
    }
    /// Calls take(reader of entry) for each object in a list.
    template <class Take>
    Result<void> list(const char* name, std::size_t most, const Take& take) const {
        const auto it = json_.find(name);
        if (it == json_.end() || !it->is_array()) return wrong(name, "must be a list");
        if (it->size() > most)
            return wrong(name,
                         fmt::format("has {} entries; at most {} are read", it->size(), most));
        for (std::size_t i = 0; i < it->size(); ++i) {
            const Reader entry((*it)[i], fmt::format("{}{}[{}]", path_, name, i), where_, checks_);
            if (!(*it)[i].is_object()) return entry.wrong("", "must be an object");
            STX_CHECK(take(entry.inside()));
        }
        return {};
    }
    /// The object of that name, when it is there.
    [[nodiscard]] std::optional<Reader> object(const char* name) const {
        const auto it = json_.find(name);
        if (it == json_.end() || !it->is_object()) return std::nullopt;
        return Reader(*it, fmt::format("{}{}.", path_, name), where_, checks_);
    }
    [[nodiscard]] Reader inside() const { return {json_, path_ + ".", where_, checks_}; }
    [[nodiscard]] tl::unexpected<Error> wrong(const char* name, std::string_view what) const {
        return failAt(where_, ErrorCode::invalidInput, "{}{} {}", path_, name, what);
    }

  private:
    const Json& json_;
    std::string path_;
    const std::string& where_;
    AtlasChecks checks_;
};

/// The largest number of views or pixels that an int holds.
constexpr int kAnyInt = std::numeric_limits<int>::max();
/// A quarter of it, so that sums of a rectangle's numbers are ints, too.
constexpr int kAnyPixel = kAnyInt / 4;

Result<void> readView(const Reader& r, const Limits& limits, int version, bool prunedByCount,
                      ReferenceView& v) {
    Camera& c = v.camera;
    std::array<double, 3> position{};
    std::array<double, 4> q{};
    STX_CHECK(r.text("name", v.name));
    STX_CHECK(r.number("width", c.width, 1, limits.maxImageSide));
    STX_CHECK(r.number("height", c.height, 1, limits.maxImageSide));
    STX_CHECK(r.vector("position", position));
    STX_CHECK(r.vector("quaternion", q));
    STX_CHECK(r.flag("orthographic", c.orthographic));
    STX_CHECK(r.finite("fx", c.fx));
    STX_CHECK(r.finite("fy", c.fy));
    STX_CHECK(r.finite("cx", c.cx));
    STX_CHECK(r.finite("cy", c.cy));
    const double nearest = r.checksRules() ? 0 : -1e300;
    STX_CHECK(r.number("nearPlane", v.nearPlane, nearest, 1e300));
    STX_CHECK(r.number("farPlane", v.farPlane, nearest, 1e300));
    if (r.checksRules() && !(v.nearPlane < v.farPlane))
        return r.wrong("farPlane", "must be beyond nearPlane");
    STX_CHECK(r.number("depthBits", v.depthBits, 8, 32));
    if (r.checksRules() && v.depthBits != 8 && v.depthBits != 16 && v.depthBits != 32)
        return r.wrong("depthBits", "must be 8, 16 or 32");
    std::string noDepth = nameOf(v.noDepth);
    STX_CHECK(r.text("noDepth", noDepth, false));
    const auto named = noDepthNamed(noDepth);
    if (!named) return r.wrong("noDepth", "must be empty or unknown");
    v.noDepth = *named;
    if (r.has("masked")) STX_CHECK(r.flag("masked", v.masked.emplace()));
    std::string refined;
    STX_CHECK(r.text("refined", refined, false));
    if (!refined.empty()) {
        const auto found = Refined::from(refined);
        if (!found) return r.wrong("refined", "must be steps and a number: \"noise,agree 0.003\"");
        v.refined = *found;
    }
    // Older versions did not write it: there fewer pixels than before meant that all were pruned.
    v.pruned = prunedByCount;
    STX_CHECK(r.flag("pruned", v.pruned, false));
    STX_CHECK(r.flag("background", v.background, false));
    c.position = {position[0], position[1], position[2]};
    // The constructor takes w x y z.
    c.orientation =
        version == 1 ? glm::dquat(q[0], q[1], q[2], q[3]) : glm::dquat(q[3], q[0], q[1], q[2]);
    return {};
}

Result<void> readAgain(const Reader& r, AtlasHeader::Again& again) {
    if (r.has("fieldOfView")) {
        std::array<double, 2> angles{};
        STX_CHECK(r.vector("fieldOfView", angles));
        again.fieldOfView = {angles[0], angles[1]};
    }
    if (r.has("orientation")) {
        std::array<double, 4> rotation{};
        STX_CHECK(r.vector("orientation", rotation));
        again.orientation = {rotation[0], rotation[1], rotation[2], rotation[3]};
    }
    return {};
}

/// Bounds, origin and pixels of an atlas or of one of its objects.
template <class To>
Result<void> readPlace(const Reader& r, To& to) {
    if (const auto bounds = r.object("bounds")) {
        std::array<double, 3> min{}, max{};
        STX_CHECK(bounds->vector("min", min));
        STX_CHECK(bounds->vector("max", max));
        for (std::size_t i = 0; i < min.size(); ++i)
            if (min[i] > max[i])
                return r.wrong("bounds", fmt::format("have a min of {} above their max of {}; min "
                                                     "must not be above max",
                                                     min[i], max[i]));
        to.bounds = Bounds{{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
    }
    if (r.has("origin")) {
        std::array<double, 3> origin{};
        STX_CHECK(r.vector("origin", origin));
        to.origin = {origin[0], origin[1], origin[2]};
    }
    if (const auto pixels = r.object("pixels")) {
        STX_CHECK(pixels->number("source", to.sourcePixels, 0, 1e15));
        STX_CHECK(pixels->number("kept", to.keptPixels, 0, 1e15));
    }
    return {};
}

Result<void> readObject(const Reader& r, AtlasObject& o) {
    STX_CHECK(r.text("name", o.name));
    STX_CHECK(r.text("title", o.title, false));
    STX_CHECK(r.number("firstView", o.firstView, 0, kAnyInt));
    STX_CHECK(r.number("views", o.views, 0, kAnyInt));
    return readPlace(r, o);
}

Result<void> readTexture(const Reader& r, const Limits& limits, const AtlasHeader& header,
                         AtlasTexture& t) {
    STX_CHECK(r.text("attribute", t.attribute));
    const bool known = t.attribute == "colour" || t.attribute == "depth" ||
                       t.attribute == "normal" || t.attribute == "splat" ||
                       t.attribute == "metallic_roughness" || t.attribute == "emissive";
    if (!known)
        return r.wrong("attribute",
                       "must be colour, depth, normal, splat, metallic_roughness or emissive");
    STX_CHECK(r.number("page", t.page, 0, header.pages - 1));
    STX_CHECK(r.text("file", t.file, false));
    STX_CHECK(r.text("coding", t.coding));
    STX_CHECK(r.number("width", t.width, 1, limits.maxImageSide * 2.0));
    STX_CHECK(r.number("height", t.height, 1, limits.maxImageSide * 2.0));
    const bool vectors = t.attribute == "normal" || t.attribute == "splat";
    const auto is = [&](std::initializer_list<const char*> codings) {
        return std::find(codings.begin(), codings.end(), t.coding) != codings.end();
    };
    const bool fits =
        t.coding == "float" || (t.attribute == "colour" && is({"sRGB8", "sRGB8-opaque"})) ||
        (t.attribute == "depth" && is({"code8", "code16"})) || (vectors && t.coding == "snorm16") ||
        (t.attribute == "metallic_roughness" && t.coding == "unorm8") ||
        (t.attribute == "emissive" && t.coding == "sRGB8-emissive");
    if (!fits) return r.wrong("coding", fmt::format("is unknown for the {} texture", t.attribute));
    // An OpenEXR atlas has floats of both, and its textures no files of their own.
    const bool floats = t.coding == "float";
    if (t.attribute == "colour" && (header.linear ? !floats : floats && !t.file.empty()))
        return r.wrong("coding", fmt::format("is {}, but linear is {}; float goes with true, all "
                                             "others with false",
                                             t.coding, header.linear));
    int width = header.pageWidth, height = header.pageHeight;
    if (t.coding == "snorm16" || t.coding == "sRGB8-emissive")
        STX_CHECK(r.positive("scale", t.scale, 1e30));
    const char* second = secondName(t);
    const bool codes = t.coding == "code8" || t.coding == "code16";
    if ((t.coding == "snorm16" && t.attribute == "splat") || (codes && r.has(second))) {
        std::array<double, 2> start{};
        STX_CHECK(r.vector(second, start));
        const bool beside = start[0] == width && start[1] == 0;
        const bool below = start[0] == 0 && start[1] == height;
        if (!beside && !below)
            return r.wrong(second, "must be beside or below the first picture of its image");
        t.secondX = beside ? width : 0;
        t.secondY = beside ? 0 : height;
        width += t.secondX;
        height += t.secondY;
    }
    if (r.checksRules() && (t.width != width || t.height != height))
        return r.wrong("width", fmt::format("and height are {}x{}, but the page needs {}x{}",
                                            t.width, t.height, width, height));
    return {};
}

Result<void> checkTextures(const Reader& r, const AtlasHeader& header) {
    for (int page = 0; page < header.pages; ++page) {
        std::map<std::string, int> count;
        for (const auto& t : header.textures) count[t.attribute] += t.page == page ? 1 : 0;
        for (const auto& [attribute, n] : count) {
            if (n > 1)
                return r.wrong("textures",
                               fmt::format("hold two of {} for page {}", attribute, page));
        }
        int alpha = 0;  // colour without needs depth with it
        for (const auto& t : header.textures) {
            if (t.page != page) continue;
            if (t.coding == "sRGB8-opaque") ++alpha;
            if (t.attribute == "depth" && t.hasSecond()) --alpha;
        }
        if (alpha != 0)
            return r.wrong("textures", fmt::format("need alpha with the colour or with the depth "
                                                   "of page {}, not with both or none",
                                                   page));
        for (const char* needed : {"colour", "depth"}) {
            if (count[needed] != 1)
                return r.wrong("textures", fmt::format("lack the {} of page {}", needed, page));
        }
    }
    return {};
}

/// Deeper nesting than we ever write would only exhaust something.
Result<void> checkNesting(std::string_view text, const std::string& where, int most) {
    int depth = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quoted && c == '\\') ++i;
        if (c == '"') quoted = !quoted;
        if (quoted) continue;
        if (c == '[' || c == '{') ++depth;
        if (c == ']' || c == '}') --depth;
        if (depth > most)
            return failAt(where, ErrorCode::invalidInput,
                          "the JSON is nested more than {} deep at byte {}", most, i);
    }
    return {};
}

Result<Json> parse(std::string_view text, const std::string& where) {
    try {
        return Json::parse(text);
    } catch (const Json::parse_error& e) {
        return failAt(where, ErrorCode::invalidInput, "it is not valid JSON at byte {}", e.byte);
    } catch (const std::exception& e) {
        return failAt(where, ErrorCode::invalidInput, "it is not valid JSON: {}", e.what());
    }
}

}  // namespace

std::string atlasJson(const AtlasHeader& header) {
    const Atlas& atlas = header.atlas;
    Json top;
    const int version = atlas.objects.empty() ? 2 : kVersion;
    top["$schema"] = fmt::format("urn:stx:schema:atlas:{}", version);  // atlas.schema.json
    top["version"] = version;
    top["title"] = atlas.title;
    top["layout"] = atlas.layout;
    top["padding"] = atlas.padding;
    top["pages"] = header.pages;
    top["width"] = header.pageWidth;
    top["height"] = header.pageHeight;
    top["linear"] = header.linear;
    if (atlas.bounds && !atlas.bounds->empty()) top["bounds"] = jsonOf(*atlas.bounds);
    if (atlas.origin != glm::dvec3(0.0)) top["origin"] = arrayOf(atlas.origin);
    if (!header.environmentFile.empty()) top["environment"] = header.environmentFile;
    if (atlas.time) top["time"] = *atlas.time;
    if (atlas.duration) top["duration"] = *atlas.duration;
    top["pixels"] = {{"source", atlas.sourcePixels}, {"kept", atlas.keptPixels}};
    std::string text = "{\n";
    for (const auto& [key, value] : top.items())
        text += fmt::format("  \"{}\": {},\n", key,
                            value.dump(-1, ' ', false, Json::error_handler_t::replace));
    text += linesOf("textures", header.textures) + ",\n";
    if (!atlas.objects.empty()) text += linesOf("objects", atlas.objects) + ",\n";
    text += linesOf("views", atlas.views) + ",\n";
    text += linesOf("rectangles", atlas.rectangles) + "\n}\n";
    return text;
}

Result<AtlasHeader> atlasFromJson(std::string_view text, const std::string& where,
                                  const Limits& limits, AtlasChecks checks) {
    // A parsed document takes some 30 times its text.
    STX_CHECK(within(where, limits.checkAllocation(text.size(), 32, "the atlas' JSON")));
    STX_CHECK(checkNesting(text, where, std::min(limits.maxNesting, 16)));
    STX_TRY(const Json json, parse(text, where));
    if (!json.is_object())
        return failAt(where, ErrorCode::invalidInput, "it is not a JSON object, so not an atlas");
    const Reader top(json, "", where, checks);
    AtlasHeader header;
    Atlas& atlas = header.atlas;
    int version = 0;
    STX_CHECK(top.number("version", version, 1, kAnyInt));
    if (version > kVersion)
        return failAt(where, ErrorCode::unsupported,
                      "it was written by a newer stx (version {}; this one knows 1 to {})", version,
                      kVersion);
    STX_CHECK(top.text("title", atlas.title, false));
    STX_CHECK(top.text("layout", atlas.layout));
    if (atlas.layout != "grid" && atlas.layout != "tight")
        return top.wrong("layout", "must be grid or tight");
    STX_CHECK(top.number("padding", atlas.padding, 0, limits.maxImageSide));
    STX_CHECK(top.number("pages", header.pages, 1, top.checksRules() ? 2 : 64));
    STX_CHECK(top.number("width", header.pageWidth, 1, limits.maxImageSide));
    STX_CHECK(top.number("height", header.pageHeight, 1, limits.maxImageSide));
    STX_CHECK(top.flag("linear", header.linear));
    STX_CHECK(readPlace(top, atlas));
    if (json.contains("environment"))
        STX_CHECK(top.text("environment", header.environmentFile, false));
    if (top.has("time")) STX_CHECK(top.finite("time", atlas.time.emplace()));
    if (top.has("duration"))
        STX_CHECK(
            top.positive("duration", atlas.duration.emplace(), std::numeric_limits<double>::max()));
    STX_CHECK(
        top.list("textures", top.checksRules() ? 4 + 2 * header.pages : 256, [&](const Reader& r) {
            return readTexture(r, limits, header, header.textures.emplace_back());
        }));
    STX_CHECK(checkTextures(top, header));
    const auto readNextView = [&](const Reader& r) -> Result<void> {
        // Reading takes neither, so that only the validator looks at them.
        if (!r.checksRules()) STX_CHECK(readAgain(r, header.again.emplace_back()));
        return readView(r, limits, version, atlas.keptPixels < atlas.sourcePixels,
                        atlas.views.emplace_back());
    };
    STX_CHECK(top.list("views", static_cast<std::size_t>(limits.maxViews), readNextView));
    if (top.has("objects")) {
        STX_CHECK(top.list("objects", atlas.views.size(), [&](const Reader& r) {
            return readObject(r, atlas.objects.emplace_back());
        }));
        if (top.checksRules()) {
            if (const auto ok = checkObjects(atlas.objects, atlas.views.size()); !ok)
                return tl::unexpected(Error(ok.error()).at(where));
        }
    }
    const auto most = static_cast<std::size_t>(header.pageWidth) * header.pageHeight * header.pages;
    const auto readRectangle = [&](const Reader& r) -> Result<void> {
        AtlasRectangle& rect = atlas.rectangles.emplace_back();
        for (const auto& [name, to] :
             std::initializer_list<std::pair<const char*, int*>>{{"view", &rect.view},
                                                                 {"page", &rect.page},
                                                                 {"viewX", &rect.viewX},
                                                                 {"viewY", &rect.viewY},
                                                                 {"width", &rect.width},
                                                                 {"height", &rect.height},
                                                                 {"atlasX", &rect.atlasX},
                                                                 {"atlasY", &rect.atlasY}}) {
            STX_CHECK(r.number(name, *to, r.checksRules() ? 0 : -kAnyPixel, kAnyPixel));
        }
        return r.flag("turned", rect.turned);
    };
    STX_CHECK(top.list("rectangles", most, readRectangle));
    return header;
}

}  // namespace stx
