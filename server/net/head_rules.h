// SPDX-License-Identifier: Apache-2.0
// What is checked on a request's head before anything else looks at it: framing that two parsers could read
// differently, encodings that could expand, names and targets that cannot be decoded.
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

/// Fills `request` but for body, matches and address; or says why the head is refused. A refusal here closes
/// the connection: where the next request begins is not known for sure.
std::optional<Refusal> readHead(const HeadFields& head, std::size_t bodyLimit, Request& request);

/// What a failed read means to the client; nullopt when it is gone and nobody is left to be told.
std::optional<Refusal> refusalOf(const boost::system::error_code& error);

}  // namespace scolopax::net
