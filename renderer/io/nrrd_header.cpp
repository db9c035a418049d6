// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/nrrd_header.h"

#include <algorithm>
#include <span>

#include "renderer/io/byte_stream.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLongestHeader = 1 << 20;

std::string unescaped(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape = text[i] == '\\' && i + 1 < text.size() && (text[i + 1] == 'n' || text[i + 1] == '\\');
    if (escape)
      result += text[++i] == 'n' ? '\n' : '\\';
    else
      result += text[i];
  }
  return result;
}

}  // namespace

std::optional<std::string_view> NrrdHeader::find(const std::string& field) const {
  const auto found = fields_.find(field);
  if (found == fields_.end()) return std::nullopt;
  return std::string_view(found->second);
}

std::string_view NrrdHeader::require(const std::string& field) const {
  if (const auto value = find(field)) return *value;
  throw Error(ErrorCode::badInput, file + ": " + field + ": is missing");
}

Error NrrdHeader::bad(std::string_view field, const std::string& expected, std::string_view found) const {
  return Error(ErrorCode::badInput,
               file + ": " + std::string(field) + ": expected " + expected + ", found " + inQuotes(found));
}

Error NrrdHeader::unsupported(std::string_view field, const std::string& expected,
                              std::string_view found) const {
  return Error(ErrorCode::unsupported, bad(field, expected, found).what());
}

void NrrdHeader::addLine(std::string_view line) {
  if (line.starts_with('#')) return;
  // The first colon decides: "field: value" or "key:=value".
  const auto colon = line.find(':');
  if (colon != std::string_view::npos && line.substr(colon).starts_with(":=")) {
    pairs[unescaped(line.substr(0, colon))] = unescaped(line.substr(colon + 2));
    return;
  }
  if (colon == std::string_view::npos) throw bad("header", "lines of \"field: value\"", line);
  std::string name = lowerCase(trimmed(line.substr(0, colon)));
  static const std::map<std::string, std::string> kOtherSpellings = {
      {"datafile", "data file"},      {"byteskip", "byte skip"}, {"lineskip", "line skip"},
      {"axismins", "axis mins"},      {"axismaxs", "axis maxs"}, {"centers", "centerings"},
      {"sampleunits", "sample units"}};
  if (const auto other = kOtherSpellings.find(name); other != kOtherSpellings.end()) name = other->second;
  if (!fields_.emplace(name, trimmed(line.substr(colon + 1))).second)
    throw bad("header", "every field once", name);
}

NrrdHeader::NrrdHeader(const fs::path& path) : file(shown(path)) {
  ByteStream stream(path, ByteStream::Encoding::plain);
  std::string text(std::size_t(std::min<std::uint64_t>(stream.largestSize(), kLongestHeader)), '\0');
  text.resize(stream.readSome(std::as_writable_bytes(std::span(text))));
  const std::string_view magic = std::string_view(text).substr(0, 8);
  if (magic.size() < 8 || !magic.starts_with("NRRD000") || magic[7] < '1' || magic[7] > '5') {
    throw bad("magic", "NRRD0001 to NRRD0005", magic);
  }
  std::size_t at = text.find('\n');
  while (at != std::string::npos && at + 1 < text.size()) {
    const std::size_t start = at + 1;
    at = text.find('\n', start);
    if (at == std::string::npos && stream.largestSize() > text.size()) break;
    std::string_view line = std::string_view(text).substr(start, at == std::string::npos ? at : at - start);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) {
      attachedOffset = at + 1;
      return;
    }
    addLine(line);
    if (find("data file").value_or("").starts_with("LIST")) return;  // the rest are file names
  }
  if (stream.largestSize() > text.size()) {
    throw Error(ErrorCode::badInput, file + ": header: expected an empty line within 1 MiB, found none");
  }
}

}  // namespace scolopax::io
