// SPDX-License-Identifier: Apache-2.0
// Checks a request's head before anything else uses it. Refuses framing that two parsers could read
// differently, encodings that could expand, and names and targets that cannot be decoded.
#pragma once
#include <utility>  // Asio 1.74 needs it first under C++20

#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/system/error_code.hpp>
#include <optional>
#include <string>

#include "server/net/message.h"

namespace scolopax::net {

struct Refusal {
  int status;
  std::string detail;
};

using HeadFields = boost::beast::http::request_header<boost::beast::http::fields>;

/// Fills in `request` except for body, matches and address, or returns why the head is refused. After a
/// refusal the connection must be closed, because it is not certain where the next request begins.
std::optional<Refusal> readHead(const HeadFields& head, std::size_t bodyLimit, Request& request);

/// The refusal to send after a failed read; nullopt if the client has disconnected.
std::optional<Refusal> refusalOf(const boost::system::error_code& error);

}  // namespace scolopax::net
