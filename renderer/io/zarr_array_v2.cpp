// SPDX-License-Identifier: Apache-2.0
// Arrays of Zarr version 2: https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html
#include <algorithm>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/zarr_array.h"

namespace scolopax::io {
namespace {

/// "<u2": byte order, kind and bytes, as NumPy writes types.
void readZarr2Type(const ZarrField& field, ZarrArray& array) {
  constexpr const char* kExpected = "a type of one number, such as \"<u2\"";
  if (!field.isText()) field.refuseUnsupported(kExpected);
  const std::string text = field.text();
  if (text.size() < 3) field.refuse(kExpected);
  const std::int64_t bytes = parseInteger(text.substr(2)).value_or(0);
  const std::string bits = std::to_string(bytes >= 1 && bytes <= 8 ? bytes * 8 : 0);
  std::string name;
  if (text[1] == 'u') name = "uint" + bits;
  if (text[1] == 'i') name = "int" + bits;
  if (text[1] == 'f') name = "float" + bits;
  if (text.substr(1) == "b1") name = "uint8";
  const auto type = storedTypeFromName(name);
  if (!type || std::string_view("<>|").find(text[0]) == std::string_view::npos)
    field.refuseUnsupported(kExpected);
  array.type = *type;
  array.codecs.bigEndian = text[0] == '>';
}

void refuseZarrFilters(const ZarrField& field) {
  if (field.exists() && !field.list(kMostZarrAxes).empty()) field.refuseUnsupported("no filters");
}

}  // namespace

void readZarr2(const ZarrNode& node, ZarrArray& array) {
  const ZarrField document = node.field();
  readZarr2Type(document["dtype"], array);
  array.chunks = document["chunks"].integers(kMostZarrAxes, 1, std::int64_t(1) << 48);
  if (array.chunks.size() != array.shape.size())
    document["chunks"].refuse(std::to_string(array.shape.size()) + " numbers, as many as shape has");
  array.fill = zarrFillValue(document["fill_value"], array.type);

  const std::string order = document["order"].text();
  if (order != "C" && order != "F") document["order"].refuse("C or F");
  if (order == "F") std::ranges::reverse(array.codecs.order);
  refuseZarrFilters(document["filters"]);
  if (const ZarrField compressor = document["compressor"]; compressor.exists())
    array.codecs.packings = {zarrPackingFromName(compressor["id"].where(), compressor["id"].text())};

  const ZarrField separator = document["dimension_separator"];
  if (separator.exists() && separator.text() != "." && separator.text() != "/")
    separator.refuse("\".\" or \"/\"");
  array.separator = separator.exists() ? separator.text()[0] : '.';
  array.keyPrefix = node.path.empty() ? "" : node.path + "/";

  // xarray's names of axes.
  const nlohmann::json& attributes = node.attributes;
  if (const auto names = attributes.find("_ARRAY_DIMENSIONS"); names != attributes.end() && names->is_array())
    for (const auto& name : *names)
      array.axisNames.push_back(name.is_string() ? name.get<std::string>() : std::string());
  if (array.axisNames.size() != array.shape.size()) array.axisNames.clear();
}

}  // namespace scolopax::io
