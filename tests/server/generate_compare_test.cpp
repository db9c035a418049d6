// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "renderer/core/error.h"
#include "renderer/io/image_file.h"
#include "server/commands/compare.h"
#include "server/commands/generate.h"

namespace scolopax {
namespace {

class Commands : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("scolopax-commands-" + std::to_string(getpid()) + "-" +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// Runs `scolopax ARGUMENTS...` and returns its output.
  static std::string run(std::vector<std::string> arguments) {
    CLI::App app;
    addGenerateCommand(app);
    addCompareCommand(app);
    std::reverse(arguments.begin(), arguments.end());  // CLI11 expects a vector in reverse order
    testing::internal::CaptureStdout();
    try {
      app.parse(arguments);
    } catch (...) {
      testing::internal::GetCapturedStdout();
      throw;
    }
    return testing::internal::GetCapturedStdout();
  }

  std::string writePicture(const std::string& name, int width, glm::vec4 value) const {
    io::writeImage(path(name), Image{width, 2, std::vector<glm::vec4>(std::size_t(width) * 2, value)}, {});
    return path(name);
  }

  std::filesystem::path folder_;
};

TEST_F(Commands, GenerateLeavesTheFileBeforeWhenItCannotWriteAll) {
  const std::string file = path("a.nrrd");
  std::ofstream(file) << "before";
  rlimit before;
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1024;  // like a disk that runs full
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(run({"generate", "orbitals", file, "--size", "8"}), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(std::filesystem::file_size(file), 6u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(Commands, CompareTellsHowFarPicturesAreApart) {
  const std::string a = writePicture("a.exr", 3, {0.5f, 0.5f, 0.5f, 0.5f}),
                    b = writePicture("b.tif", 3, {0.25f, 0.25f, 0.25f, 0.25f});
  const auto json = nlohmann::json::parse(run({"compare", a, b, "--json"}));
  EXPECT_EQ(json.at("rmse"), 0.25);
  EXPECT_EQ(json.at("max"), 0.25);
  EXPECT_NEAR(json.at("psnr").get<double>(), 12.0411998, 1e-6);
  EXPECT_NEAR(json.at("relative").get<double>(), 0.0625 / (0.0625 + 0.01),
              1e-9);  // the second is the reference
  // L* of 1/2 and 1/4 are 76.0693 and 57.0754: 0.95 x 18.9939^0.7 / (0.4 x 41.2761).
  EXPECT_NEAR(json.at("flip").get<double>(), 0.45185, 1e-5);
  EXPECT_EQ(json.size(), 5u);
  EXPECT_THAT(
      run({"compare", a, b}),
      testing::StartsWith("rmse 0.25\npsnr 12.0411998 dB\nmax  0.25\nrelative 0.862068966\nflip 0.45184"));
}

TEST_F(Commands, CompareWritesThePictureOfTheDifference) {
  Image gray{40, 30, std::vector<glm::vec4>(40 * 30, glm::vec4(0.5f, 0.5f, 0.5f, 1))}, dark = gray;
  for (std::size_t i = 0; i < dark.pixels.size(); ++i)
    if (i % 40 >= 20) dark.pixels[i] = {0, 0, 0, 1};
  io::writeImage(path("a.exr"), gray, {});
  io::writeImage(path("b.exr"), dark, {});
  run({"compare", path("a.exr"), path("b.exr"), "--json", "--difference", path("d.png")});
  const Image difference = io::readImage(path("d.png"));
  ASSERT_EQ(difference.width, 40);
  ASSERT_EQ(difference.height, 30);
  const auto sum = [&](std::size_t x) {
    const glm::vec4& p = difference.pixels[15 * 40 + x];
    return p.x + p.y + p.z;
  };
  EXPECT_LT(sum(2), 0.01f);  // equal: black
  EXPECT_GT(sum(37), 0.9f);  // different: bright
  EXPECT_THROW(run({"compare", path("a.exr"), path("b.exr"), "--difference", path("none/d.png")}), Error);
}

TEST_F(Commands, CompareOfEqualPicturesHasNoPsnr) {
  const std::string a = writePicture("a.exr", 3, {0.5f, 0.5f, 0.5f, 1});
  const auto json = nlohmann::json::parse(run({"compare", a, a, "--json"}));
  EXPECT_EQ(json.at("rmse"), 0);
  EXPECT_EQ(json.at("max"), 0);
  EXPECT_EQ(json.at("relative"), 0);
  EXPECT_EQ(json.at("flip"), 0);
  EXPECT_TRUE(json.at("psnr").is_null());
}

TEST_F(Commands, CompareRefusesOtherSizesAndFilesThatAreNotThere) {
  const std::string a = writePicture("a.exr", 3, glm::vec4(0)), b = writePicture("b.exr", 4, glm::vec4(0));
  EXPECT_THROW(run({"compare", a, b}), Error);
  EXPECT_THROW(run({"compare", a, path("none.exr")}), Error);
  EXPECT_THROW(run({"compare", a}), CLI::ParseError);
}

TEST_F(Commands, GenerateWritesAnNrrdOfTheSizeAskedFor) {
  run({"generate", "orbitals", path("o.nrrd"), "--size", "10", "--channels", "3"});
  std::ifstream file(path("o.nrrd"), std::ios::binary);
  std::stringstream content;
  content << file.rdbuf();
  EXPECT_EQ(content.str().substr(0, 4), "NRRD");
  EXPECT_NE(content.str().find("sizes: 10 10 10 3"), std::string::npos);
  const auto header = content.str().find("\n\n");
  ASSERT_NE(header, std::string::npos);
  EXPECT_EQ(content.str().size() - (header + 2), 10u * 10 * 10 * 3 * 2);
}

TEST_F(Commands, GenerateRefusesBadUsageAndPlacesItCannotWriteTo) {
  EXPECT_THROW(run({"generate"}), CLI::ParseError);
  EXPECT_THROW(run({"generate", "orbitals"}), CLI::ParseError);
  EXPECT_THROW(run({"generate", "orbitals", path("o.nrrd"), "--size", "1"}), CLI::ParseError);
  EXPECT_THROW(run({"generate", "orbitals", path("o.nrrd"), "--size", "1025"}), CLI::ParseError);
  EXPECT_THROW(run({"generate", "orbitals", path("o.nrrd"), "--channels", "13"}), CLI::ParseError);
  EXPECT_THROW(run({"generate", "orbitals", path("none/o.nrrd"), "--size", "4"}), Error);
  EXPECT_FALSE(std::filesystem::exists(path("o.nrrd")));
}

}  // namespace
}  // namespace scolopax
