// The 28 MP4 variants of an independent writer: what we say to each, beside what another
// implementation says.

#include <gtest/gtest.h>

#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

using Deviation = Mp4Deviation::Kind;

struct Variant {
    const char* file;
    const char* theirs;  ///< the other implementation's verdict, for people
    int images;          ///< object descriptors whose image bytes we reach
    std::vector<Deviation> deviations;
};

const std::vector<Variant>& variants() {
    static const std::vector<Variant> all = {
        {"a_base_mask_vec", "read", 2, {}},
        {"b2_list_list_pad1", "read", 2, {Deviation::trailingBytes}},
        {"b3_mask_list", "read", 2, {}},
        {"b4_list_vec", "read", 2, {}},
        {"b_list_list", "read", 2, {}},
        {"c_oti2_v2cfg", "read", 2, {}},
        {"d_no_iods", "nothing found", 2, {Deviation::noIods}},
        {"e_mdat_first", "read", 2, {}},
        {"f_img_mp4s", "load fails", 2, {Deviation::imageInSystemsEntry}},
        {"g_img_native", "scene without images", 2, {Deviation::imageInNativeEntry}},
        {"h_od_full_esd_noref", "error, no images", 2, {Deviation::fullEsdInOd}},
        {"i2_od_tag01_ref", "read", 2, {Deviation::streamOdTag}},
        {"i_od_tag01_fullesd", "images lost", 2, {Deviation::streamOdTag, Deviation::fullEsdInOd}},
        {"j_no_mpod", "images not resolved", 0, {Deviation::mpodMissing}},
        {"k_pad4", "read", 2, {Deviation::trailingBytes}},
        {"l_esid_nonzero", "read", 2, {Deviation::esIdNotZero}},
        {"m_no_jpeg_dsi", "read", 2, {}},
        {"n_stts0", "read", 2, {}},
        {"o_nosize", "read", 2, {}},
        {"p_pixelmetric", "read", 2, {}},
        {"q_nodebits10", "read", 2, {}},
        {"r_no_od_track", "scene without images", 0, {Deviation::noOdTrack}},
        {"s_handler_pict", "read", 2, {}},
        {"t_brand_isom", "read", 2, {}},
        {"u_long_desc_len", "read", 2, {}},
        {"v_bifs_only", "read", 0, {Deviation::noOdTrack}},
        {"w_pixeltexture", "read", 0, {Deviation::noOdTrack}},
        {"x_od01_fullesd_nompod", "read", 2, {Deviation::streamOdTag, Deviation::fullEsdInOd}},
    };
    return all;
}

int imagesOf(const Document& document) {
    int images = 0;
    for (const ObjectDescriptor* descriptor : document.objectDescriptors())
        for (const ElementaryStream& stream : descriptor->streams)
            if (!stream.samples.empty() && stream.samples[0].data.load(Limits())) ++images;
    return images;
}

TEST(IsobmffVariants, EachIsReadAndItsDeviationsAreReported) {
    REQUIRE_SHARED(folder, "reference/handmade");
    EXPECT_EQ(mp4FilesIn(folder).size(), variants().size());
    Job baseJob;
    const auto base = readMp4(openSource(folder / "a_base_mask_vec.mp4"), baseJob);
    ASSERT_TRUE(base) << base.error().text();
    for (const Variant& variant : variants()) {
        SCOPED_TRACE(variant.file);
        Job job;
        const auto document =
            readMp4(openSource(folder / (std::string(variant.file) + ".mp4")), job);
        ASSERT_TRUE(document) << document.error().text();
        EXPECT_EQ(imagesOf(*document), variant.images);
        std::vector<Deviation> kinds;
        for (const Mp4Deviation& deviation : document->mp4->deviations) {
            if (std::find(kinds.begin(), kinds.end(), deviation.kind) == kinds.end())
                kinds.push_back(deviation.kind);
            EXPECT_FALSE(deviation.text.empty());
            EXPECT_FALSE(deviation.where.empty()) << deviation.text;
        }
        std::sort(kinds.begin(), kinds.end());
        std::vector<Deviation> expected = variant.deviations;
        std::sort(expected.begin(), expected.end());
        EXPECT_EQ(kinds, expected);
        // All but the last two hold one and the same scene.
        const std::string name = variant.file;
        if (name[0] != 'v' && name[0] != 'w') {
            EXPECT_TRUE(sameFrames(document->frames, base->frames));
        }
    }
}

TEST(IsobmffVariants, EachIsWrittenAndReadsBackTheSame) {
    for (const char* folderName : {"reference/handmade", "reference/mp4"}) {
        REQUIRE_SHARED(folder, folderName);
        for (const auto& file : mp4FilesIn(folder)) {
            SCOPED_TRACE(file.filename().string());
            Job job;
            const auto document = readMp4(openSource(file), job);
            ASSERT_TRUE(document) << document.error().text();
            const auto bytes = writeMp4(*document, job);
            ASSERT_TRUE(bytes) << bytes.error().text();
            const auto again = readMp4(ByteSource::fromBytes(*bytes), job);
            ASSERT_TRUE(again) << again.error().text();
            EXPECT_TRUE(again->mp4->deviations.empty() || again->odFrames.empty());
            EXPECT_TRUE(sameFrames(document->frames, again->frames));
            const auto before = document->objectDescriptors();
            const auto after = again->objectDescriptors();
            ASSERT_EQ(before.size(), after.size());
            for (std::size_t i = 0; i < before.size(); ++i) {
                EXPECT_EQ(before[i]->id, after[i]->id);
                ASSERT_EQ(before[i]->streams.size(), after[i]->streams.size());
                for (std::size_t k = 0; k < before[i]->streams.size(); ++k) {
                    const ElementaryStream& x = before[i]->streams[k];
                    const ElementaryStream& y = after[i]->streams[k];
                    EXPECT_EQ(x.esId, y.esId);
                    EXPECT_EQ(x.objectTypeIndication, y.objectTypeIndication);
                    if (x.width != 0) {  // 'mp4s' does not say it
                        EXPECT_EQ(x.width, y.width);
                        EXPECT_EQ(x.height, y.height);
                    }
                    EXPECT_EQ(x.timescale, y.timescale);
                    ASSERT_EQ(x.samples.size(), y.samples.size());
                    for (std::size_t s = 0; s < x.samples.size(); ++s) {
                        EXPECT_EQ(x.samples[s].time, y.samples[s].time);
                        EXPECT_EQ(x.samples[s].duration, y.samples[s].duration);
                        const auto xBytes = x.samples[s].data.load(job.limits);
                        const auto yBytes = y.samples[s].data.load(job.limits);
                        ASSERT_TRUE(xBytes && yBytes);
                        EXPECT_TRUE(*xBytes == *yBytes);
                    }
                }
            }
            const auto twice = writeMp4(*again, job);
            ASSERT_TRUE(twice);
            EXPECT_TRUE(*bytes == *twice) << "the same document gives the same bytes";
        }
    }
}

}  // namespace
}  // namespace stx::mpeg4
