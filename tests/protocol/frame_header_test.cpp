// SPDX-License-Identifier: Apache-2.0
// Compares the frame header with bytes that another program (Python's struct) wrote from the documentation;
// the TypeScript client checks the same file.
#include "protocol/frame_header.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/protocol/fixtures.h"

namespace scolopax::protocol {
namespace {

using nlohmann::json;

std::vector<std::byte> bytesOf(const std::string& hex) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

FrameHeader headerOf(const json& fields) {
  FrameHeader header;
  header.headerBytes = fields["headerBytes"];
  header.codec = Codec{fields["codec"].get<std::uint8_t>()};
  header.flags = fields["flags"];
  header.width = fields["width"];
  header.height = fields["height"];
  header.method = fields["method"];
  header.frame = fields["frame"];
  header.revision = fields["revision"];
  header.patch = fields["patch"];
  header.samples = fields["samples"];
  header.error = fields["error"].is_null() ? std::nanf("") : fields["error"].get<float>();
  header.rebuildUs = fields["rebuildUs"];
  header.renderUs = fields["renderUs"];
  header.encodeUs = fields["encodeUs"];
  return header;
}

/// As EXPECT_EQ, but NaN equals NaN.
void expectEqual(FrameHeader a, FrameHeader b) {
  if (std::isnan(a.error) && std::isnan(b.error)) a.error = b.error = 0;
  EXPECT_EQ(a, b);
}

TEST(FrameHeader, IsReadFromTheBytesOfTheFixtures) {
  for (const json& fixture : readFixture("frame_headers.json")) {
    SCOPED_TRACE(fixture["name"].get<std::string>());
    const auto header = decodeFrameHeader(bytesOf(fixture["hex"]));
    ASSERT_EQ(header.has_value(), !fixture["header"].is_null());
    if (header) expectEqual(*header, headerOf(fixture["header"]));
  }
}

TEST(FrameHeader, IsWrittenAsTheBytesOfTheFixtures) {
  int written = 0;
  for (const json& fixture : readFixture("frame_headers.json")) {
    if (fixture["header"].is_null() || fixture["header"]["headerBytes"] != kFrameHeaderBytes) continue;
    SCOPED_TRACE(fixture["name"].get<std::string>());
    std::vector<std::byte> expected = bytesOf(fixture["hex"]);
    expected.resize(kFrameHeaderBytes);
    const auto bytes = encodeFrameHeader(headerOf(fixture["header"]));
    EXPECT_EQ(std::vector<std::byte>(bytes.begin(), bytes.end()), expected);
    ++written;
  }
  EXPECT_EQ(written, 3);
}

}  // namespace
}  // namespace scolopax::protocol
