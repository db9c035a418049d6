// SPDX-License-Identifier: Apache-2.0
// The client of a request that a proxy may have passed on. Used by HttpConnection once the head has been
// read.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "server/net/message.h"

namespace scolopax::net {

/// An IP address as servers write it; one of IPv4 also where it is written as IPv6 (`::ffff:192.0.2.1`).
/// nullopt for anything else, such as a name, a network or an address with a port.
std::optional<std::string> usualAddress(const std::string& text);

/// The address of the client whose request came from `peer`. If that is a trusted proxy, it is the last
/// address in X-Forwarded-For that is none: every proxy appends the address it sees, and what stands before
/// that can be anybody's invention. Without such an address, or if it or one after it is malformed, it is
/// `peer`. All addresses are written as usualAddress() does.
std::string clientAddress(const Headers& headers, const std::string& peer,
                          const std::vector<std::string>& trustedProxies);

}  // namespace scolopax::net
