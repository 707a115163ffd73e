// The process in which foreign files are decoded: what it may do, and what becomes of one that
// ends, hangs, lies or is not there. Its module is probe/probe.cpp.

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <thread>

#include "formats/decoders/decoder_process.hpp"

namespace stx {
namespace {

using decoders::Tag;

constexpr DecoderKind kProbe = {"probe", "STX_PROBE", "stx_probe.so", "the probe cannot be loaded",
                                "build it"};

/// A setting of the environment, for a while.
class Setting {
  public:
    Setting(const char* name, const char* value) : name_(name) { ::setenv(name, value, 1); }
    ~Setting() { ::unsetenv(name_); }
    Setting(const Setting&) = delete;
    Setting& operator=(const Setting&) = delete;

  private:
    const char* name_;
};

Result<std::unique_ptr<DecoderProcess>> startProbe(int cpuSeconds = 0, int patienceMs = 30000) {
    const Setting module("STX_PROBE", STX_PROBE_MODULE);
    const std::string input = "input";
    return DecoderProcess::start(
        kProbe,
        DecoderBounds{.memoryBytes = 64 << 20, .cpuSeconds = cpuSeconds, .patienceMs = patienceMs},
        std::as_bytes(std::span(input)));
}

void ask(DecoderProcess& process, const std::string& what) {
    decoders::Packer request;
    request.putText(what);
    request.put(static_cast<std::int32_t>(::getpid()));
    process.send(Tag::decodePicture, request.bytes);
}

enum class Outcome { could, couldNot, gone };

Outcome tryIt(DecoderProcess& process, const std::string& what) {
    Tag tag{};
    Bytes answer;
    ask(process, what);
    if (!process.receiveMessage(tag, answer, 1024)) return Outcome::gone;
    return decoders::Unpacker(answer).get<std::uint8_t>() != 0 ? Outcome::could : Outcome::couldNot;
}

TEST(DecoderProcess, ReachesNothingButItsFile) {
    const auto process = startProbe();
    ASSERT_TRUE(process) << process.error().message;
    if (!(*process)->isolation().seccomp) GTEST_SKIP() << "this kernel has no seccomp";
    EXPECT_EQ((*process)->libraries(), "a probe");
    for (const char* what : {"open a file",
                             "open a folder",
                             "create a file",
                             "open the other's memory",
                             "look at a file",
                             "make a TCP socket",
                             "make a local socket",
                             "connect",
                             "fork",
                             "run a program",
                             "start a program",
                             "start a thread",
                             "trace the other",
                             "read the other's memory",
                             "signal the other",
                             "bound the other",
                             "make memory that runs",
                             "share memory",
                             "make a file in memory",
                             "write to its input",
                             "take much memory"})
        EXPECT_EQ(tryIt(**process, what), Outcome::couldNot) << what;
    for (const char* what : {"take memory", "read its input", "open its input by name"})
        EXPECT_EQ(tryIt(**process, what), Outcome::could) << what;
}

TEST(DecoderProcess, HasSeenNoOtherFile) {
    for (int i = 0; i < 3; ++i) {
        const auto process = startProbe();
        ASSERT_TRUE(process);
        EXPECT_EQ(tryIt(**process, "be the first to come"), Outcome::could);
        EXPECT_EQ(tryIt(**process, "be the first to come"), Outcome::couldNot);
    }
}

TEST(DecoderProcess, RunsBesideOthers) {
    std::vector<std::unique_ptr<DecoderProcess>> all;
    for (int i = 0; i < 6; ++i) {
        auto process = startProbe();
        ASSERT_TRUE(process);
        all.push_back(std::move(*process));
    }
    EXPECT_EQ(tryIt(*all[2], "crash"), Outcome::gone);
    EXPECT_EQ(tryIt(*all[4], "end"), Outcome::gone);
    for (const int i : {5, 3, 1, 0}) EXPECT_EQ(tryIt(*all[i], "read its input"), Outcome::could);
    EXPECT_EQ(tryIt(*all[2], "read its input"), Outcome::gone);
}

TEST(DecoderProcess, StartsFromSeveralThreads) {
    std::vector<int> good(8, 0);
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < good.size(); ++i)
        threads.emplace_back([&good, i] {
            const auto process =
                DecoderProcess::start(decoders::kModels, DecoderBounds{.memoryBytes = 64 << 20});
            good[i] = process.has_value();
        });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(good, std::vector<int>(8, 1));
}

/// What becomes of one that was asked for this.
void expectLost(DecoderProcess& process, const char* what, ErrorCode code, const char* message) {
    EXPECT_EQ(tryIt(process, what), Outcome::gone) << what;
    const Error error = process.lost().value();
    EXPECT_EQ(error.code, code) << what;
    EXPECT_EQ(error.message, message) << what;
}

TEST(DecoderProcess, HasItsSecondsAndNoMore) {
    const auto process = startProbe(1), waited = startProbe(0, 100);
    ASSERT_TRUE(process && waited);
    expectLost(**process, "go on for ever", ErrorCode::failed,
               "its decoder did not end within 1 s of processor time; is the file damaged?");
    expectLost(**waited, "go on for ever", ErrorCode::failed,
               "its decoder did not answer for 0.1 s; try again while less else runs");
}

/// Only what the file did to it is the file's fault.
TEST(DecoderProcess, ThatCrashesIsNotOneThatWasKilled) {
    for (const char* what : {"crash", "overflow its stack", "exit as libraries do"}) {
        const auto process = startProbe();
        ASSERT_TRUE(process);
        expectLost(**process, what, ErrorCode::invalidInput,
                   "the file is damaged: its decoder crashes on it");
    }
    const auto process = startProbe();
    ASSERT_TRUE(process);
    expectLost(**process, "end", ErrorCode::failed,
               "its decoder was killed, perhaps for lack of memory; try again while less else "
               "runs");
}

TEST(DecoderProcess, ThatSaysRubbishIsLeft) {
    const auto process = startProbe();
    ASSERT_TRUE(process);
    EXPECT_EQ(tryIt(**process, "say rubbish"), Outcome::gone);
    EXPECT_EQ(tryIt(**process, "read its input"), Outcome::gone);
}

/// Why none starts when STX_DECODE names `program`.
Error without(const char* program) {
    const Setting setting("STX_DECODE", program);
    const auto process = startProbe();
    EXPECT_FALSE(process) << program;
    return process ? Error{} : process.error();
}

TEST(DecoderProcess, ThatIsNotThereIsOneSentence) {
    const Error missing = without("/nowhere/stx-decode");
    EXPECT_EQ(missing.code, ErrorCode::unsupported);
    EXPECT_EQ(missing.message,
              "the program stx-decode, which reads foreign files, is not at "
              "'/nowhere/stx-decode'; install the stx package whole, or name the program in "
              "STX_DECODE");
    for (const char* other : {"/bin/true", "/bin/false", "/bin/cat"}) {
        const Error wrong = without(other);
        EXPECT_EQ(wrong.code, ErrorCode::failed) << other;
        EXPECT_NE(wrong.message.find("install the stx package anew"), std::string::npos)
            << wrong.message;
    }
    EXPECT_EQ(without("/etc/passwd").code, ErrorCode::failed);
    EXPECT_TRUE(startProbe());
}

TEST(DecoderProcess, WithoutItsModuleSaysWhatToInstall) {
    const Setting module("STX_PROBE", "/nowhere/probe.so");
    const auto process = DecoderProcess::start(kProbe, DecoderBounds{});
    ASSERT_FALSE(process);
    EXPECT_EQ(process.error().code, ErrorCode::unsupported);
    EXPECT_EQ(process.error().message,
              "the probe cannot be loaded: '/nowhere/probe.so' does not exist; build it");
}

TEST(DecoderProcess, BeginsAgainWhenItsMakerIsKilled) {
    ASSERT_TRUE(startProbe());
    // All children of this process are makers.
    const std::string children = "/proc/self/task/" + std::to_string(::getpid()) + "/children";
    std::FILE* list = std::fopen(children.c_str(), "r");
    if (!list) GTEST_SKIP() << "this kernel does not list children";
    int killed = 0;
    for (int pid = 0; std::fscanf(list, "%d", &pid) == 1; ++killed) ::kill(pid, SIGKILL);
    std::fclose(list);
    EXPECT_GT(killed, 0);
    EXPECT_TRUE(startProbe());
}

}  // namespace
}  // namespace stx
