// SPDX-License-Identifier: Apache-2.0
// Texture atlases of the Allen Institute's volume viewer: a JSON file, and pictures in which the slices lie
// side by side, each with the channels of some of the volume's as its colours.
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/atlas_picture.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kMostAtlasChannels = 4096;

/// The object of the file, with fields that are checked.
class AtlasJson {
 public:
  explicit AtlasJson(const fs::path& path) : file(shown(path)) {
    constexpr std::uint64_t kLongest = std::uint64_t(16) << 20;
    ByteStream stream(path, ByteStream::Encoding::plain);
    if (stream.largestSize() > kLongest)
      throw Error(ErrorCode::badInput,
                  file + ": expected at most 16 MiB of JSON, found " + byteCount(stream.largestSize()));
    std::string bytes(std::size_t(stream.largestSize()), '\0');
    bytes.resize(stream.readSome(std::as_writable_bytes(std::span(bytes))));
    json = Json::parse(bytes, nullptr, false);
    if (!json.is_object())
      throw Error(ErrorCode::badInput, file + ": expected an object of JSON, found none");
  }

  Error bad(const std::string& field, const std::string& expected) const {
    return Error(ErrorCode::badInput, file + ": " + field + ": expected " + expected);
  }
  std::int64_t integer(const char* field, std::optional<std::int64_t> otherwise = std::nullopt) const {
    const auto found = json.find(field);
    if (found == json.end() && otherwise) return *otherwise;
    constexpr double kMost = 1 << 24;
    const double value = found != json.end() && found->is_number() ? found->get<double>() : 0;
    if (!(value >= 1 && value <= kMost) || value != std::floor(value))
      throw bad(field, "a whole number from 1 to 2^24");
    return std::int64_t(value);
  }
  /// A length in the world; 1 where the field is missing.
  double length(const char* field) const {
    const auto found = json.find(field);
    if (found == json.end()) return 1;
    if (!found->is_number() || !(found->get<double>() > 0)) throw bad(field, "a number above 0");
    return found->get<double>();
  }
  std::string text(const char* field) const {
    const auto found = json.find(field);
    return found != json.end() && found->is_string() ? found->get<std::string>() : "";
  }
  /// An array; an empty one if it is missing. Not a copy: copying what is nested deeply takes all the stack.
  const Json& list(const char* field) const {
    static const Json kNone = Json::array();
    const auto found = json.find(field);
    if (found == json.end()) return kNone;
    if (!found->is_array()) throw bad(field, "a list");
    return *found;
  }

  std::string file;  ///< for messages
  Json json;
};

/// One channel: a picture's sample.
struct AtlasChannel {
  fs::path picture;
  int sample = 0;
};

struct Atlas {
  AtlasTiles tiles;
  std::vector<AtlasChannel> channels;  ///< as the volume's
};

AtlasTiles atlasTiles(const AtlasJson& json) {
  AtlasTiles tiles;
  const std::int64_t columns = json.integer("cols"), rows = json.integer("rows");
  tiles.dims = checkedDims(json.file + ": tile_width, tile_height, tiles", json.integer("tile_width"),
                           json.integer("tile_height"), json.integer("tiles"));
  if (columns * rows < tiles.dims.z) throw json.bad("rows, cols", "places for as many slices as tiles says");
  tiles.columns = int(columns);
  return tiles;
}

/// The pixel sizes are those of the volume before it was scaled down to the tiles.
Grid atlasGrid(const AtlasJson& json, const AtlasTiles& tiles) {
  Grid grid{tiles.dims};
  const glm::dvec3 original(double(json.integer("width", tiles.dims.x)),
                            double(json.integer("height", tiles.dims.y)), double(tiles.dims.z));
  const std::array<double, 3> sizes{json.length("pixel_size_x"), json.length("pixel_size_y"),
                                    json.length("pixel_size_z")};
  for (int axis = 0; axis < 3; ++axis)
    grid.worldFromVoxel[axis][axis] = sizes[std::size_t(axis)] * original[axis] / double(tiles.dims[axis]);
  return grid;
}

/// The viewer takes micrometres where the file gives no unit.
std::string atlasUnit(const AtlasJson& json) {
  const std::string unit = json.text("pixel_size_unit");
  const bool micrometres =
      unit.empty() || unit == "\xC2\xB5m" || unit == "\xCE\xBCm" || unit == "micron" || unit == "micrometers";
  return micrometres ? "um" : unit;
}

