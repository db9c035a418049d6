// SPDX-License-Identifier: Apache-2.0
// Zarr by HTTP, from a server in this program: hosts, redirections, ranges and answers that lie.
#include <gmock/gmock.h>

#include "tests/renderer/io/zarr_test_support.h"

#if __has_include(<curl/curl.h>)
#include <httplib.h>

#include <atomic>
#include <thread>

namespace scolopax::io {
namespace {

using testing::HasSubstr;

/// Serves a hierarchy below /a.zarr on a free port of this machine.
class ZarrHttpTest : public testing::Test {
 protected:
  ZarrHttpTest() {
    server_.Get(R"(/a\.zarr/(.*))", [this](const httplib::Request& request, httplib::Response& response) {
      ++requests_;
      const std::string key = request.matches[1];
      if (answer_ && answer_(key, request, response)) return;
      const auto value = values_.find(key);
      if (value == values_.end())
        response.status = 404;
      else
        response.set_content(value->second, "application/octet-stream");
    });
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
  }
  ~ZarrHttpTest() override {
    while (!server_.is_running()) std::this_thread::yield();
    server_.stop();
    thread_.join();
  }

  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  std::string url() const { return "http://" + host() + "/a.zarr"; }
  std::vector<double> values(const std::string& path) {
    const auto file = openFile(path, {.allowedHosts = {host()}});
    return valuesOf(load(*file, {}, LoadOptions{.memoryLimitBytes = kTestLimit}).channels[0]);
  }
  std::string error() {
    return errorOf([&] { values(url()); });
  }
  std::string error(const std::vector<std::string>& allowed, const std::string& path) {
    return errorOf([&] { openFile(path, {.allowedHosts = allowed}); });
  }

  ZarrValues values_ = image();
  /// May answer a request itself; returns whether it did.
  std::function<bool(const std::string&, const httplib::Request&, httplib::Response&)> answer_;
  std::atomic<int> requests_ = 0;
  int port_ = 0;

 private:
  static ZarrValues image() {
    const ZarrShape shape{3, 4, 5}, chunk{2, 4, 3};
    ZarrValues values{{".zgroup", kGroup2},
                      {".zattrs", multiscales("zyx", {{1, 1, 1}}).dump()},
                      {"0/.zarray", array2(shape, chunk, "<u2").dump()}};
    addChunks(values, shape, chunk, "0/", '.',
              [&](const ZarrShape& first) { return rampChunk<std::uint16_t>(shape, chunk, first); });
    return values;
  }

