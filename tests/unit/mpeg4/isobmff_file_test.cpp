// The container: lazy reading, sizes above 4 GiB, order of boxes, damage.

#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "formats/files/byte_io.hpp"
#include "formats/mpeg4/container/image_headers.hpp"
#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

namespace fs = std::filesystem;

/// A folder that goes away with the test.
class Folder {
  public:
    Folder() {
        std::string name = (fs::temp_directory_path() / "stx_isobmff_XXXXXX").string();
        path_ = ::mkdtemp(name.data());
    }
    ~Folder() { fs::remove_all(path_); }
    fs::path operator/(const char* name) const { return path_ / name; }

  private:
    fs::path path_;
};

/// A PNG header of some size: all that the writer looks at.
Bytes pngHead(std::uint32_t width, std::uint32_t height) {
    ByteWriter out;
    out.u64(0x89504E470D0A1A0Aull);
    out.u32(13);
    out.u32(0x49484452);
    out.u32(width);
    out.u32(height);
    for (const std::uint8_t b : {8, 0, 0, 0, 0}) out.u8(b);
    out.u32(0);
    return out.take();
}

/// One DepthImage with colour and depth as object descriptors 10 and 11.
Document smallDocument(ByteRange colour, ByteRange depth) {
    Document document;
    const NodePtr root = makeNode("Group");
    const NodePtr view = makeNode("DepthImage");
    const NodePtr texture = makeNode("SimpleTexture");
    for (const auto& [field, id] : {std::pair{"texture", 10}, {"depth", 11}}) {
        const NodePtr image = makeNode("ImageTexture");
        image->set("url", std::vector<Url>{Url{id, ""}});
        texture->set(field, image);
    }
    view->set("diTexture", texture);
    view->set("orthographic", false);
    root->edit<NodeList>("children").push_back(view);
    document.frames.push_back({0, {ReplaceScene{false, root, {}}}});
    UpdateObjectDescriptors update;
    int id = 10;
    for (const ByteRange& range : {colour, depth}) {
        ElementaryStream stream;
        stream.samples.emplace_back().data = range;
        update.descriptors.push_back({id++, "", {stream}});
    }
    document.odFrames.push_back({0, {update}});
    return document;
}

Bytes written(const Document& document) {
    Job job;
    auto bytes = writeMp4(document, job);
    EXPECT_TRUE(bytes) << bytes.error().text();
    return bytes ? *bytes : Bytes();
}

std::string errorOfFile(const Bytes& bytes) {
    Job job;
    const auto document = readMp4(ByteSource::fromBytes(bytes), job);
    return document ? "read" : document.error().text();
}

std::size_t find(const Bytes& bytes, std::string_view type) {
    const auto what = std::as_bytes(std::span(type));
    return static_cast<std::size_t>(
        std::search(bytes.begin(), bytes.end(), what.begin(), what.end()) - bytes.begin());
}

void put32(Bytes& bytes, std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i)
        bytes.at(at + i) = static_cast<std::byte>(value >> (24 - 8 * i));
}

const Document& sample() {
    static const Document document =
        smallDocument(ByteRange::of(pngHead(16, 12)), ByteRange::of(pngHead(16, 12)));
    return document;
}

