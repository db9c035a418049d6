// SPDX-License-Identifier: Apache-2.0
// Small text helpers of the loaders: header fields to numbers, independent of the locale, and names and
// messages that stay one printable UTF-8 line whatever a file contains.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scolopax::io {

/// Whether it is one of 0 to 9, in every locale.
constexpr bool isDigit(char c) { return c >= '0' && c <= '9'; }

std::string_view trimmed(std::string_view text);
std::string lowerCase(std::string_view text);
/// The words between spaces, tabs and line ends.
std::vector<std::string_view> splitWords(std::string_view text);

/// The whole text as a decimal number; none if it contains anything else or does not fit.
std::optional<std::int64_t> parseInteger(std::string_view text);
/// Also "nan" and "inf" in any case.
std::optional<double> parseNumber(std::string_view text);

/// Text from a file as a name: valid UTF-8, control characters left out, other bytes become '?'.
std::string cleanText(std::string_view text);
/// Text from a file for a message: clean, in quotes, cut after 80 bytes.
std::string inQuotes(std::string_view text);
/// A path for a message: as it was given, clean.
std::string shown(const std::filesystem::path& path);

/// Whether the file's name, in lower case, ends with `ending` (".nii.gz").
bool hasEnding(const std::filesystem::path& path, std::string_view ending);
/// The file's name without the ending (".nii.gz", ".nrrd", ".ome.tif"), clean: the default name of a channel.
std::string stemOf(const std::filesystem::path& path);

}  // namespace scolopax::io
