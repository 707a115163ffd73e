#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

/// An empty folder for one test, gone afterwards.
class TemporaryFolder {
  public:
    /// `what` is for who finds it: a test that was killed leaves it.
    explicit TemporaryFolder(const std::string& what = "test") {
        std::string name =
            (std::filesystem::temp_directory_path() / ("stx-" + what + "-XXXXXX")).string();
        path_ = ::mkdtemp(name.data());
    }
    ~TemporaryFolder() {
        std::error_code ec;
        std::filesystem::remove_all(path_, ec);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
        return path_ / name;
    }

  private:
    std::filesystem::path path_;
};
