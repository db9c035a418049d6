// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/vtk_legacy_reader.h"

namespace scolopax::io {
namespace {

constexpr std::int64_t kMostVtkComponents = 4096;

/// Type of an array; `bit` is u8.
std::optional<StoredType> vtkLegacyType(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, StoredType>, 16> kTypes{
      {{"bit", StoredType::u8},
       {"unsigned_char", StoredType::u8},
       {"char", StoredType::i8},
       {"signed_char", StoredType::i8},
       {"unsigned_short", StoredType::u16},
       {"short", StoredType::i16},
       {"unsigned_int", StoredType::u32},
       {"int", StoredType::i32},
       {"unsigned_long", StoredType::u64},
       {"long", StoredType::i64},
       {"vtktypeuint64", StoredType::u64},
       {"vtktypeint64", StoredType::i64},
       {"vtkidtype", StoredType::i32},
       {"float", StoredType::f32},
       {"double", StoredType::f64},
       {"unsigned_long_long", StoredType::u64}}};
  const std::string lower = lowerCase(name);
  const auto found =
      std::ranges::find(kTypes, std::string_view(lower), &std::pair<std::string_view, StoredType>::first);
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

/// "%20" becomes a blank, as writers encode names.
std::string vtkDecodedName(std::string_view text) {
  std::string name;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto hex = [&](std::size_t at) {
      static constexpr std::string_view kDigits = "0123456789abcdef";
      return at < text.size() ? kDigits.find(lowerCase(text.substr(at, 1))) : std::string_view::npos;
    };
    const std::size_t high = text[i] == '%' ? hex(i + 1) : std::string_view::npos, low = hex(i + 2);
    if (high != std::string_view::npos && low != std::string_view::npos) {
      name += char(high * 16 + low);
      i += 2;
    } else {
      name += text[i];
    }
  }
  return name;
}

}  // namespace

VtkArray VtkLegacyReader::array(std::string_view name, std::string_view typeName, std::size_t components,
                                std::uint64_t tuples) {
  VtkArray array{.file = file_, .name = vtkDecodedName(name), .components = components, .path = path_};
  const auto type = vtkLegacyType(typeName);
  if (!type) throw unsupportedVtk(array.where(), "a type of numbers", typeName);
  array.type = *type;
  array.bits = binary_ && lowerCase(typeName) == "bit";
  array.coding = binary_ ? VtkCoding::raw : VtkCoding::ascii;
  array.bigEndian = true;
  array.begin = chars_.position();
  const std::uint64_t count = saturatingProduct(tuples, components);
  array.end = array.begin + chars_.left();
  checkVtkArrayFits(array, count);
  if (binary_) {
    const std::uint64_t bytes = array.bits ? count / 8 + (count % 8 > 0) : count * sizeBytes(*type);
    if (!chars_.skip(bytes)) throw bad("array " + inQuotes(name), byteCount(bytes), "the end of the file");
  } else {
    for (std::uint64_t i = 0; i < count; ++i) {
      if (chars_.word().empty())
        throw bad("array " + inQuotes(name), std::to_string(count) + " numbers", std::to_string(i));
    }
  }
  array.end = chars_.position();
  return array;
}

void VtkLegacyReader::keep(VtkArray array) {
  constexpr std::size_t kMostArrays = 4096;
  if (!arrays_) throw bad("array " + inQuotes(array.name), "POINT_DATA or CELL_DATA before it", "none");
  if (arrays_->size() == kMostArrays)
    throw Error(ErrorCode::unsupported, file_ + ": expected at most 4096 arrays, found more");
  arrays_->push_back(std::move(array));
}

/// Lines up to an empty one.
void VtkLegacyReader::skipMetadata() {
  while (chars_.peek() >= 0 && !trimmed(chars_.line()).empty()) {
  }
}

/// A line for each string in text; in binary, its length in 6, 14, 30 or 62 bits, whose number the highest
/// two bits tell, and its bytes.
void VtkLegacyReader::skipStrings(std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    if (chars_.peek() < 0) throw bad("array of strings", std::to_string(count), std::to_string(i));
    if (!binary_) {
      chars_.line();
      continue;
    }
    const int first = chars_.get();
    auto length = std::uint64_t(first & 63);
    const int more = first >= 192 ? 0 : first >= 128 ? 1 : first >= 64 ? 3 : 7;
    for (int k = 0; k < more; ++k) length = length << 8 | std::uint64_t(std::max(chars_.get(), 0));
    if (!chars_.skip(length)) throw bad("array of strings", byteCount(length), "the end of the file");
  }
}

