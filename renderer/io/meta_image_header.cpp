// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/meta_image_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "renderer/io/byte_stream.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLongestMetaImageHeader = 1 << 20;

/// "Key = value" at the first '=' or ':', as MetaIO has it.
std::pair<std::string_view, std::string_view> splitMetaImageLine(std::string_view line) {
  const auto separator = line.find_first_of("=:");
  if (separator == std::string_view::npos) return {};
  return {trimmed(line.substr(0, separator)), trimmed(line.substr(separator + 1))};
}

}  // namespace

bool isMetaImageField(std::string_view name) {
  static constexpr std::array kFields{"ObjectType",
                                      "ObjectSubType",
                                      "NDims",
                                      "BinaryData",
                                      "BinaryDataByteOrderMSB",
                                      "ElementByteOrderMSB",
                                      "CompressedData",
                                      "CompressedDataSize",
                                      "TransformMatrix",
                                      "Rotation",
                                      "Orientation",
                                      "Offset",
                                      "Position",
                                      "Origin",
                                      "CenterOfRotation",
                                      "AnatomicalOrientation",
                                      "DistanceUnits",
                                      "ElementSpacing",
                                      "ElementSize",
                                      "DimSize",
                                      "HeaderSize",
                                      "ElementNumberOfChannels",
                                      "ElementType",
                                      "ElementToIntensityFunctionSlope",
                                      "ElementToIntensityFunctionOffset",
                                      "ElementDataFile"};
  return std::ranges::find(kFields, name) != kFields.end();
}

void MetaImageHeader::addLine(std::string_view line) {
  if (trimmed(line).empty()) return;
  const auto [name, value] = splitMetaImageLine(line);
  if (name.empty()) throw bad("header", "lines of \"Key = value\"", line);
  // Programs add keys of their own, and comments.
  if (!isMetaImageField(name)) return;
  if (!fields_.emplace(name, value).second) throw bad("header", "every field once", name);
}

MetaImageHeader::MetaImageHeader(const fs::path& path) : file(shown(path)) {
  ByteStream stream(path, ByteStream::Encoding::plain);
  std::string text(std::size_t(std::min<std::uint64_t>(stream.largestSize(), kLongestMetaImageHeader)), '\0');
  text.resize(stream.readSome(std::as_writable_bytes(std::span(text))));
  const auto nextLine = [&] {
    const std::size_t end = std::min(text.find('\n', endOffset), text.size());
    const std::string_view line = std::string_view(text).substr(endOffset, end - endOffset);
    endOffset = std::min(end + 1, text.size());
    return line;
  };
  while (endOffset < text.size() && !find({"ElementDataFile"})) addLine(nextLine());
  if (!find({"ElementDataFile"})) {
    const bool cut = stream.largestSize() > text.size();
    throw Error(ErrorCode::badInput,
                file + ": ElementDataFile: " + (cut ? "expected within 1 MiB, found none" : "is missing"));
  }
  if (const auto words = splitWords(require("ElementDataFile")); !words.empty() && words[0] == "LIST") {
    if (stream.largestSize() > text.size())
      throw bad("ElementDataFile", "a header of at most 1 MiB with its list", "LIST");
    while (endOffset < text.size())
      if (const auto name = trimmed(nextLine()); !name.empty()) listed.emplace_back(name);
  }
}

std::optional<std::string_view> MetaImageHeader::find(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    const auto found = fields_.find(name);
    if (found != fields_.end()) return std::string_view(found->second);
  }
  return std::nullopt;
}

std::string_view MetaImageHeader::require(const char* name) const {
  if (const auto value = find({name})) return *value;
  throw Error(ErrorCode::badInput, file + ": " + name + ": is missing");
}

std::vector<double> MetaImageHeader::numbers(std::initializer_list<const char*> names,
                                             std::size_t count) const {
  std::vector<double> values;
  for (const char* name : names) {
    const auto text = find({name});
    if (!text) continue;
    for (const std::string_view word : splitWords(*text)) {
      const auto value = parseNumber(word);
      if (!value || !std::isfinite(*value)) throw bad(name, "numbers", *text);
      values.push_back(*value);
    }
    if (values.size() != count) throw bad(name, std::to_string(count) + " numbers", *text);
    break;
  }
  return values;
}

bool MetaImageHeader::flag(std::initializer_list<const char*> names, bool otherwise) const {
  for (const char* name : names) {
    const auto text = find({name});
    if (!text) continue;
    const std::string value = lowerCase(*text);
    const bool yes = value == "true" || value == "t" || value == "1";
    if (!yes && value != "false" && value != "f" && value != "0") throw bad(name, "True or False", *text);
    return yes;
  }
  return otherwise;
}

std::int64_t MetaImageHeader::integer(const char* name, std::int64_t otherwise, std::int64_t lowest) const {
  const auto text = find({name});
  if (!text) return otherwise;
  const auto value = parseInteger(*text);
  if (!value || *value < lowest) throw bad(name, "a whole number, at least " + std::to_string(lowest), *text);
  return *value;
}

Error MetaImageHeader::bad(std::string_view field, const std::string& expected,
                           std::string_view found) const {
  return Error(ErrorCode::badInput,
               file + ": " + std::string(field) + ": expected " + expected + ", found " + inQuotes(found));
}

Error MetaImageHeader::unsupported(std::string_view field, const std::string& expected,
                                   std::string_view found) const {
  return Error(ErrorCode::unsupported, bad(field, expected, found).what());
}

}  // namespace scolopax::io