/// sRGB of the channel, if the file states it.
std::optional<std::array<std::uint8_t, 3>> atlasColor(const Json& colors, std::size_t channel) {
  if (channel >= colors.size() || !colors[channel].is_array() || colors[channel].size() != 3)
    return std::nullopt;
  std::array<std::uint8_t, 3> color{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Json& value = colors[channel][i];
    if (!value.is_number() || !(value.get<double>() >= 0) || !(value.get<double>() <= 255))
      return std::nullopt;
    color[i] = std::uint8_t(value.get<double>());
  }
  return color;
}

/// Which picture holds each channel; nothing for channels whose picture is missing.
std::vector<std::optional<AtlasChannel>> placeAtlasChannels(const AtlasJson& json, const fs::path& path,
                                                            const Warn& warn) {
  const std::int64_t count = json.integer("channels");
  if (count > kMostAtlasChannels) throw json.bad("channels", "at most 4096");
  std::vector<std::optional<AtlasChannel>> places{std::size_t(count)};
  std::vector<bool> named(std::size_t(count), false);
  for (const Json& image : json.list("images")) {
    const bool complete = image.is_object() && image.contains("name") && image["name"].is_string() &&
                          image.contains("channels") && image["channels"].is_array();
    if (!complete) throw json.bad("images", "objects of a name and channels");
    const auto name = image["name"].get<std::string>();
    std::optional<fs::path> picture;
    try {
      picture = resolveDataFile(path, "images", name);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::notFound) throw;
      warn(std::string(error.what()) + "; its channels are left out");
    }
    int sample = 0;
    for (const Json& index : image["channels"]) {
      if (!index.is_number_integer() || index.get<std::int64_t>() < 0 || index.get<std::int64_t>() >= count)
        throw json.bad("images", "channels from 0 to " + std::to_string(count - 1));
      const auto channel = std::size_t(index.get<std::int64_t>());
      if (named[channel]) throw json.bad("images", "every channel once");
      named[channel] = true;
      if (picture) places[channel] = AtlasChannel{*picture, sample};
      ++sample;
    }
  }
  return places;
}

/// Reads each picture once, for all of its channels in the part.
void readAtlas(const Atlas& atlas, const Part& part, std::vector<ChannelWriter>& writers, Loading& loading) {
  std::vector<bool> done(writers.size(), false);
  for (std::size_t first = 0; first < writers.size(); ++first) {
    if (done[first]) continue;
    const fs::path& picture = atlas.channels[part.channels[first]].picture;
    std::vector<AtlasSample> samples;
    for (std::size_t i = first; i < writers.size(); ++i) {
      const AtlasChannel& channel = atlas.channels[part.channels[i]];
      if (channel.picture != picture) continue;
      samples.push_back({channel.sample, &writers[i]});
      done[i] = true;
    }
    AtlasPicture(picture, atlas.tiles).read(samples, loading);
  }
}

}  // namespace

Match matchAtlas(const FileStart& start) {
  const std::string_view text = start.bytes;
  const auto has = [&](std::string_view key) { return text.find(key) != std::string_view::npos; };
  const bool atlas =
      trimmed(text).starts_with('{') && has("\"tile_width\"") && has("\"tile_height\"") && has("\"tiles\"");
  return atlas ? Match::content : Match::no;
}

VolumeFile openAtlas(const fs::path& path, const OpenOptions& options) {
  const AtlasJson json(path);
  auto atlas = std::make_shared<Atlas>(Atlas{atlasTiles(json), {}});
  VolumeInfo volume;
  volume.levels.push_back(atlasGrid(json, atlas->tiles));
  volume.worldUnit = atlasUnit(json);
  VolumeFile file{path};
  const auto places = placeAtlasChannels(json, path, options.warn);
  const Json &names = json.list("channel_names"), &colors = json.list("channel_colors");
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!places[i]) continue;
    const fs::path& picture = places[i]->picture;
    ChannelInfo channel{.type = AtlasPicture(picture, atlas->tiles).sampleType(places[i]->sample)};
    if (i < names.size() && names[i].is_string()) channel.name = names[i].get<std::string>();
    channel.look.color = atlasColor(colors, i);
    volume.channels.push_back(channel);
    atlas->channels.push_back(*places[i]);
    if (std::ranges::find(file.dataFiles, picture) == file.dataFiles.end()) file.dataFiles.push_back(picture);
  }
  if (volume.channels.empty())
    throw Error(ErrorCode::notFound, json.file + ": images: expected a picture that exists, found none");
  file.volumes.push_back(std::move(volume));
  file.read = [atlas = std::shared_ptr<const Atlas>(atlas), name = json.file](
                  const VolumeInfo& info, const Part& part, Loading& loading) {
    auto writers = makeWriters(name, info, part, loading);
    readAtlas(*atlas, part, writers, loading);
    return takeAll(writers);
  };
  return file;
}

}  // namespace scolopax::io
