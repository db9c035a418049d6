// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/zarr_array.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

/// The bits of a float that a document writes as "0x7fc00000".
std::optional<std::uint64_t> zarrHexBits(const std::string& text) {
  if (!text.starts_with("0x") || text.size() < 3 || text.size() > 18) return std::nullopt;
  std::uint64_t bits = 0;
  for (const char c : text.substr(2)) {
    const auto digit = std::string_view("0123456789abcdef").find(lowerCase({&c, 1}));
    if (digit == std::string_view::npos) return std::nullopt;
    bits = bits << 4 | digit;
  }
  return bits;
}

bool isZarrFloat(StoredType type) {
  return type == StoredType::f16 || type == StoredType::f32 || type == StoredType::f64;
}

/// The nearest binary16, as its bits; only of what may be a fill value, so ties need no care.
std::uint16_t halfFromDouble(double value) {
  if (std::isnan(value)) return 0x7E00;
  const auto sign = std::uint16_t(std::signbit(value) ? 0x8000 : 0);
  const double size = std::abs(value);
  if (size == 0) return sign;
  if (size >= 65520) return sign | 0x7C00;
  int exponent = 0;
  std::frexp(size, &exponent);
  const int step = std::max(exponent - 11, -24);  // of the last bit
  const auto steps = int(std::lround(std::ldexp(size, -step)));
  return std::uint16_t(sign + steps + (step + 24) * 1024);
}

template <class T>
void storeZarrNumber(std::array<std::byte, 8>& bytes, T value) {
  std::memcpy(bytes.data(), &value, sizeof value);
}

template <class T>
void storeZarrInteger(const ZarrField& field, std::array<std::byte, 8>& bytes) {
  const nlohmann::json& value = field.value();
  if (value.is_boolean()) return storeZarrNumber(bytes, T(value.get<bool>()));
  if (value.is_number_unsigned() && std::in_range<T>(value.get<std::uint64_t>()))
    return storeZarrNumber(bytes, T(value.get<std::uint64_t>()));
  if (value.is_number_integer() && !value.is_number_unsigned() && std::in_range<T>(value.get<std::int64_t>()))
    return storeZarrNumber(bytes, T(value.get<std::int64_t>()));
  // Some writers give integers as 0.0.
  const double number = value.is_number_float() ? value.get<double>() : std::nan("");
  const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits);
  if (!(number >= double(std::numeric_limits<T>::lowest()) && number < beyond &&
        std::trunc(number) == number))
    field.refuse("a whole number of the array's type");
  storeZarrNumber(bytes, T(number));
}

void storeZarrFloat(const ZarrField& field, StoredType type, std::array<std::byte, 8>& bytes) {
  double number = 0;
  if (!field.isText()) {
    number = field.number();
  } else if (const std::string text = field.text(); text == "NaN") {
    number = std::nan("");
  } else if (text == "Infinity" || text == "-Infinity") {
    number = text[0] == '-' ? -INFINITY : INFINITY;
  } else if (const auto bits = zarrHexBits(text)) {
    return storeZarrNumber(bytes, *bits);  // the low bytes come first
  } else {
    field.refuse("a number, \"NaN\" or \"Infinity\"");
  }
  if (type == StoredType::f16) return storeZarrNumber(bytes, halfFromDouble(number));
  if (type == StoredType::f32) return storeZarrNumber(bytes, float(number));
  storeZarrNumber(bytes, number);
}

ZarrNode nodeOfZarrJson(const ZarrStore& store, const std::string& path, nlohmann::json document) {
  ZarrNode node{.path = path, .format = 3};
  node.documentName = store.shownKey(joinZarrPath(path, "zarr.json")) + ": ";
  const ZarrField field(document, node.documentName);
  if (field["zarr_format"].integer(0, 1 << 20) != 3) field["zarr_format"].refuseUnsupported("3");
  const std::string type = field["node_type"].text();
  if (type != "array" && type != "group") field["node_type"].refuse("array or group");
  node.isArray = type == "array";
  if (field["attributes"].exists() && !field["attributes"].isObject())
    field["attributes"].refuse("an object");
  if (field["attributes"].exists()) node.attributes = std::move(document["attributes"]);
  node.document = std::move(document);
  node.attributesName = node.documentName + "attributes";
  return node;
}

}  // namespace

std::optional<ZarrNode> readZarrNode(const ZarrStore& store, const std::string& path) {
  const auto read = [&](const char* name) { return readZarrJson(store, joinZarrPath(path, name)); };
  if (auto document = read("zarr.json")) return nodeOfZarrJson(store, path, std::move(*document));
  ZarrNode node{.path = path};
  auto document = read(".zarray");
  node.isArray = document.has_value();
  if (!document) document = read(".zgroup");
  auto attributes = read(".zattrs");
  if (!document && !attributes) return std::nullopt;
  node.documentName = store.shownKey(joinZarrPath(path, node.isArray ? ".zarray" : ".zgroup")) + ": ";
  node.attributesName = store.shownKey(joinZarrPath(path, ".zattrs")) + ": ";
  if (document) {
    const ZarrField format(ZarrField(*document, node.documentName)["zarr_format"]);
    if (format.integer(0, 1 << 20) != 2) format.refuseUnsupported("2");
    node.document = std::move(*document);
  }
  if (attributes) node.attributes = std::move(*attributes);
  return node;
}

std::array<std::byte, 8> zarrFillValue(const ZarrField& field, StoredType type) {
  std::array<std::byte, 8> bytes{};
  if (!field.exists()) return bytes;
  if (isZarrFloat(type)) {
    storeZarrFloat(field, type, bytes);
    return bytes;
  }
  switch (type) {
#define X(name, numpyName, T)                                               \
  case StoredType::name:                                                    \
    if constexpr (std::is_integral_v<T>) storeZarrInteger<T>(field, bytes); \
    break;
    SCOLOPAX_STORED_TYPES(X)
#undef X
  }
  return bytes;
}

ZarrArray zarrArrayOf(const ZarrNode& node) {
  constexpr std::int64_t kLargest = std::int64_t(1) << 48;
  const ZarrField document = node.field();
  ZarrArray array;
  array.shape = document["shape"].integers(kMostZarrAxes, 0, kLargest);
  if (array.shape.empty()) document["shape"].refuseUnsupported("at least one axis");
  for (const std::int64_t length : array.shape)
    if (length == 0) document["shape"].refuseUnsupported("at least one voxel");
  array.codecs.order.resize(array.shape.size());
  std::iota(array.codecs.order.begin(), array.codecs.order.end(), std::size_t(0));
  if (node.format == 2)
    readZarr2(node, array);
  else
    readZarr3(node, array);
  return array;
}

}  // namespace scolopax::io
