// SPDX-License-Identifier: Apache-2.0
// Files of protocol/ that tests read, and rewrite on request.
#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace scolopax::protocol {

inline std::string protocolFile(const std::string& name) {
  return std::string(SCOLOPAX_SOURCE_DIR) + "/protocol/" + name;
}

inline std::string readText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path << " cannot be read";
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline nlohmann::json readFixture(const std::string& name) {
  return nlohmann::json::parse(readText(protocolFile("fixtures/" + name)));
}

/// Compares a generated text with the file; with SCOLOPAX_UPDATE=1 in the environment, writes it instead.
inline void expectFile(const std::string& path, const std::string& expected) {
  const char* update = std::getenv("SCOLOPAX_UPDATE");
  if (update != nullptr && std::string(update) == "1") {
    std::ofstream(path, std::ios::binary) << expected;
    return;
  }
  EXPECT_EQ(readText(path), expected) << path << " is not what the table of fields says; run this test with "
                                      << "SCOLOPAX_UPDATE=1 and commit the file";
}

}  // namespace scolopax::protocol