/// FIELD: arrays with a line "name components tuples type" each.
void VtkLegacyReader::readFieldArrays(const Words& words, const std::string& line) {
  if (words.size() != 2) throw bad("FIELD", "a name and a number of arrays", line);
  const std::uint64_t count = countOf("FIELD", words[1]);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::string name(chars_.word());
    while (name == "METADATA") {
      chars_.line();
      skipMetadata();
      name = chars_.word();
    }
    const std::string rest = chars_.line();
    const Words told = splitWords(rest);
    if (name.empty() || told.size() != 3)
      throw bad("FIELD", "\"name components tuples type\" for each array", name + " " + rest);
    const std::uint64_t components = countOf("FIELD", told[0]), tuples = countOf("FIELD", told[1]);
    const std::string where = file_ + ": array " + inQuotes(name);
    if (lowerCase(told[2]) == "string" || lowerCase(told[2]) == "utf8_string") {
      skipStrings(saturatingProduct(components, tuples));
      warn_(where + ": of type \"string\", is left out");
      continue;
    }
    if (components < 1 || components > std::uint64_t(kMostVtkComponents))
      throw unsupportedVtk(where, "1 to 4096 components", told[0]);
    VtkArray field = array(name, told[2], std::size_t(components), tuples);
    if (arrays_ && tuples == tuples_)
      keep(std::move(field));
    else
      warn_(where + ": of other length than the data, is left out");
  }
}

/// A keyword of POINT_DATA or CELL_DATA, with the name of an array behind it.
void VtkLegacyReader::readAttribute(const std::string& keyword, const Words& words, const std::string& line) {
  struct Kind {
    std::string_view keyword;
    std::size_t components;
  };
  static constexpr std::array kKinds{Kind{"vectors", 3},   Kind{"normals", 3},    Kind{"tensors", 9},
                                     Kind{"tensors6", 6},  Kind{"global_ids", 1}, Kind{"pedigree_ids", 1},
                                     Kind{"edge_flags", 1}};
  const auto number = [&](std::size_t i) -> std::size_t {
    const auto count = i < words.size() ? parseInteger(words[i]) : std::nullopt;
    if (!count || *count < 1 || *count > kMostVtkComponents) throw bad(keyword, "1 to 4096 components", line);
    return std::size_t(*count);
  };
  if (words.size() < 2) throw bad(keyword, "a name and a type behind it", line);
  if (keyword == "scalars") {
    const std::size_t components = words.size() > 2 ? number(2) : 1;
    if (const std::string table(chars_.word()); lowerCase(table) != "lookup_table")
      throw bad("SCALARS", "LOOKUP_TABLE behind it", table);
    chars_.line();
    keep(array(words[0], words[1], components, tuples_));
  } else if (keyword == "color_scalars") {
    keep(array(words[0], binary_ ? "unsigned_char" : "float", number(1), tuples_));
  } else if (keyword == "lookup_table") {  // of colours: red, green, blue and opacity
    array(words[0], binary_ ? "unsigned_char" : "float", 4, countOf(keyword, words[1]));
  } else if (keyword == "texture_coordinates") {
    if (words.size() != 3) throw bad(keyword, "a name, a number of components and a type", line);
    keep(array(words[0], words[2], number(1), tuples_));
  } else if (const auto kind = std::ranges::find(kKinds, std::string_view(keyword), &Kind::keyword);
             kind != kKinds.end()) {
    keep(array(words[0], words[1], kind->components, tuples_));
  } else {
    throw bad("keyword", "one of the format", keyword);
  }
}

}  // namespace scolopax::io
