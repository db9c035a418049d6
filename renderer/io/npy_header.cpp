// SPDX-License-Identifier: Apache-2.0
// The header of a NumPy array: a literal of Python, {'descr': '<f4', 'fortran_order': False, 'shape': (2,
// 3)}.
#include <algorithm>
#include <array>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/npy_array.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

Error npyError(ErrorCode code, const std::string& where, std::string_view field, const std::string& expected,
               std::string_view found) {
  return Error(code,
               where + ": " + std::string(field) + ": expected " + expected + ", found " + inQuotes(found));
}

/// Parses the dictionary strictly: its three keys, each once, and nothing else.
class NpyLiteral {
 public:
  NpyLiteral(const std::string& where, std::string_view text) : where_(where), whole_(text), rest_(text) {
    expect('{');
    while (!accept('}')) {
      const std::string_view key = parseString();
      expect(':');
      parseValue(key);
      if (accept(',')) continue;
      expect('}');
      break;
    }
    if (!trimmed(rest_).empty()) throw bad("nothing after the dictionary", rest_);
    if (!descr || !fortranOrder || !shape)
      throw bad("the keys descr, fortran_order and shape", trimmed(whole_));
  }

  std::optional<std::string_view> descr;
  std::optional<bool> fortranOrder;
  std::optional<std::vector<std::int64_t>> shape;

 private:
  Error bad(const std::string& expected, std::string_view found) const {
    return npyError(ErrorCode::badInput, where_, "header", expected, found);
  }
  void skipBlanks() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size())); }
  bool accept(char c) {
    skipBlanks();
    if (!rest_.starts_with(c)) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void expect(char c) {
    if (!accept(c)) throw bad("\"" + std::string(1, c) + "\"", rest_);
  }

  void parseValue(std::string_view key) {
    skipBlanks();
    if (key == "descr" && !descr) {
      if (rest_.starts_with('['))
        throw npyError(ErrorCode::unsupported, where_, "descr", "one number per element", rest_);
      descr = parseString();
    } else if (key == "fortran_order" && !fortranOrder) {
      fortranOrder = rest_.starts_with("True");
      const std::string_view word = *fortranOrder ? "True" : "False";
      if (!rest_.starts_with(word)) throw bad("True or False", rest_);
      rest_.remove_prefix(word.size());
    } else if (key == "shape" && !shape) {
      shape = parseTuple();
    } else {
      throw bad("the keys descr, fortran_order and shape, each once", key);
    }
  }

  std::string_view parseString() {
    skipBlanks();
    const char quote = rest_.empty() ? '\0' : rest_[0];
    const auto end = rest_.find(quote, 1);
    if ((quote != '\'' && quote != '"') || end == std::string_view::npos) throw bad("a string", rest_);
    const std::string_view text = rest_.substr(1, end - 1);
    if (text.find_first_of("\\\n") != std::string_view::npos) throw bad("a string without \"\\\"", text);
    rest_.remove_prefix(end + 1);
    return text;
  }

  std::vector<std::int64_t> parseTuple() {
    constexpr std::size_t kMostNpyAxes = 64;  // NumPy's own limit
    std::vector<std::int64_t> numbers;
    expect('(');
    while (!accept(')')) {
      skipBlanks();
      const auto digits = std::min(rest_.find_first_not_of("0123456789"), rest_.size());
      const auto number = parseInteger(rest_.substr(0, digits));
      if (!number) throw bad("whole numbers in shape", rest_);
      if (numbers.size() == kMostNpyAxes) throw bad("at most 64 axes", whole_);
      numbers.push_back(*number);
      rest_.remove_prefix(digits);
      if (rest_.starts_with('L')) rest_.remove_prefix(1);  // of Python 2
      if (accept(',')) continue;
      expect(')');
      if (numbers.size() == 1) throw bad("a comma in a tuple of one", trimmed(whole_));
      break;
    }
    return numbers;
  }

  const std::string& where_;
  std::string_view whole_, rest_;
};

/// "<f4": byte order, kind and bytes of an element.
void setNpyType(const std::string& where, std::string_view descr, NpyHeader& header) {
  struct Row {
    std::string_view code;
    StoredType type;
  };
  static constexpr std::array kTypes{
      Row{"b1", StoredType::u8},  Row{"i1", StoredType::i8},  Row{"u1", StoredType::u8},
      Row{"i2", StoredType::i16}, Row{"u2", StoredType::u16}, Row{"i4", StoredType::i32},
      Row{"u4", StoredType::u32}, Row{"i8", StoredType::i64}, Row{"u8", StoredType::u64},
      Row{"f2", StoredType::f16}, Row{"f4", StoredType::f32}, Row{"f8", StoredType::f64}};
  const std::string_view code = descr.substr(std::min<std::size_t>(1, descr.size()));
  if (code.starts_with('O'))
    throw npyError(ErrorCode::unsupported, where, "descr", "numbers, not pickled Python objects", descr);
  for (const Row& row : kTypes) {
    if (row.code != code) continue;
    header.type = row.type;
    header.bigEndian = descr[0] == '>';
    const bool ordered = descr[0] == '<' || descr[0] == '>' || descr[0] == '=';
    if (!ordered && (descr[0] != '|' || sizeBytes(row.type) > 1)) break;
    return;
  }
  throw npyError(ErrorCode::unsupported, where, "descr", "a type of real numbers such as '<f4' or '|u1'",
                 descr);
}

}  // namespace

NpyHeader readNpyHeader(const std::string& where, NpySource& source) {
  std::array<unsigned char, 8> start{};
  source.read(std::as_writable_bytes(std::span(start)));
  const std::string_view magic(reinterpret_cast<const char*>(start.data()), kNpyMagic.size());
  if (magic != kNpyMagic) throw npyError(ErrorCode::badInput, where, "magic", "\\x93NUMPY", magic);
  const int version = start[6];
  if (version < 1 || version > 3 || start[7] != 0)
    throw npyError(ErrorCode::unsupported, where, "version", "1.0, 2.0 or 3.0",
                   std::to_string(version) + "." + std::to_string(start[7]));
  const std::size_t lengthBytes = version == 1 ? 2 : 4;
  std::array<unsigned char, 4> lengths{};
  source.read(std::as_writable_bytes(std::span(lengths)).first(lengthBytes));
  std::size_t length = 0;
  for (std::size_t i = 0; i < lengthBytes; ++i) length |= std::size_t(lengths[i]) << (8 * i);
  constexpr std::size_t kLongestNpyHeader = 1 << 20;
  if (length > kLongestNpyHeader)
    throw npyError(ErrorCode::badInput, where, "header length", "at most 1 MiB", std::to_string(length));
  std::string text(length, '\0');
  source.read(std::as_writable_bytes(std::span(text)));

  const NpyLiteral literal(where, text);
  NpyHeader header{.fortranOrder = *literal.fortranOrder,
                   .shape = *literal.shape,
                   .dataOffset = start.size() + lengthBytes + length};
  setNpyType(where, *literal.descr, header);
  return header;
}

}  // namespace scolopax::io
