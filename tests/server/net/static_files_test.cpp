// SPDX-License-Identifier: Apache-2.0
#include "server/net/static_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "server/net/server.h"

namespace scolopax::net {
namespace {

namespace fs = std::filesystem;

class StaticFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    base_ = fs::path(testing::TempDir()) / ("static_files_" + std::to_string(::getpid()));
    fs::create_directories(base_ / "page/assets");
    write("page/index.html", "<p>");
    write("page/assets/index-abc.js", "1");
    write("page/.hidden", "secret");
    write("page2", "secret");
    write("secret.txt", "secret");
    fs::create_symlink(base_ / "secret.txt", base_ / "page/link.txt");
  }
  void TearDown() override { fs::remove_all(base_); }
  void write(const std::string& name, const std::string& text) const { std::ofstream(base_ / name) << text; }

  fs::path base_;
};

TEST_F(StaticFilesTest, FindsFilesAndTheIndex) {
  const StaticFiles files((base_ / "page").string());
  EXPECT_EQ(files.find("/"), fs::canonical(base_ / "page/index.html"));
  EXPECT_EQ(files.find("/index.html"), fs::canonical(base_ / "page/index.html"));
  EXPECT_EQ(files.find("/assets/index-abc.js"), fs::canonical(base_ / "page/assets/index-abc.js"));
}

TEST_F(StaticFilesTest, FindsNothingOutsideTheFolder) {
  const StaticFiles files((base_ / "page").string());
  for (const char* path :
       {"/../secret.txt", "/assets/../../secret.txt", "//../secret.txt", "/..\\secret.txt", "/../page2",
        "/link.txt", "/.hidden", "/assets", "/assets/", "/none", "/etc/passwd", "//etc/passwd"}) {
    EXPECT_FALSE(files.find(path)) << path;
  }
}

TEST_F(StaticFilesTest, SendsTypesAndCachingThatFitTheName) {
  const StaticFiles files((base_ / "page").string());
  const Response index = files.respond(*files.find("/"), Request{});
  EXPECT_EQ(index.contentType, "text/html; charset=utf-8");
  EXPECT_EQ(index.body, "<p>");
  EXPECT_EQ(index.headers.at(1).second, "private, no-cache");
  const Response script = files.respond(*files.find("/assets/index-abc.js"), Request{});
  EXPECT_EQ(script.contentType, "text/javascript; charset=utf-8");
  EXPECT_EQ(script.headers.at(1).second, "private, max-age=31536000, immutable");
}

TEST_F(StaticFilesTest, AnswersNotModifiedToTheSameTagOnly) {
  const StaticFiles files((base_ / "page").string());
  Request request;
  request.headers.emplace("If-None-Match", files.respond(*files.find("/"), Request{}).headers.at(0).second);
  EXPECT_EQ(files.respond(*files.find("/"), request).status, 304);
  write("page/index.html", "<p>longer");
  EXPECT_EQ(files.respond(*files.find("/"), request).status, 200);
}

TEST_F(StaticFilesTest, NamesAFolderThatIsNotThere) {
  EXPECT_THROW(StaticFiles((base_ / "none").string()), NetError);
  EXPECT_FALSE(StaticFiles("").find("/"));
}

}  // namespace
}  // namespace scolopax::net