TEST(IsobmffFile, WritesWhatItIsGivenAndNothingOfTheDay) {
    const Bytes bytes = written(sample());
    EXPECT_EQ(bytes, written(sample()));
    Job job;
    const auto document = readMp4(ByteSource::fromBytes(bytes), job);
    ASSERT_TRUE(document) << document.error().text();
    EXPECT_TRUE(document->mp4->deviations.empty());
    EXPECT_TRUE(document->mp4->moovFirst);
    EXPECT_EQ(document->mp4->majorBrand, "mp42");
    EXPECT_TRUE(job.takeNotes().empty());
    const auto* colour = document->findObjectDescriptor(10);
    ASSERT_NE(colour, nullptr);
    EXPECT_EQ(colour->streams.at(0).width, 16);
    EXPECT_EQ(colour->streams.at(0).height, 12);
    EXPECT_EQ(colour->streams.at(0).objectTypeIndication, oti::kPng);
    EXPECT_EQ(colour->streams.at(0).samples.at(0).duration, 1000u);
    ASSERT_EQ(document->mp4->tracks.size(), 4u);
    EXPECT_TRUE(document->mp4->tracks[0].inIods && document->mp4->tracks[1].inIods);
    EXPECT_FALSE(document->mp4->tracks[2].inIods);

    ::setenv("SOURCE_DATE_EPOCH", "0", 1);
    const Bytes dated = written(sample());
    ::unsetenv("SOURCE_DATE_EPOCH");
    EXPECT_NE(bytes, dated);
    EXPECT_EQ(bytes.size(), dated.size());
    // Creation and modification of the movie, each track and each medium: 1970 counted from 1904.
    const auto timesOf = [](const Bytes& file, const char* box) {
        const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
        const auto at = text.find(box);
        return at == text.npos ? std::string_view() : text.substr(at + 8, 8);
    };
    for (const char* box : {"mvhd", "tkhd", "mdhd"}) {
        EXPECT_EQ(timesOf(bytes, box), std::string_view("\0\0\0\0\0\0\0\0", 8)) << box;
        EXPECT_EQ(timesOf(dated, box), "\x7c\x25\xb0\x80\x7c\x25\xb0\x80") << box;
    }
}

TEST(IsobmffFile, WritesTheJpegDescriptionOfTheOtherImplementation) {
    REQUIRE_SHARED(file, "reference/images/color16x12.jpg");
    const auto bytes = stx::readFile(file, Limits());
    ASSERT_TRUE(bytes);
    const auto header = readImageHeader(*bytes);
    ASSERT_TRUE(header);
    EXPECT_EQ(header->width, 16);
    EXPECT_EQ(header->height, 12);
    EXPECT_EQ(hex(jpegDecoderSpecificInfo(*header)), "00 14 00 01 00 01 03");
    const Bytes mp4 = written(smallDocument(ByteRange::of(*bytes), ByteRange::of(pngHead(16, 12))));
    Job job;
    const auto document = readMp4(ByteSource::fromBytes(mp4), job);
    ASSERT_TRUE(document);
    const ElementaryStream& stream = document->findObjectDescriptor(10)->streams.at(0);
    EXPECT_EQ(stream.objectTypeIndication, oti::kJpeg);
    EXPECT_EQ(hex(stream.decoderSpecificInfo), "00 14 00 01 00 01 03");
    EXPECT_EQ(stream.bufferSizeDB, 727u);
    EXPECT_EQ(stream.avgBitrate, 5816u);
    const auto again = stream.samples.at(0).data.load(Limits());
    ASSERT_TRUE(again);
    EXPECT_TRUE(*again == *bytes) << "image bytes pass untouched";
}

