// SPDX-License-Identifier: Apache-2.0
// PROTOCOL.md: its section on fields matches the table of fields, and its examples are valid.
#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "protocol/messages.h"
#include "protocol/patch.h"
#include "protocol/scene_json.h"
#include "protocol/schema.h"
#include "renderer/renderer.h"
#include "server/limits.h"
#include "server/scene_resolver.h"
#include "tests/protocol/fixtures.h"

namespace scolopax::protocol {
namespace {

using nlohmann::json;

/// The contents of the fenced code blocks whose opening fence is followed by `fence`.
std::vector<std::string> blocks(const std::string& fence) {
  std::istringstream lines(readText(protocolFile("PROTOCOL.md")));
  std::vector<std::string> found;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    line.erase(0, line.find_first_not_of(' '));  // a block within a list is indented
    if (!inside && line == "```" + fence) {
      inside = true;
      found.emplace_back();
    } else if (inside && line == "```") {
      inside = false;
    } else if (inside) {
      found.back() += line + '\n';
    }
  }
  return found;
}

/// Compares the section between two comments with a generated text.
void expectSection(const std::string& name, const std::string& generated) {
  const std::string begin = "<!-- " + name + ": generated, do not edit -->\n",
                    end = "<!-- end of " + name + " -->";
  const std::string text = readText(protocolFile("PROTOCOL.md"));
  const std::size_t from = text.find(begin), to = text.find(end);
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  expectFile(protocolFile("PROTOCOL.md"), text.substr(0, from) + begin + '\n' + generated + text.substr(to));
}

TEST(ProtocolDocument, HoldsTheSectionOfTheTable) {
  expectSection("fields", fieldsMarkdown(server::rendererLists()));
}

TEST(ProtocolDocument, HoldsTheTableOfLimits) { expectSection("limits", server::limitsMarkdown()); }

TEST(ProtocolDocument, ShowsTheLimitsOfAServerWithoutOptions) {
  for (const std::string& text : blocks("json"))
    if (const json block = parseJson(text); block.contains("limits")) {
      EXPECT_EQ(block["limits"], server::limitsJson(server::Config()));
      return;
    }
  FAIL() << "there are no limits";
}

TEST(ProtocolDocument, StatesWhatTakesMemory) {
  const std::string text = readText(protocolFile("PROTOCOL.md"));
  const auto bytes = [](std::size_t channels, bool aovs) {
    return std::to_string(filmPixelBytes(channels, aovs));
  };
  EXPECT_EQ(filmPixelBytes(3, true), filmPixelBytes(2, true) + 4);
  for (const std::string_view use : kMemoryUses)
    EXPECT_NE(text.find("\n| `" + std::string(use) + "` | "), std::string::npos) << use;
  EXPECT_NE(
      text.find("| `films` | " + bytes(0, false) + " bytes a pixel of a picture; while AOVs are recorded, " +
                bytes(0, true) + " and 4 more for each channel;"),
      std::string::npos);
}

TEST(ProtocolDocument, ShowsScenesThatAreTaken) {
  const auto scenes = blocks("json scene");
  EXPECT_EQ(scenes.size(), 2U);
  for (const std::string& text : scenes)
    EXPECT_NO_THROW(parseScene(parseJson(text), server::rendererLists())) << text;
}

TEST(ProtocolDocument, ShowsPatchesThatAreTaken) {
  const auto patches = blocks("json patch");
  EXPECT_EQ(patches.size(), 5U);
  const json scene = json::parse(R"({"channels": [{"opacity": [[0, 0], [1, 1]]}]})");
  for (const std::string& text : patches) {
    EXPECT_NO_THROW(parseScene(applyPatch(scene, parseJson(text), 4), server::rendererLists())) << text;
  }
}

TEST(ProtocolDocument, ShowsMessagesThatAreTaken) {
  const auto messages = blocks("json message");
  EXPECT_EQ(messages.size(), std::variant_size_v<ClientMessage>);
  for (const std::string& text : messages) EXPECT_NO_THROW(parseClientMessage(text)) << text;
}

TEST(ProtocolDocument, ShowsOnlyJsonWhereItSaysSo) {
  for (const std::string& text : blocks("json")) EXPECT_NO_THROW(parseJson(text)) << text;
}

}  // namespace
}  // namespace scolopax::protocol
