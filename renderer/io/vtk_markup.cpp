// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/vtk_markup.h"

#include <algorithm>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/vtk_chars.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kMostVtkTags = 16 << 20;

/// Copies the tags of a file, and puts the position of each text in its place.
class VtkTagReader {
 public:
  VtkTagReader(const std::string& file, VtkChars& chars) : file_(file), chars_(chars) {}

  /// Reads to the end, or behind the tag of AppendedData. Returns whether it found that.
  bool read() {
    for (;;) {
      readText();
      if (chars_.peek() < 0) return false;
      const std::size_t start = tags_.size();
      readTag();
      const std::string_view tag = std::string_view(tags_).substr(start);
      if (tag.starts_with("<AppendedData") && tag.ends_with('>') && !tag.ends_with("/>")) return true;
    }
  }
  std::string& tags() { return tags_; }

 private:
  void readText() {
    const std::uint64_t begin = chars_.position();
    bool blank = true;
    for (std::string_view some = chars_.buffered(); !some.empty(); some = chars_.buffered()) {
      const std::string_view text = some.substr(0, some.find('<'));
      blank = blank && trimmed(text).empty();
      chars_.take(text.size());
      if (text.size() < some.size()) break;
    }
    if (!blank) tags_ += std::to_string(begin) + ' ' + std::to_string(chars_.position());
  }

  /// From '<' to '>', which may also be in quotes and in comments.
  void readTag() {
    const std::size_t start = tags_.size();
    char quote = 0;
    for (int c = chars_.get(); c >= 0; c = chars_.get()) {
      tags_ += char(c);
      if (tags_.size() > kMostVtkTags)
        throw Error(ErrorCode::unsupported, file_ + ": expected at most 16 MiB of XML tags, found more");
      const std::string_view tag = std::string_view(tags_).substr(start);
      if (tag.starts_with("<!--")) {
        if (tag.size() >= 7 && tag.ends_with("-->")) return;
      } else if (quote) {
        if (c == quote) quote = 0;
      } else if (c == '"' || c == '\'') {
        quote = char(c);
      } else if (c == '>') {
        return;
      }
    }
  }

  const std::string& file_;
  VtkChars& chars_;
  std::string tags_;
};

}  // namespace

VtkMarkup::VtkMarkup(const std::filesystem::path& path) : file(shown(path)) {
  VtkChars chars(path);
  VtkTagReader reader(file, chars);
  if (reader.read()) {
    while (isVtkBlank(chars.peek())) chars.get();
    if (chars.get() != '_')
      throw Error(ErrorCode::badInput, file + ": AppendedData: expected \"_\" before the data");
    appended_ = {chars.position(), chars.position() + chars.left()};
    reader.tags() += "</AppendedData></VTKFile>";
  }
  const std::string& tags = reader.tags();
  const auto result =
      document_.load_buffer(tags.data(), tags.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result || !root())
    throw Error(ErrorCode::badInput, file + ": expected XML with an element VTKFile, found " +
                                         (result ? "another" : cleanText(result.description())));
}

VtkText VtkMarkup::textOf(const pugi::xml_node& element) {
  const std::string text = element.text().get();
  const auto words = splitWords(text);
  if (words.size() != 2) return {};
  const auto begin = parseInteger(words[0]), end = parseInteger(words[1]);
  if (!begin || !end || *begin < 0 || *end < *begin) return {};
  return {std::uint64_t(*begin), std::uint64_t(*end)};
}

}  // namespace scolopax::io
