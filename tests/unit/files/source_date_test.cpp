#include "formats/files/source_date.hpp"

#include <cstdlib>

#include <gtest/gtest.h>

#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/exr_file.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

class SourceDate : public testing::Test {
  protected:
    void SetUp() override { ::unsetenv("SOURCE_DATE_EPOCH"); }
    void TearDown() override { ::unsetenv("SOURCE_DATE_EPOCH"); }
};

TEST_F(SourceDate, IsAWholeNumberOfSecondsOrNothing) {
    EXPECT_EQ(sourceDate(), std::nullopt);
    for (const char* text :
         {"", "-1", "1.5", "12 ", "soon", "253402300800", "99999999999999999999"}) {
        ::setenv("SOURCE_DATE_EPOCH", text, 1);
        EXPECT_EQ(sourceDate(), std::nullopt) << text;
    }
    ::setenv("SOURCE_DATE_EPOCH", "1709251199", 1);
    EXPECT_EQ(sourceDate(), 1709251199u);
}

TEST_F(SourceDate, InTheWordsOfOpenExr) {
    EXPECT_EQ(exrDate(0), "1970:01:01 00:00:00");
    EXPECT_EQ(exrDate(1709251199), "2024:02:29 23:59:59");
    EXPECT_EQ(exrDate(253402300799), "9999:12:31 23:59:59");
}

TEST_F(SourceDate, StampsOpenExrOnlyWhenAsked) {
    const TemporaryFolder folder;
    const Bundle bundle = smallBundle(1, 16, false, false);
    const auto dateIn = [&](const char* name) -> std::string {
        Job job;
        EXPECT_TRUE(writeExrViews(*viewsOf(bundle), folder / name, job));
        const auto reader = ExrReader::open(folder / name, Limits());
        if (!reader) return reader.error().text();
        const auto* date = reader->parts()[0].attribute<std::string>("capDate");
        const auto* zone = reader->parts()[0].attribute<double>("utcOffset");
        EXPECT_EQ(date == nullptr, zone == nullptr);
        if (zone) {
            EXPECT_EQ(*zone, 0.0);
        }
        return date ? *date : "none";
    };
    EXPECT_EQ(dateIn("plain.exr"), "none");
    ::setenv("SOURCE_DATE_EPOCH", "86400", 1);
    EXPECT_EQ(dateIn("dated.exr"), "1970:01:02 00:00:00");
}

}  // namespace
}  // namespace stx