TEST(IsobmffFile, AnotherReaderReadsWhatWeWrite) {
    REQUIRE_SHARED(script, "reference/mpeg4dump.py");
    REQUIRE_SHARED(folder, "reference/mp4");
    if (std::system("python3 -c pass >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs python3";
    const Folder temporary;
    const auto files = mp4FilesIn(folder);
    for (const auto& file : files) {
        Job job;
        const auto document = readMp4(openSource(file), job);
        ASSERT_TRUE(document);
        ASSERT_TRUE(stx::writeFile(temporary / file.filename().c_str(), written(*document)));
    }
    // One process for all files: the script leaves by exit() after each, with 1 where it failed.
    const fs::path loop = temporary / "loop.py";
    std::ofstream(loop) << "import glob, runpy, sys\n"
                           "for name in sorted(glob.glob(sys.argv[2] + '/*.mp4')):\n"
                           "    sys.argv[1:] = [sys.argv[1], sys.argv[2], name]\n"
                           "    saved = sys.argv[:]\n"
                           "    sys.argv = [saved[1], name]\n"
                           "    try:\n"
                           "        runpy.run_path(saved[1], run_name='__main__')\n"
                           "    except SystemExit as end:\n"
                           "        print('EXIT', end.code, name)\n"
                           "    sys.argv = saved\n";
    const std::string command =
        fmt::format("python3 '{}' '{}' '{}' > '{}' 2>&1", loop.string(), script.string(),
                    loop.parent_path().string(), (temporary / "out.txt").string());
    EXPECT_EQ(std::system(command.c_str()), 0);
    std::ifstream out(temporary / "out.txt");
    const std::string text{std::istreambuf_iterator<char>(out), {}};
    EXPECT_EQ(text.find("FAILED"), std::string::npos) << text;
    std::size_t good = 0;
    for (std::size_t at = text.find("EXIT 0"); at != std::string::npos;
         at = text.find("EXIT 0", at + 1))
        ++good;
    EXPECT_EQ(good, files.size()) << text;
}

TEST(IsobmffFile, AFileAboveFourGigabytesIsWrittenAndReadByItsHeaders) {
    const Folder temporary;
    // A sparse file stands for two images of 2.5 GiB.
    const std::uint64_t each = 2560ull << 20;
    const fs::path images = temporary / "images";
    {
        const Bytes head = pngHead(40000, 30000);
        std::ofstream out(images, std::ios::binary);
        out.write(reinterpret_cast<const char*>(head.data()),
                  static_cast<std::streamsize>(head.size()));
    }
    fs::resize_file(images, each);
    const auto source = ByteSource::open(images);
    ASSERT_TRUE(source);

    // The head of the file as the writer makes it; the images are zeros that need no writing.
    const Document document =
        smallDocument(ByteRange(*source, 0, each), ByteRange(*source, 0, each));
    Job job;
    job.limits.maxMemoryBytes = 16u << 20;
    const auto refused = writeMp4(document, job);
    ASSERT_FALSE(refused) << "5 GiB do not fit into 16 MiB";

    const fs::path target = temporary / "big.mp4";
    {
        auto out = OutputFile::create(target);
        ASSERT_TRUE(out);
        const auto space = fs::space(target.parent_path());
        if (space.available < (8ull << 30)) GTEST_SKIP() << "needs 8 GiB on disk";
        if (std::getenv("STX_BIG_TESTS") == nullptr)
            GTEST_SKIP() << "writes 5 GiB; set STX_BIG_TESTS=1";
        ASSERT_TRUE(writeMp4(document, *out, job));
        ASSERT_TRUE(out->commit());
    }
    const auto big = ByteSource::open(target);
    ASSERT_TRUE(big);
    EXPECT_GT(big->size(), 5ull << 30);
    const auto again = readMp4(*big, job);
    ASSERT_TRUE(again) << again.error().text();
    const Sample& last = again->findObjectDescriptor(11)->streams.at(0).samples.at(0);
    EXPECT_EQ(last.data.size, each);
    EXPECT_GT(last.data.offset, 1ull << 31);
    Bytes head(24);
    ASSERT_TRUE(last.data.source.read(last.data.offset, head));
    EXPECT_EQ(readImageHeader(head).has_value(), false) << "24 bytes are too few";
    EXPECT_EQ(std::to_integer<int>(head[1]), 'P');
}

TEST(IsobmffFile, SixtyFourBitSizesAndOffsetsAreRead) {
    // A sparse file: ftyp, an mdat of 6 GiB with a 64-bit size, then moov with co64.
    const Folder temporary;
    const Bytes small = written(sample());
    const std::size_t moov = find(small, "moov") - 4;
    const std::size_t mdat = find(small, "mdat") - 4;
    const std::uint64_t gap = 6ull << 30;

    Bytes tail(small.begin() + static_cast<std::ptrdiff_t>(moov),
               small.begin() + static_cast<std::ptrdiff_t>(mdat));
    // stco -> co64: each offset grows by 4 bytes, and so does every box around it.
    ByteWriter head;
    head.bytes(ByteSpan(small).first(moov));
    head.u32(1);
    head.text("mdat");
    head.u64(gap);
    const fs::path path = temporary / "sparse.mp4";
    Bytes grown;
    std::vector<std::size_t> open;  // starts of the boxes that enclose an offset, in `grown`
    const std::function<void(std::size_t, std::size_t)> copy = [&](std::size_t from,
                                                                   std::size_t to) {
        while (from < to) {
            ByteReader in(ByteSpan(tail).subspan(from));
            const std::uint32_t size = in.u32();
            const std::string type = in.text(4);
            const bool container = type == "moov" || type == "trak" || type == "mdia" ||
                                   type == "minf" || type == "stbl";
            const std::size_t start = grown.size();
            grown.insert(grown.end(), tail.begin() + static_cast<std::ptrdiff_t>(from),
                         tail.begin() + static_cast<std::ptrdiff_t>(from + 8));
            if (container) {
                copy(from + 8, from + size);
            } else if (type == "stco") {
                in.skip(8);
                ByteWriter box;
                box.u32(0);
                box.u32(1);
                // Samples lie at the very end of the gap.
                box.u64(in.u32() - mdat + (gap - small.size()));
                grown.insert(grown.end(), box.view().begin(), box.view().end());
                std::memcpy(grown.data() + start + 4, "co64", 4);
            } else {
                grown.insert(grown.end(), tail.begin() + static_cast<std::ptrdiff_t>(from + 8),
                             tail.begin() + static_cast<std::ptrdiff_t>(from + size));
            }
            put32(grown, start, static_cast<std::uint32_t>(grown.size() - start));
            from += size;
        }
    };
    copy(0, tail.size());
    {
        std::ofstream out(path, std::ios::binary);
        out.write(reinterpret_cast<const char*>(head.view().data()),
                  static_cast<std::streamsize>(head.size()));
        const std::uint64_t base = gap - small.size();
        out.seekp(static_cast<std::streamoff>(base));
        out.write(reinterpret_cast<const char*>(small.data() + mdat),
                  static_cast<std::streamsize>(small.size() - mdat));
        out.seekp(static_cast<std::streamoff>(moov + gap));
        out.write(reinterpret_cast<const char*>(grown.data()),
                  static_cast<std::streamsize>(grown.size()));
        if (!out) GTEST_SKIP() << "needs a file system with sparse files";
    }
    const auto source = ByteSource::open(path);
    ASSERT_TRUE(source);
    EXPECT_GT(source->size(), 4ull << 30);
    Job job;
    job.limits.maxMemoryBytes = 1u << 20;  // headers only
    const auto document = readMp4(*source, job);
    ASSERT_TRUE(document) << document.error().text();
    EXPECT_FALSE(document->mp4->moovFirst);
    EXPECT_TRUE(sameFrames(document->frames, sample().frames));
    const auto image =
        document->findObjectDescriptor(11)->streams.at(0).samples.at(0).data.load(job.limits);
    ASSERT_TRUE(image);
    EXPECT_EQ(hex(*image), hex(pngHead(16, 12)));
}

TEST(IsobmffFile, DamageIsToldWithItsPlace) {
    const Bytes good = written(sample());
    EXPECT_EQ(errorOfFile(good), "read");
    const auto with = [&](std::string_view type, std::ptrdiff_t from, std::uint32_t value) {
        Bytes bad = good;
        put32(bad, static_cast<std::size_t>(static_cast<std::ptrdiff_t>(find(bad, type)) + from),
              value);
        return errorOfFile(bad);
    };
    EXPECT_NE(with("moov", -4, 0x7FFFFFFF).find("'moov' claims 2147483647 bytes"),
              std::string::npos);
    EXPECT_NE(with("trak", -4, 7).find("moov at byte"), std::string::npos) << with("trak", -4, 7);
    const std::string stsz = with("stsz", 12, 0x10000000);
    EXPECT_NE(stsz.find("moov/trak[1]/mdia/minf/stbl/stsz at byte"), std::string::npos) << stsz;
    const std::string stco = with("stco", 12, 0x7FFFFFFF);
    EXPECT_NE(stco.find("stbl/stco"), std::string::npos) << stco;
    EXPECT_NE(stco.find("past the end of the file"), std::string::npos) << stco;
    EXPECT_NE(with("mdhd", 16, 0).find("timescale is 0"), std::string::npos);
    EXPECT_NE(with("stsc", 12, 2).find("stsc"), std::string::npos);
    // A sample description of a scene with a code that no version has.
    EXPECT_NE(errorOfFile(Bytes(good.begin(), good.begin() + 100)).find("byte 28"),
              std::string::npos);
    EXPECT_NE(errorOfFile({}).find("no 'moov'"), std::string::npos);
    EXPECT_NE(errorOfFile(unhex("ffd8ffe000104a46494600")).find("not an MP4 file"),
              std::string::npos);
    Bytes cut = good;
    cut.resize(good.size() - 1);
    EXPECT_NE(errorOfFile(cut).find("'mdat' claims"), std::string::npos) << errorOfFile(cut);
}

/// The file with a second sample entry in its last track, `differs` from the first or the same, of
/// which the one chunk is, by number.
Bytes withTwoEntries(const Bytes& good, bool differs, std::uint32_t number) {
    const auto get32 = [&](const Bytes& bytes, std::size_t at) {
        return ByteReader(ByteSpan(bytes).subspan(at)).u32();
    };
    Bytes out = good;
    std::size_t stsd = find(out, "stsd");
    for (auto next = stsd; next < out.size();) {
        stsd = next;
        const Bytes rest(out.begin() + static_cast<std::ptrdiff_t>(stsd) + 4, out.end());
        next = stsd + 4 + find(rest, "stsd");
    }
    const std::size_t entry = stsd + 12, size = get32(out, entry);
    Bytes second(out.begin() + static_cast<std::ptrdiff_t>(entry),
                 out.begin() + static_cast<std::ptrdiff_t>(entry + size));
    if (differs) second.back() ^= std::byte{1};
    put32(out, stsd + 8, 2);
    const Bytes behind(out.begin() + static_cast<std::ptrdiff_t>(stsd), out.end());
    put32(out, stsd + find(behind, "stsc") + 20, number);
    // Sizes of all boxes around it, and where the chunks are.
    const std::string_view around[] = {"moov", "trak", "mdia", "minf", "stbl", "stsd"};
    for (std::size_t at = 0, box = 0; box < 6;) {
        const std::size_t length = get32(out, at);
        const bool here = std::memcmp(out.data() + at + 4, around[box].data(), 4) == 0;
        if (!here || at + length < entry) {
            at += length;
            continue;
        }
        put32(out, at, static_cast<std::uint32_t>(length + size));
        at += 8;
        ++box;
    }
    for (std::size_t at = 0; at + 12 < out.size(); ++at)
        if (std::memcmp(out.data() + at, "stco", 4) == 0)
            put32(out, at + 12, get32(out, at + 12) + static_cast<std::uint32_t>(size));
    out.insert(out.begin() + static_cast<std::ptrdiff_t>(entry + size), second.begin(),
               second.end());
    return out;
}

TEST(IsobmffFile, SamplesOfAnotherEntryThanTheFirstAreRefused) {
    const Bytes good = written(sample());
    EXPECT_EQ(errorOfFile(withTwoEntries(good, false, 1)), "read");
    EXPECT_EQ(errorOfFile(withTwoEntries(good, false, 2)), "read");
    EXPECT_EQ(errorOfFile(withTwoEntries(good, true, 1)), "read");
    const Bytes other = withTwoEntries(good, true, 2);
    Job job;
    const auto document = readMp4(ByteSource::fromBytes(other), job);
    ASSERT_FALSE(document);
    EXPECT_EQ(document.error().code, ErrorCode::unsupported);
    EXPECT_NE(document.error().text().find("moov/trak[4]/mdia/minf/stbl/stsc at byte"),
              std::string::npos)
        << document.error().text();
    EXPECT_NE(document.error().text().find(
                  "chunk 1 is of sample entry 2 ('mp4v'), which is not the first ('mp4v') again"),
              std::string::npos)
        << document.error().text();
    EXPECT_NE(errorOfFile(withTwoEntries(good, true, 3))
                  .find("chunk 1 is of sample entry 3, but there are 2"),
              std::string::npos);
}

TEST(IsobmffFile, FragmentedAndEncryptedFilesAreRefusedByName) {
    const Bytes good = written(sample());
    const auto renamed = [&](std::string_view from, std::string_view to) {
        Bytes bad = good;
        std::memcpy(bad.data() + find(bad, from), to.data(), 4);
        return errorOfFile(bad);
    };
    // 'iods' holds nothing that is missed before mvex is.
    EXPECT_NE(renamed("iods", "mvex").find("fragmented"), std::string::npos)
        << renamed("iods", "mvex");
    EXPECT_NE(renamed("mdat", "moof").find("fragmented"), std::string::npos);
    EXPECT_NE(renamed("mp4v", "encv").find("encrypted"), std::string::npos);
    EXPECT_NE(renamed("sdsm", "text").find("read"), std::string::npos)
        << "the stream type still says scene";
}

TEST(IsobmffFile, UnknownBoxesArePassedOver) {
    Bytes bytes = written(sample());
    ByteWriter strange;
    strange.u32(12);
    strange.text("xyz?");
    strange.u32(42);
    bytes.insert(bytes.end(), strange.view().begin(), strange.view().end());
    EXPECT_EQ(errorOfFile(bytes), "read");
    std::memcpy(bytes.data() + find(bytes, "mvhd"), "xyz?", 4);
    EXPECT_EQ(errorOfFile(bytes), "read");
}

TEST(IsobmffFile, WhatHasNoCodeIsRefused) {
    Job job;
    const auto error = [&](const Document& document) {
        const auto bytes = writeMp4(document, job);
        return bytes ? "written" : bytes.error().text();
    };
    Document document =
        smallDocument(ByteRange::of(pngHead(1, 1)), ByteRange::of(unhex("00112233")));
    EXPECT_NE(error(document).find("object descriptor 11 is neither JPEG nor PNG"),
              std::string::npos)
        << error(document);
    document = sample();
    std::get<UpdateObjectDescriptors>(document.odFrames[0].commands[0]).descriptors[0].id = 1024;
    EXPECT_NE(error(document).find("1024"), std::string::npos);
    document = sample();
    std::get<UpdateObjectDescriptors>(document.odFrames[0].commands[0])
        .descriptors[0]
        .streams[0]
        .samples.clear();
    EXPECT_NE(error(document).find("has no data"), std::string::npos);
    document = sample();
    document.frames.clear();
    EXPECT_NE(error(document).find("no scene"), std::string::npos);
    document = sample();
    document.frames.push_back(document.frames[0]);
    document.frames[0].time = 5;
    EXPECT_NE(error(document).find("time 0 behind one at 5"), std::string::npos);
}

TEST(IsobmffFile, AFifoIsNoSource) {
    const Folder temporary;
    const fs::path fifo = temporary / "fifo";
    ASSERT_EQ(std::system(fmt::format("mkfifo '{}'", fifo.string()).c_str()), 0);
    EXPECT_FALSE(ByteSource::open(fifo));
    EXPECT_FALSE(ByteSource::open(temporary / "missing"));
}

}  // namespace
}  // namespace stx::mpeg4