  httplib::Server server_;
  std::thread thread_;
};

TEST_F(ZarrHttpTest, AnImageLoads) {
  EXPECT_EQ(values(url()), rampUpTo(60));
  EXPECT_EQ(values(url() + "/"), rampUpTo(60));
  const std::vector<std::filesystem::path> names{url()};
  const auto datasets = openDatasets(names, {.allowedHosts = {host()}});
  ASSERT_EQ(datasets.size(), 1u);
  EXPECT_EQ(datasets[0].title, "a.zarr");
}

TEST_F(ZarrHttpTest, MissingChunksHaveTheFillValue) {
  values_.erase("0/1.0.1");
  auto expected = rampUpTo(60);
  for (const std::size_t i : {43u, 44u, 48u, 49u, 53u, 54u, 58u, 59u}) expected[i] = 0;
  EXPECT_EQ(values(url()), expected);
}

TEST_F(ZarrHttpTest, GroupsAreListedByTheirCopyOfAllDocuments) {
  const std::string array = array2({1, 1, 2}, {1, 1, 2}, "|u1").dump();
  values_ = {{".zgroup", kGroup2}, {"a/.zarray", array}, {"g/.zgroup", kGroup2}, {"g/b/.zarray", array}};
  EXPECT_THAT(error(), HasSubstr("expected a volume, found none"));
  values_[".zmetadata"] = R"({"metadata": {".zgroup": {}, "a/.zarray": {}, "g/b/.zarray": {}, "../x": {}}})";
  const auto file = openFile(url(), {.allowedHosts = {host()}});
  ASSERT_EQ(file->volumes.size(), 2u);
  EXPECT_EQ(file->volumes[0].path, "a");
  EXPECT_EQ(file->volumes[1].path, "g/b");
  values_ = {{"zarr.json", R"({"zarr_format": 3, "node_type": "group",
                              "consolidated_metadata": {"metadata": {"a": {}}}})"},
             {"a/.zarray", array}};
  EXPECT_EQ(openFile(url(), {.allowedHosts = {host()}})->volumes.size(), 1u);
}

TEST_F(ZarrHttpTest, OnlyAllowedHostsAreAsked) {
  const std::string refusal =
      "expected a host that --allow-host names, found \"127.0.0.1:" + std::to_string(port_) + "\"";
  EXPECT_THAT(error({}, url()), HasSubstr(refusal));
  EXPECT_THAT(error({"127.0.0.1"}, url()), HasSubstr(refusal)) << "without the port, the usual one is meant";
  EXPECT_THAT(error({"127.0.0.1:1"}, url()), HasSubstr(refusal));
  EXPECT_THAT(error({"localhost:" + std::to_string(port_)}, url()), HasSubstr(refusal));
  EXPECT_THAT(error({host()}, "http://user@" + host() + "/a.zarr"),
              HasSubstr("without user, query and fragment"));
  EXPECT_THAT(error({host()}, "http://" + host() + "/a.zarr?x=1"),
              HasSubstr("without user, query and fragment"));
  EXPECT_THAT(error({host()}, "http://" + host() + "/a.zarr#x"),
              HasSubstr("without user, query and fragment"));
  EXPECT_EQ(requests_, 0);
  EXPECT_EQ(error({host()}, url()), "");
  EXPECT_GT(requests_, 0);
}

TEST_F(ZarrHttpTest, RedirectionsStayOnTheHost) {
  answer_ = [&](const std::string& key, const httplib::Request&, httplib::Response& response) {
    if (key != "0/0.0.0") return false;
    response.set_redirect("http://" + host() + "/a.zarr/moved");
    return true;
  };
  values_["moved"] = values_["0/0.0.0"];
  EXPECT_EQ(values(url()), rampUpTo(60));
  for (const char* target : {"http://localhost:1/x", "http://127.0.0.2/x", "https://example.invalid/"}) {
    answer_ = [target](const std::string& key, const httplib::Request&, httplib::Response& response) {
      if (key == "0/0.0.0") response.set_redirect(target);
      return key == "0/0.0.0";
    };
    EXPECT_THAT(error(), HasSubstr("expected no redirection to another host")) << target;
  }
  answer_ = [](const std::string& key, const httplib::Request&, httplib::Response& response) {
    if (key == "0/0.0.0") response.set_redirect("http://127.0.0.1:1/x");
    return key == "0/0.0.0";
  };
  EXPECT_THAT(error(), HasSubstr("expected a host that --allow-host names")) << "another port";
  answer_ = [](const std::string& key, const httplib::Request&, httplib::Response& response) {
    if (key == "0/0.0.0") response.set_redirect("file:///etc/passwd");
    return key == "0/0.0.0";
  };
  EXPECT_NE(error(), "");
  answer_ = [this](const std::string& key, const httplib::Request&, httplib::Response& response) {
    if (key == "0/0.0.0") response.set_redirect(url() + "/0/0.0.0");
    return key == "0/0.0.0";
  };
  EXPECT_THAT(error(), HasSubstr("expected at most 4 redirections"));
}

TEST_F(ZarrHttpTest, AnswersThatAreTooLongOrFailAreRefused) {
  const auto with = [&](int status, const std::string& body) {
    answer_ = [=](const std::string& key, const httplib::Request&, httplib::Response& response) {
      if (key != "0/0.0.0") return false;
      response.status = status;
      response.set_content(body, "text/plain");
      return true;
    };
    return error();
  };
  EXPECT_THAT(with(200, std::string(1 << 20, 'x')),
              HasSubstr("/a.zarr/0/0.0.0: expected at most 65590 bytes"));
  EXPECT_THAT(with(200, "short"), HasSubstr("expected a chunk of 48 bytes, found 5"));
  EXPECT_THAT(with(500, "no"), HasSubstr("expected the status 200, found 500"));
  EXPECT_THAT(with(403, "no"), HasSubstr("expected the status 200, found 403"));
}

TEST_F(ZarrHttpTest, ShardsAreReadByRanges) {
  const auto from = dataFile("formats/ome_zarr_v3/sharding_index_location");
  SKIP_WITHOUT(from);
  for (const char* place : {"start", "end"}) {
    values_.clear();
    for (const auto& entry : std::filesystem::recursive_directory_iterator(from / place)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path(), std::ios::binary);
      values_[entry.path().lexically_relative(from / place).string()] = {std::istreambuf_iterator<char>(file),
                                                                         {}};
    }
    answer_ = nullptr;
    EXPECT_EQ(values(url()), rampUpTo(4096)) << place;
    answer_ = [this](const std::string& key, const httplib::Request& request, httplib::Response& response) {
      if (!key.starts_with("c/")) return false;
      const_cast<httplib::Request&>(request).ranges.clear();  // a server that does not know ranges
      response.set_content(values_[key], "text/plain");
      return true;
    };
    EXPECT_NE(error(), "") << place;
  }
}

TEST_F(ZarrHttpTest, ACancelledLoadDoesNotWaitForTheServer) {
  using std::chrono::steady_clock;
  const std::stop_source stop;
  // The server may look at it after the test.
  const auto ended = std::make_shared<std::atomic<bool>>(false);
  answer_ = [stop, ended](const std::string& key, const httplib::Request&, httplib::Response&) {
    if (key != "0/0.0.0") return false;
    stop.request_stop();
    for (const auto start = steady_clock::now();
         !*ended && steady_clock::now() - start < std::chrono::seconds(20);)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return false;
  };
  const auto file = openFile(url(), {.allowedHosts = {host()}});
  const auto start = steady_clock::now();
  EXPECT_THAT(errorOf([&] { load(*file, {}, LoadOptions{.stop = stop.get_token()}); }),
              HasSubstr("cancelled"));
  *ended = true;
  EXPECT_LT(steady_clock::now() - start, std::chrono::seconds(15));
}

TEST(ZarrUrls, TheColonOfThePortDoesNotSplit) {
  const auto split = [](const char* name) {
    const DataName parts = splitName(name);
    return parts.path.string() + " " + parts.inner;
  };
  EXPECT_EQ(split("http://h:80/a.zarr"), "http://h:80/a.zarr ");
  EXPECT_EQ(split("https://h:80/a.zarr:labels/n"), "https://h:80/a.zarr labels/n");
  EXPECT_EQ(split("HTTP://h/a.zarr/:0"), "HTTP://h/a.zarr/ 0");
  EXPECT_EQ(split("http://h:80"), "http://h:80 ");
  EXPECT_FALSE(isUrl("https:/h"));
  EXPECT_FALSE(isUrl("file:///h"));
}

TEST_F(ZarrHttpTest, AServerThatIsGoneIsAnError) {
  EXPECT_THAT(error({"127.0.0.1:1"}, "http://127.0.0.1:1/a.zarr"), HasSubstr("http://127.0.0.1:1/a.zarr"));
}

}  // namespace
}  // namespace scolopax::io
#endif
