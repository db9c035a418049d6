// SPDX-License-Identifier: Apache-2.0
#include "server/net/client_address.h"

#include <gtest/gtest.h>

namespace scolopax::net {
namespace {

const std::vector<std::string> kProxies{"127.0.0.1", "10.0.0.1", "2001:db8::1"};

std::string behindProxy(const std::vector<std::string>& forwarded, const std::string& peer = "127.0.0.1") {
  Headers headers;
  for (const std::string& value : forwarded) headers.emplace("x-forwarded-for", value);
  return clientAddress(headers, peer, kProxies);
}

TEST(ClientAddress, IsTheLastThatIsNoTrustedProxy) {
  EXPECT_EQ(behindProxy({"192.0.2.7"}), "192.0.2.7");
  EXPECT_EQ(behindProxy({"192.0.2.7, 10.0.0.1"}), "192.0.2.7");
  EXPECT_EQ(behindProxy({"6.6.6.6, 192.0.2.7 ,10.0.0.1"}), "192.0.2.7");
  EXPECT_EQ(behindProxy({"6.6.6.6", "192.0.2.7, 10.0.0.1", "2001:db8::1"}), "192.0.2.7");
  EXPECT_EQ(behindProxy({"nonsense, 192.0.2.7"}), "192.0.2.7");
  EXPECT_EQ(behindProxy({"2001:DB8:0::7"}), "2001:db8::7");
  EXPECT_EQ(behindProxy({"::ffff:192.0.2.7, ::ffff:10.0.0.1"}), "192.0.2.7");
}

TEST(ClientAddress, IsThePeersWhereNothingElseCanBeBelieved) {
  EXPECT_EQ(behindProxy({"192.0.2.7"}, "198.51.100.1"), "198.51.100.1");
  EXPECT_EQ(behindProxy({}), "127.0.0.1");
  EXPECT_EQ(behindProxy({"127.0.0.1, 10.0.0.1"}), "127.0.0.1");
  for (const char* malformed : {"", ",", "192.0.2.7,", "192.0.2.7, unknown", "192.0.2.7:80", "[2001:db8::7]",
                                "192.0.2", "192.0.2.0/24", "192.0.2.7 10.0.0.1", "192.0.2.7, , 10.0.0.1"})
    EXPECT_EQ(behindProxy({malformed}), "127.0.0.1") << malformed;
}

TEST(ClientAddress, HasOneUsualForm) {
  EXPECT_EQ(usualAddress("192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(usualAddress("::FFFF:192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(usualAddress("0:0:0:0:0:0:0:1"), "::1");
  for (const char* none : {"", "localhost", "192.0.2.07x", "192.0.2.7/24", "[::1]", "1.2.3", "::1 "})
    EXPECT_EQ(usualAddress(none), std::nullopt) << none;
}

}  // namespace
}  // namespace scolopax::net
