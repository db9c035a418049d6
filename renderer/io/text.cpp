// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/text.h"

#include <algorithm>
#include <charconv>

namespace scolopax::io {
namespace {

constexpr std::string_view kBlank = " \t\r\n\v\f";

/// Length in bytes of the UTF-8 character at the start of the text; 0 if it is not valid.
std::size_t utf8Length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  const std::size_t length = lead < 0x80 ? 1 : lead < 0xC2 ? 0 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
  if (length == 0 || lead > 0xF4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  // Overlong forms, surrogates, and what lies beyond U+10FFFF.
  if ((lead == 0xE0 && byte(1) < 0xA0) || (lead == 0xED && byte(1) > 0x9F) ||
      (lead == 0xF0 && byte(1) < 0x90) || (lead == 0xF4 && byte(1) > 0x8F)) {
    return 0;
  }
  return length;
}

template <class T>
std::optional<T> parseWhole(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string lowerCase(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  return result;
}

std::vector<std::string_view> splitWords(std::string_view text) {
  std::vector<std::string_view> words;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const auto end = std::min(text.find_first_of(kBlank), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

std::optional<std::int64_t> parseInteger(std::string_view text) { return parseWhole<std::int64_t>(text); }
std::optional<double> parseNumber(std::string_view text) { return parseWhole<double>(text); }

std::string cleanText(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = utf8Length(text);
    if (length == 0) {
      result += '?';
    } else if (const auto lead = static_cast<unsigned char>(text[0]); lead >= 0x20 && lead != 0x7F) {
      result += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

std::string inQuotes(std::string_view text) {
  constexpr std::size_t kLongest = 80;
  std::string result(1, '"');
  result += cleanText(text.substr(0, kLongest));
  if (text.size() > kLongest) result += "...";
  return result += '"';
}

std::string shown(const std::filesystem::path& path) { return cleanText(path.string()); }

bool hasEnding(const std::filesystem::path& path, std::string_view ending) {
  return lowerCase(path.filename().string()).ends_with(ending);
}

std::string stemOf(const std::filesystem::path& path) {
  std::filesystem::path name = path.filename();
  if (hasEnding(name, ".gz") || hasEnding(name, ".zarr.zip")) name = name.stem();
  name = name.stem();
  if (hasEnding(name, ".ome")) name = name.stem();
  return cleanText(name.string());
}

}  // namespace scolopax::io
