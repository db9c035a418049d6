// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/ome_xml.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <pugixml.hpp>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::int64_t kLargestOmeSize = std::int64_t(1) << 31;

/// Name of an element without the prefix of its namespace, which pugixml does not know.
std::string_view omeName(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') == std::string_view::npos ? 0 : name.find(':') + 1);
}

std::vector<pugi::xml_node> omeChildren(const pugi::xml_node& parent, std::string_view name) {
  std::vector<pugi::xml_node> children;
  for (const pugi::xml_node& child : parent.children())
    if (omeName(child) == name) children.push_back(child);
  return children;
}

pugi::xml_node omeChild(const pugi::xml_node& parent, std::string_view name) {
  const auto children = omeChildren(parent, name);
  return children.empty() ? pugi::xml_node() : children.front();
}

/// Reads the attributes of one element; errors name it.
class OmeElement {
 public:
  OmeElement(std::string where, const pugi::xml_node& node)
      : where_(std::move(where) + ": " + std::string(omeName(node))), node_(node) {}

  std::string text(const char* key) const { return node_.attribute(key).value(); }
  std::string where(const char* key) const { return where_ + ": " + key; }

  std::optional<std::int64_t> integer(const char* key, std::int64_t least) const {
    const pugi::xml_attribute attribute = node_.attribute(key);
    if (!attribute) return std::nullopt;
    const auto value = parseInteger(trimmed(attribute.value()));
    if (!value || *value < least || *value > kLargestOmeSize)
      throw Error(ErrorCode::badInput, where(key) + ": expected a whole number, at least " +
                                           std::to_string(least) + ", found " + inQuotes(attribute.value()));
    return value;
  }

  std::int64_t size(const char* key) const {
    const auto value = integer(key, 1);
    if (!value)
      throw Error(ErrorCode::badInput, where(key) + ": expected a whole number, at least 1, found none");
    return *value;
  }

  /// A positive number; none, with a warning, if it is something else.
  std::optional<double> length(const char* key, const Warn& warn) const {
    const pugi::xml_attribute attribute = node_.attribute(key);
    if (!attribute) return std::nullopt;
    const auto value = parseNumber(trimmed(attribute.value()));
    if (value && std::isfinite(*value) && *value > 0) return value;
    warn(where(key) + ": expected a positive number, found " + inQuotes(attribute.value()) + "; is not used");
    return std::nullopt;
  }

 private:
  std::string where_;
  pugi::xml_node node_;
};

/// Picometres of the units of length that are used; 0 for "pixel", "reference frame" and unknown ones.
double picometres(const std::string& unit) {
  static const std::map<std::string, double> kUnits{
      {"pm", 1},    {"\xC3\x85", 1e2}, {"nm", 1e3}, {"um", 1e6},  {"mm", 1e9},
      {"cm", 1e10}, {"dm", 1e11},      {"m", 1e12}, {"km", 1e15}, {"in", 2.54e10}};
  const auto found = kUnits.find(unit);
  return found == kUnits.end() ? 0 : found->second;
}

std::string omeUnit(const std::string& text, const std::string& otherwise) {
  if (text.empty()) return otherwise;
  if (text == "\xC2\xB5m" || text == "\xCE\xBCm") return "um";  // micro sign, Greek mu
  if (text == "\xC2\xB5s" || text == "\xCE\xBCs") return "us";
  return text;
}

/// Spacings in the unit of the first axis that has one.
void readSpacing(const OmeElement& pixels, OmeImage& image, const Warn& warn) {
  static constexpr std::array kLengths{"PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"};
  static constexpr std::array kLengthUnits{"PhysicalSizeXUnit", "PhysicalSizeYUnit", "PhysicalSizeZUnit"};
  bool first = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    image.spacing[axis] = pixels.length(kLengths[axis], warn);
    if (!image.spacing[axis]) continue;
    std::string unit = omeUnit(pixels.text(kLengthUnits[axis]), "um");
    if (unit == "pixel" || unit == "reference frame") unit = "";
    if (first) image.unit = unit;
    first = false;
    if (unit == image.unit) continue;
    const double factor = picometres(image.unit) > 0 ? picometres(unit) / picometres(image.unit) : 0;
    if (factor > 0) {
      *image.spacing[axis] *= factor;
    } else {
      warn(pixels.where(kLengthUnits[axis]) + ": expected a length as of the other axes, found " +
           inQuotes(unit) + "; the spacing is not used");
      image.spacing[axis].reset();
    }
  }
}

/// Times from the increment, else from the planes' own, if all times have one and they ascend.
void readTimes(const std::string& where, const OmeElement& pixels, const pugi::xml_node& node,
               OmeImage& image, const Warn& warn) {
  constexpr std::int64_t kMostOmeTimes = 1 << 20;
  if (image.sizeT > kMostOmeTimes)
    throw Error(ErrorCode::unsupported, pixels.where("SizeT") + ": expected at most " +
                                            std::to_string(kMostOmeTimes) + ", found " +
                                            std::to_string(image.sizeT));
  image.times.count = std::size_t(image.sizeT);
  if (image.sizeT == 1) return;
  if (const auto step = pixels.length("TimeIncrement", warn)) {
    for (std::size_t t = 0; t < image.times.count; ++t) image.times.values.push_back(double(t) * *step);
    image.times.unit = omeUnit(pixels.text("TimeIncrementUnit"), "s");
    return;
  }
  std::map<std::int64_t, double> told;
  std::string unit;
  for (const pugi::xml_node& child : omeChildren(node, "Plane")) {
    const OmeElement plane(where, child);
    const auto time = parseNumber(trimmed(plane.text("DeltaT")));
    const bool first = parseInteger(plane.text("TheZ")) == 0 && parseInteger(plane.text("TheC")) == 0;
    if (!time || !std::isfinite(*time) || !first) continue;
    told[parseInteger(plane.text("TheT")).value_or(-1)] = *time;
    unit = omeUnit(plane.text("DeltaTUnit"), "s");
  }
  std::vector<double> values;
  for (const auto& [t, value] : told)
    if (t == std::int64_t(values.size()) && (values.empty() || value > values.back()))
      values.push_back(value);
  if (std::int64_t(values.size()) != image.sizeT || values.size() != told.size()) return;
  image.times.values = std::move(values);
  image.times.unit = unit;
}

