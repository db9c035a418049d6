// SPDX-License-Identifier: Apache-2.0
#include "protocol/problem.h"

#include <nlohmann/json.hpp>

namespace scolopax::protocol {

std::string shortened(std::string_view text, std::size_t most) {
  if (text.size() <= most) return std::string(text);
  constexpr std::string_view kMore = "...";
  std::size_t end = most - kMore.size();
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return std::string(text.substr(0, end)).append(kMore);
}

ProtocolError limitReached(int status, std::uint64_t limit, std::string_view what) {
  return {status, "",
          "the limit of " + std::to_string(limit) + " " + std::string(what) + " is reached; retry later"};
}

std::string_view statusTitle(int status) {
  switch (status) {
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 406:
      return "Not Acceptable";
    case 408:
      return "Request Timeout";
    case 409:
      return "Conflict";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 415:
      return "Unsupported Media Type";
    case 417:
      return "Expectation Failed";
    case 421:
      return "Misdirected Request";
    case 422:
      return "Unprocessable Content";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Error";
  }
}

std::string problemJson(int status, std::string_view detail, std::string_view pointer) {
  // ordered_json, because alphabetical order would be hard to read.
  nlohmann::ordered_json body{
      {"type", "about:blank"}, {"title", statusTitle(status)}, {"status", status}, {"detail", detail}};
  if (!pointer.empty()) body["pointer"] = pointer;
  return body.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string problemJson(const ProtocolError& error) {
  return problemJson(error.status, error.what(), error.pointer);
}

}  // namespace scolopax::protocol
