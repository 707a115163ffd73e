#include "formats/viewer/page_writer.hpp"

#include <fmt/format.h>

#include "embedded_viewer.hpp"
#include "formats/viewer/page_text.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;

/// Where what a page holds is put.
constexpr std::string_view kDataMark = "@DATA@";

std::string textOf(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string inHtml(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    // As JSON does it, what is not UTF-8 is replaced.
    return Json::parse(textOf(out));
}

/// The program of the page, its shaders and its panel, packed.
std::string packedProgram() {
    Json texts;
    for (const auto& [name, text] : {std::pair{"screen.vert", viewer::screen_vert},
                                     {"prepare.frag", viewer::prepare_frag},
                                     {"smooth.frag", viewer::smooth_frag},
                                     {"splat.vert", viewer::splat_vert},
                                     {"splat.frag", viewer::splat_frag},
                                     {"resolve.frag", viewer::resolve_frag},
                                     {"pinholes.frag", viewer::pinholes_frag},
                                     {"directions.frag", viewer::directions_frag},
                                     {"outline.vert", viewer::outline_vert},
                                     {"outline.frag", viewer::outline_frag},
                                     {"silhouettes.frag", viewer::silhouettes_frag},
                                     {"present.frag", viewer::present_frag}})
        texts[name] = withoutComments(text);
    std::string code = "\"use strict\";\nconst kPanel=" + Json(viewer::panel_html).dump() +
                       ",kShaders=" + texts.dump() + ";\n";
    for (const auto part : {viewer::png_js, viewer::camera_js, viewer::scene_js, viewer::painter_js,
                            viewer::viewer_js})
        code += withoutComments(part);
    return packedPageText(code);
}

}  // namespace

PageWriter::PageWriter(OutputFile file, std::string_view title, bool moves)
    : file_(std::move(file)), moves_(moves) {
    const std::string_view shell = viewer::viewer_html;
    const std::size_t at = shell.find(kDataMark);
    head_ = shell.substr(0, at);
    end_ = shell.substr(at + kDataMark.size());
    const auto put = [](std::string& part, std::string_view mark, const std::string& text) {
        part.replace(part.find(mark), mark.size(), text);
    };
    put(head_, "@TITLE@", inHtml(title));
    put(end_, "@UNPACK@", withoutComments(viewer::unpack_js));
}

Result<void> PageWriter::begin() {
    STX_CHECK(write(kUtf16Mark));
    return write(utf16Of(head_));
}

PageWriter::Slot& PageWriter::slot(std::size_t index) {
    if (slots_.size() <= index) slots_.resize(index + 1);
    return slots_[index];
}

Result<void> PageWriter::addImages(std::size_t index, std::size_t atlas,
                                   std::vector<PageImages> images, Json& pages) {
    Slot& before = slot(index);
    for (std::size_t page = 0; page < images.size(); ++page) {
        Json numbers = Json::object();
        for (auto& [name, bytes] : images[page]) {
            Image& last = before.images[{atlas, page, name}];
            if (last.number < 0 || last.bytes != bytes) {
                last.number = images_++;
                imageBytes_ += bytes.size();
                STX_CHECK(element(fmt::format("image{}", last.number), pageText(bytes)));
                if (moves_) last.bytes = std::move(bytes);
            }
            numbers[name] = last.number;
        }
        pages.push_back(std::move(numbers));
    }
    return {};
}

Result<int> PageWriter::addScene(std::size_t index, const Json& description) {
    Slot& before = slot(index);
    std::string text = packedPageText(textOf(description));
    if (before.number >= 0 && before.text == text) return before.number;
    before.text = std::move(text);
    before.number = scenes_++;
    STX_CHECK(element(fmt::format("scene{}", before.number), before.text));
    return before.number;
}

Result<void> PageWriter::finish(const Json& data) {
    STX_CHECK(element("data", packedPageText(textOf(data))));
    STX_CHECK(element("code", packedProgram()));
    STX_CHECK(write(utf16Of(end_)));
    return file_.commit();
}

Result<void> PageWriter::write(std::string_view text) {
    bytes_ += text.size();
    return file_.write(text);
}

Result<void> PageWriter::element(std::string_view id, std::string_view text) {
    STX_CHECK(write(utf16Of(fmt::format("<script type=\"text/plain\" id=\"{}\">", id))));
    STX_CHECK(write(text));
    return write(utf16Of("</script>\n"));
}

}  // namespace stx