OmeChannel readChannel(const std::string& where, const pugi::xml_node& node) {
  const OmeElement element(where, node);
  OmeChannel channel;
  channel.name = trimmed(element.text("Name"));
  if (channel.name.empty()) channel.name = trimmed(element.text("Fluor"));
  if (const auto wavelength = parseNumber(trimmed(element.text("EmissionWavelength")));
      channel.name.empty() && wavelength && *wavelength > 0 && *wavelength < 1e6)
    channel.name = std::to_string(std::lround(*wavelength)) + " " +
                   omeUnit(element.text("EmissionWavelengthUnit"), "nm");
  channel.samples = element.integer("SamplesPerPixel", 1).value_or(1);
  // RGBA in one signed number; white is the default, which many programs write.
  const auto color = parseInteger(trimmed(element.text("Color")));
  if (color && *color != -1) {
    const auto bits = std::uint32_t(*color);
    channel.color = {{std::uint8_t(bits >> 24), std::uint8_t(bits >> 16), std::uint8_t(bits >> 8)}};
  }
  return channel;
}

OmeTiffData readTiffData(const std::string& where, const pugi::xml_node& node) {
  const OmeElement element(where, node);
  OmeTiffData data;
  data.firstZ = element.integer("FirstZ", 0).value_or(0);
  data.firstC = element.integer("FirstC", 0).value_or(0);
  data.firstT = element.integer("FirstT", 0).value_or(0);
  data.page = element.integer("IFD", 0);
  data.count = element.integer("PlaneCount", 0);
  if (const pugi::xml_node uuid = omeChild(node, "UUID")) {
    data.fileName = uuid.attribute("FileName").value();
    data.uuid = trimmed(uuid.text().get());
  }
  return data;
}

OmeImage readImage(const std::string& where, const pugi::xml_node& node, const pugi::xml_node& pixelsNode,
                   const Warn& warn) {
  const OmeElement pixels(where, pixelsNode);
  OmeImage image;
  image.name = trimmed(node.attribute("Name").value());
  image.sizeX = pixels.size("SizeX"), image.sizeY = pixels.size("SizeY"), image.sizeZ = pixels.size("SizeZ");
  image.sizeC = pixels.size("SizeC"), image.sizeT = pixels.size("SizeT");
  image.type = lowerCase(pixels.text("Type").empty() ? pixels.text("PixelType") : pixels.text("Type"));
  image.order = pixels.text("DimensionOrder");
  std::string sorted = image.order;
  std::ranges::sort(sorted);
  if (sorted != "CTXYZ" || !image.order.starts_with("XY"))
    throw Error(ErrorCode::badInput, pixels.where("DimensionOrder") +
                                         ": expected XY and an order of Z, C and T, found " +
                                         inQuotes(image.order));
  readSpacing(pixels, image, warn);
  readTimes(where, pixels, pixelsNode, image, warn);
  for (const pugi::xml_node& child : omeChildren(pixelsNode, "Channel"))
    image.channels.push_back(readChannel(where, child));
  if (image.channels.empty()) image.channels.resize(1);
  for (const pugi::xml_node& child : omeChildren(pixelsNode, "TiffData"))
    image.data.push_back(readTiffData(where, child));
  return image;
}

}  // namespace

OmeDocument parseOmeXml(const std::string& where, std::string_view text, const Warn& warn) {
  pugi::xml_document xml;
  const pugi::xml_parse_result result = xml.load_buffer(text.data(), text.size());
  const pugi::xml_node root = xml.document_element();
  if (!result || omeName(root) != "OME")
    throw Error(ErrorCode::badInput, where + ": expected OME-XML, found " +
                                         (result ? "the element " + inQuotes(root.name())
                                                 : std::string(result.description()) + " at byte " +
                                                       std::to_string(result.offset)));
  OmeDocument document;
  document.uuid = trimmed(root.attribute("UUID").value());
  if (const pugi::xml_node elsewhere = omeChild(root, "BinaryOnly"))
    document.companion = elsewhere.attribute("MetadataFile").value();
  const auto images = omeChildren(root, "Image");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string image = images.size() > 1 ? ": Image " + std::to_string(i) : "";
    if (const pugi::xml_node pixels = omeChild(images[i], "Pixels"))
      document.images.push_back(readImage(where + image, images[i], pixels, warn));
  }
  return document;
}

bool looksLikeOmeXml(std::string_view text) {
  // The root element, behind declaration and comments.
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
    const std::string_view rest = text.substr(at + 1);
    if (rest.starts_with("!--")) {
      at = text.find("-->", at);
      if (at == std::string_view::npos) return false;
    } else if (!rest.starts_with('?') && !rest.starts_with('!')) {
      const std::string_view name = rest.substr(0, rest.find_first_of(" \t\r\n/>"));
      return name == "OME" || name.ends_with(":OME");
    }
  }
  return false;
}

}  // namespace scolopax::io
