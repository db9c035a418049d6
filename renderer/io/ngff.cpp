// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/ngff.h"

#include <algorithm>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kMostLevels = 64, kMostOmeroChannels = 4096, kMostTransformations = 16;

std::string textOr(const ZarrField& field, const std::string& otherwise) {
  return field.exists() ? field.text() : otherwise;
}

/// Axes as objects, as names (0.3), or none (0.1 and 0.2: always t, c, z, y, x).
std::vector<NgffAxis> readNgffAxes(const ZarrField& field) {
  std::vector<NgffAxis> axes;
  if (!field.exists()) {
    for (const char* name : {"t", "c", "z", "y", "x"}) axes.push_back({name, ngffAxisType(name), ""});
    return axes;
  }
  for (const ZarrField& axis : field.list(kMostZarrAxes)) {
    const std::string name = axis.isText() ? axis.text() : axis["name"].text();
    if (axis.isText())
      axes.push_back({name, ngffAxisType(name), ""});
    else
      axes.push_back({name, textOr(axis["type"], ngffAxisType(name)), textOr(axis["unit"], "")});
  }
  if (axes.empty()) field.refuse("at least one axis");
  return axes;
}

std::vector<double> numbersForAxes(const ZarrField& field, std::size_t axes) {
  std::vector<double> numbers;
  if (field.isText() || !field.exists()) field.refuse("numbers in the document");
  for (const ZarrField& number : field.list(kMostZarrAxes)) numbers.push_back(number.number());
  if (numbers.size() != axes) field.refuse(std::to_string(axes) + " numbers, one for each axis");
  return numbers;
}

/// Applies transformations after those so far.
void addTransformations(const ZarrField& field, std::size_t axes, NgffTransform& transform) {
  if (!field.exists()) return;
  for (const ZarrField& step : field.list(kMostTransformations)) {
    const std::string type = step["type"].text();
    if (transform.scale.empty()) {
      transform.scale.assign(axes, 1.0);
      transform.translation.assign(axes, 0.0);
    }
    if (type == "scale") {
      const auto factors = numbersForAxes(step["scale"], axes);
      for (std::size_t i = 0; i < axes; ++i) {
        transform.scale[i] *= factors[i];
        transform.translation[i] *= factors[i];
      }
    } else if (type == "translation") {
      const auto shift = numbersForAxes(step["translation"], axes);
      for (std::size_t i = 0; i < axes; ++i) transform.translation[i] += shift[i];
      transform.translated = true;
    } else if (type != "identity") {
      step["type"].refuseUnsupported("scale or translation");
    }
  }
}

std::optional<std::array<std::uint8_t, 3>> readNgffColor(const ZarrField& field, const Warn& warn) {
  if (!field.exists()) return std::nullopt;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = field.isText() ? lowerCase(field.text()) : "";
  if (text.starts_with('#')) text.erase(0, 1);
  if (text.size() == 8) text.resize(6);  // opacity last
  if (text.size() != 6 || text.find_first_not_of(kDigits) != std::string::npos) {
    warn(field.where() + ": expected a colour such as \"00FF00\", found something else, which is left out");
    return std::nullopt;
  }
  std::array<std::uint8_t, 3> color{};
  for (std::size_t i = 0; i < 3; ++i)
    color[i] = std::uint8_t(kDigits.find(text[2 * i]) * 16 + kDigits.find(text[2 * i + 1]));
  return color;
}

std::vector<NgffChannel> readOmero(const ZarrField& omero, const Warn& warn) {
  std::vector<NgffChannel> channels;
  if (!omero.isObject() || !omero["channels"].exists()) return channels;
  const ZarrField model = omero["rdefs"].isObject() ? omero["rdefs"]["model"] : omero["rdefs"];
  const bool colored = !model.isText() || model.text() != "greyscale";
  for (const ZarrField& field : omero["channels"].list(kMostOmeroChannels)) {
    NgffChannel channel;
    const ZarrField label = field["label"], window = field["window"];
    if (label.isText()) channel.name = label.text();
    if (colored) channel.look.color = readNgffColor(field["color"], warn);
    if (window.isObject() && window["start"].value().is_number() && window["end"].value().is_number())
      channel.look.window = {window["start"].number(), window["end"].number()};
    channels.push_back(channel);
  }
  return channels;
}

}  // namespace

std::string ngffAxisType(const std::string& name) {
  const std::string lower = lowerCase(name);
  if (lower == "t" || lower == "time") return "time";
  if (lower == "c" || lower == "channel") return "channel";
  return lower == "x" || lower == "y" || lower == "z" ? "space" : "";
}

ZarrField ngffAttributes(const ZarrNode& group) {
  const ZarrField attributes = group.attribute();
  const ZarrField ome = attributes["ome"];
  return ome.isObject() ? ome : attributes;
}

std::optional<NgffImage> ngffImageOf(const ZarrNode& group, const Warn& warn) {
  const ZarrField attributes = ngffAttributes(group);
  const ZarrField multiscales = attributes["multiscales"];
  if (!multiscales.exists()) return std::nullopt;
  if (group.format == 3 && !group.attribute()["ome"].isObject())
    warn(multiscales.where() + ": expected below \"ome\", and is read as it stands");
  const auto images = multiscales.list(kMostZarrAxes);
  if (images.empty()) multiscales.refuse("an image");
  if (images.size() > 1) warn(multiscales.where() + ": all but the first of several images are left out");

  const ZarrField& first = images[0];
  NgffImage image{.where = first.where(), .axes = readNgffAxes(first["axes"])};
  for (const ZarrField& dataset : first["datasets"].list(kMostLevels)) {
    const auto path = cleanZarrPath(dataset["path"].text());
    if (!path) dataset["path"].refuse("a path inside of the group");
    NgffLevel level{joinZarrPath(group.path, *path), {}};
    addTransformations(dataset["coordinateTransformations"], image.axes.size(), level.transform);
    const bool translated = level.transform.translated;
    addTransformations(first["coordinateTransformations"], image.axes.size(), level.transform);
    level.transform.translated = translated;
    image.levels.push_back(std::move(level));
  }
  if (image.levels.empty()) first["datasets"].refuse("at least one level");
  image.channels = readOmero(attributes["omero"], warn);
  return image;
}

}  // namespace scolopax::io
