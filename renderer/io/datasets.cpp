// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/datasets.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "renderer/core/error.h"
#include "renderer/io/channel_names.h"
#include "renderer/io/ensemble.h"
#include "renderer/io/folder.h"
#include "renderer/io/formats.h"
#include "renderer/io/series.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// Lower-case letters, digits and single dashes; "volume" when nothing is left.
std::string slugOf(const std::string& text) {
  std::string slug;
  for (const char c : lowerCase(text)) {
    if ((c >= 'a' && c <= 'z') || isDigit(c))
      slug += c;
    else if (!slug.empty() && slug.back() != '-')
      slug += '-';
  }
  while (slug.ends_with('-')) slug.pop_back();
  return slug.empty() ? "volume" : slug;
}

/// Names for a message, separated by commas; the last ones are only counted if there are many.
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 100;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) text += (i > 0 ? ", " : "") + names[i];
  if (names.size() > kMost) text += " and " + std::to_string(names.size() - kMost) + " more";
  return text;
}

/// "path/name": what selects a channel.
std::string fullName(const VolumeInfo& volume, const ChannelInfo& channel) {
  return volume.path.empty() ? channel.name : volume.path + "/" + channel.name;
}

/// One of the names that a user gave, or a file in a folder that a user named, opened.
struct Opened {
  DataName name;
  bool inFolder = false;
  std::shared_ptr<const VolumeFile> file = {};
  std::vector<std::string> warnings = {};
  std::optional<Error> error = {};
  bool dropped = false;  ///< read through another file
};

/// The path without links and dots; "" of what does not exist.
std::string canonicalPath(const fs::path& path) {
  std::error_code ignored;
  return fs::canonical(path, ignored).string();
}

/// The names, with the volumes of a folder in its place unless it is a volume itself.
std::vector<Opened> listAll(std::span<const fs::path> names, const OpenOptions& options) {
  std::vector<Opened> all;
  for (const fs::path& given : names) {
    const DataName name = splitName(given);
    std::error_code ignored;
    if (!name.inner.empty() || !fs::is_directory(name.path, ignored) || claimsAllBelow(name.path)) {
      all.push_back({name});
      continue;
    }
    const auto files = volumesIn(name.path, options);
    if (files.empty())
      throw Error(ErrorCode::notFound,
                  shown(name.path) + ": expected volume files in this folder, found none");
    const bool itself = files.size() == 1 && files[0] == name.path;
    for (const fs::path& file : files) all.push_back({{file}, !itself});
  }
  return all;
}

/// Numbered files of whole volumes become one file with several steps.
void joinAllSeries(std::vector<Opened>& all) {
  std::vector<std::shared_ptr<const VolumeFile>> files;
  for (const Opened& one : all)
    if (one.file && one.name.inner.empty()) files.push_back(one.file);
  std::unordered_map<std::string, std::shared_ptr<const VolumeFile>> joined;  // by their paths
  for (const auto& file : joinSeries(files)) joined.try_emplace(file->path.string(), file);
  for (Opened& one : all) {
    if (!one.file || !one.name.inner.empty()) continue;
    const auto series = joined.find(one.file->path.string());
    if (series != joined.end()) one.file = series->second;
  }
}

/// Drops files that others among them read.
void dropDataFiles(std::vector<Opened>& all) {
  std::unordered_map<std::string, std::vector<std::size_t>> indicesOf;  // of each canonical path
  for (std::size_t i = 0; i < all.size(); ++i) indicesOf[canonicalPath(all[i].name.path)].push_back(i);
  indicesOf.erase("");
  for (std::size_t header = 0; header < all.size(); ++header) {
    if (!all[header].file || all[header].dropped) continue;
    for (const fs::path& data : all[header].file->dataFiles) {
      const auto found = indicesOf.find(canonicalPath(data));
      if (found == indicesOf.end()) continue;
      for (const std::size_t i : found->second)
        if (i != header) all[i].dropped = true;
    }
  }
  std::erase_if(all, [](const Opened& one) { return one.dropped; });
}

/// Opens all files. One that fails may be the data file of a header among the others, so its error waits.
std::vector<Opened> openAll(std::span<const fs::path> names, const OpenOptions& options) {
  std::vector<Opened> all = listAll(names, options);
  for (Opened& one : all) {
    OpenOptions own = options;
    if (own.fourthAxis == FourthAxis::member) own.fourthAxis = FourthAxis::time;
    own.warn = [&one](const std::string& line) { one.warnings.push_back(line); };
    try {
      one.file = openFile(one.name.path, own);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::cancelled) throw;
      one.error = error;
    }
  }
  if (options.fourthAxis != FourthAxis::channel) joinAllSeries(all);
  if (options.fourthAxis == FourthAxis::member)
    for (Opened& one : all)
      if (one.file) one.file = withStatistics(one.file);
  dropDataFiles(all);
  for (const Opened& one : all) {
    if (one.error && !one.inFolder) throw *one.error;
    if (!options.warn) continue;
    std::ranges::for_each(one.warnings, options.warn);
    if (one.error) options.warn(std::string(one.error->what()) + "; left out");
  }
  std::erase_if(all, [](const Opened& one) { return one.error.has_value(); });
  return all;
}

/// Whether both can be shown at one time: either has a single one, or they have the same, as far as is known.
bool sameTimes(const Times& a, const Times& b) {
  if (a.count == 1 || b.count == 1) return true;
  if (a.count != b.count) return false;
  return a.values.empty() || b.values.empty() || (a.values == b.values && a.unit == b.unit);
}

bool agree(const Dataset& dataset, const VolumeInfo& volume) {
  const Dataset::Source& first = dataset.sources.front();
  if (first.file->volumes[first.part.volume].derived != volume.derived) return false;
  return sameGrid(dataset.levels[0], volume.levels[0]) && sameTimes(dataset.times, volume.times);
}

/// Whether a part of a file in a folder may join: the data set is of the same folder and has room.
bool fits(const Dataset& dataset, const Opened& opened, const Part& part) {
  const VolumeInfo& volume = opened.file->volumes[part.volume];
  const std::size_t more = part.channels.empty() ? volume.channels.size() : part.channels.size();
  return dataset.files[0].parent_path() == opened.name.path.parent_path() &&
         dataset.channels.size() + more <= std::size_t(kMaxChannels);
}

void add(Dataset& dataset, const Opened& opened, const Part& part) {
  const VolumeInfo& volume = opened.file->volumes[part.volume];
  std::size_t levels = 0;
  while (levels < std::min(dataset.levels.size(), volume.levels.size()) &&
         sameGrid(dataset.levels[levels], volume.levels[levels]))
    ++levels;
  dataset.levels.resize(levels);
  const bool moreTimes = volume.times.count > dataset.times.count;
  if (moreTimes || (volume.times.count > 1 && dataset.times.values.empty())) dataset.times = volume.times;
  if (dataset.worldUnit.empty()) dataset.worldUnit = volume.worldUnit;
  const auto addChannel = [&](std::size_t channel) { dataset.channels.push_back(volume.channels[channel]); };
  if (part.channels.empty())
    for (std::size_t i = 0; i < volume.channels.size(); ++i) addChannel(i);
  else
    std::ranges::for_each(part.channels, addChannel);
  dataset.sources.push_back({opened.file, part});
  if (dataset.files.empty() || dataset.files.back() != opened.name.path)
    dataset.files.push_back(opened.name.path);
}

void checkChannelCount(const Dataset& dataset) {
  if (dataset.channels.size() <= std::size_t(kMaxChannels)) return;
  std::vector<std::string> names;
  for (const ChannelInfo& channel : dataset.channels) names.push_back(channel.name);
  throw Error(ErrorCode::unsupported, shown(dataset.files[0]) + ": expected at most " +
                                          std::to_string(kMaxChannels) + " channels on one grid, found " +
                                          std::to_string(names.size()) +
                                          "; choose some, as FILE:NAME, from " + listed(names));
}

/// Several data sets of one file are told apart by the first volume that each shows; others need no name
/// inside of their file.
std::string nameInFile(const Dataset& dataset, const std::vector<Dataset>& all) {
  const bool several = std::ranges::any_of(
      all, [&](const Dataset& other) { return &other != &dataset && other.files[0] == dataset.files[0]; });
  const Dataset::Source& first = dataset.sources.front();
  return several ? first.file->volumes[first.part.volume].path : "";
}

/// Sets id, title and the names of channels. `asked`: what was asked of the first file; "" for all of it.
void nameDataset(Dataset& dataset, const std::string& asked, const std::vector<Dataset>& others) {
  const std::string inner = asked.empty() ? nameInFile(dataset, others) : asked;
  const std::string slug =
      slugOf(stemOf(dataset.files[0]) + (inner.empty() ? std::string() : "-" + cleanText(inner)));
  const auto taken = [&](const std::string& id) {
    return std::ranges::any_of(others,
                               [&](const Dataset& other) { return &other != &dataset && other.id == id; });
  };
  dataset.id = slug;
  for (int suffix = 2; taken(dataset.id); ++suffix) dataset.id = slug + "-" + std::to_string(suffix);
  dataset.title =
      cleanText(dataset.files[0].filename().string()) + (inner.empty() ? "" : ":" + cleanText(inner));
  const bool ofOneFile = asked.empty() && !inner.empty() && dataset.files.size() == 1;
  const std::size_t more = (ofOneFile ? dataset.sources.size() : dataset.files.size()) - 1;
  if (more > 0) dataset.title += " +" + std::to_string(more);
  std::vector<std::string> names;
  for (const ChannelInfo& channel : dataset.channels) names.push_back(channel.name);
  names = shortNames(std::move(names));
  for (std::size_t i = 0; i < names.size(); ++i) dataset.channels[i].name = names[i];
}

std::uint64_t sumOverSources(const Dataset& dataset, std::size_t level,
                             std::uint64_t (*bytesOf)(const VolumeInfo&, std::size_t,
                                                      const std::vector<std::size_t>&)) {
  std::uint64_t sum = 0;
  for (const auto& [file, part] : dataset.sources)
    sum = saturatingSum(sum, bytesOf(file->volumes[part.volume], level, part.channels));
  return sum;
}

}  // namespace

DataName splitName(const fs::path& name) {
  std::error_code ignored;
  std::string text = name.string();
  while (text.size() > 1 && text.ends_with('/')) text.pop_back();  // a folder's name is that before the slash
  if (isUrl(text)) {                                               // the port's colon is not meant
    const std::size_t start = text.find('/', text.find("://") + 3);
    const std::size_t colon = start == std::string::npos ? start : text.find(':', start);
    return {text.substr(0, colon), colon == std::string::npos ? "" : text.substr(colon + 1)};
  }
  if (fs::exists(text, ignored)) return {text};
  for (std::size_t colon = text.find(':'); colon != std::string::npos; colon = text.find(':', colon + 1)) {
    const fs::path path = text.substr(0, colon);
    if (fs::exists(path, ignored)) return {path, text.substr(colon + 1)};
  }
  return {name};
}

std::vector<Part> partsOf(const VolumeFile& file, const std::string& inner) {
  std::vector<Part> parts;
  std::string wanted = inner;
  while (wanted.starts_with('/')) wanted.erase(0, 1);
  while (wanted.ends_with('/')) wanted.pop_back();
  const auto addVolumes = [&](auto&& chosen) {
    for (std::size_t i = 0; i < file.volumes.size(); ++i)
      if (chosen(file.volumes[i].path)) parts.push_back({.volume = i});
  };
  addVolumes([&](const std::string& path) { return wanted.empty() || path == wanted; });
  if (parts.empty()) addVolumes([&](const std::string& path) { return path.starts_with(wanted + "/"); });
  if (!parts.empty()) return parts;
  std::vector<std::string> known;
  for (std::size_t i = 0; i < file.volumes.size(); ++i) {
    const VolumeInfo& volume = file.volumes[i];
    Part part{.volume = i};
    for (std::size_t c = 0; c < volume.channels.size(); ++c) {
      const std::string full = fullName(volume, volume.channels[c]);
      if (wanted == full || wanted == volume.channels[c].name) part.channels.push_back(c);
      if (!volume.path.empty() && (known.empty() || known.back() != volume.path))
        known.push_back(volume.path);
      if (volume.path.empty()) known.push_back(full);
    }
    if (!part.channels.empty()) parts.push_back(part);
  }
  if (parts.empty())
    throw Error(ErrorCode::notFound, shown(file.path) + ": expected one of " + listed(known) +
                                         " after the colon, found " + inQuotes(inner));
  return parts;
}

std::vector<Dataset> openDatasets(std::span<const fs::path> names, const OpenOptions& options) {
  std::vector<Dataset> datasets;
  std::vector<std::string> inners;  // what was asked of the first file of each
  for (const Opened& opened : openAll(names, options)) {
    for (const Part& part : partsOf(*opened.file, opened.name.inner)) {
      const VolumeInfo& volume = opened.file->volumes[part.volume];
      auto dataset = std::ranges::find_if(datasets, [&](const Dataset& d) {
        return agree(d, volume) && (!opened.inFolder || fits(d, opened, part));
      });
      if (dataset == datasets.end()) {
        dataset = datasets.insert(datasets.end(), Dataset{.levels = volume.levels});
        inners.push_back(opened.name.inner);
      }
      add(*dataset, opened, part);
    }
  }
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    checkChannelCount(datasets[i]);
    nameDataset(datasets[i], inners[i], datasets);
  }
  return datasets;
}

std::uint64_t memoryBytes(const Dataset& dataset, std::size_t level) {
  return sumOverSources(dataset, level, memoryBytes);
}

std::shared_ptr<const Volume> loadVolume(const Dataset& dataset, std::size_t level, std::size_t time,
                                         const LoadOptions& options) {
  const auto checkIndex = [&](const char* what, std::size_t index, std::size_t count) {
    if (index >= count)
      throw Error(ErrorCode::badInput, dataset.title + ": " + what + ": expected 0 to " +
                                           std::to_string(count - 1) + ", found " + std::to_string(index));
  };
  checkIndex("level", level, dataset.levels.size());
  checkIndex("time", time, dataset.times.count);
  Loading loading(options, sumOverSources(dataset, level, storedBytes));
  const Grid& grid = dataset.levels[level];
  loading.checkMemory(dataset.title + ": " + std::to_string(grid.dims.x) + "x" + std::to_string(grid.dims.y) +
                          "x" + std::to_string(grid.dims.z) + " voxels of " +
                          std::to_string(dataset.channels.size()) +
                          (dataset.channels.size() == 1 ? " channel" : " channels"),
                      memoryBytes(dataset, level));
  std::vector<ChannelSource> channels;
  for (const auto& [file, first] : dataset.sources) {
    Part part = first;
    part.level = level;
    part.time = file->volumes[part.volume].times.count == 1 ? 0 : time;
    std::ranges::move(load(*file, part, loading).channels, std::back_inserter(channels));
  }
  for (std::size_t i = 0; i < channels.size(); ++i) channels[i].name = dataset.channels[i].name;
  loading.begin("measuring");
  try {
    return std::make_shared<const Volume>(grid, std::move(channels), options.stop);
  } catch (const Error& error) {  // whose message does not name the file
    throw Error(error.code(), shown(dataset.files.front()) + ": " + error.what());
  }
}

std::vector<LoadedDataset> loadDatasets(std::span<const Dataset> datasets, std::size_t time,
                                        LoadOptions options) {
  std::vector<LoadedDataset> loaded;
  const bool exists = std::ranges::any_of(datasets, [&](const Dataset& d) { return time < d.times.count; });
  for (const Dataset& dataset : datasets) {
    // A data set of one time is the same at all times of the others.
    auto volume = loadVolume(dataset, 0, dataset.times.count == 1 && exists ? 0 : time, options);
    for (const Channel& channel : volume->channels())
      options.memoryLimitBytes -= std::min<std::uint64_t>(
          options.memoryLimitBytes, channel.voxels.count() * scolopax::sizeBytes(channel.voxels.type()));
    loaded.push_back(
        {dataset.id, dataset.title, dataset.files, std::move(volume), dataset.times, dataset.worldUnit});
  }
  return loaded;
}

std::vector<LoadedDataset> loadDatasets(std::span<const fs::path> names, std::uint64_t memoryLimitBytes,
                                        const Warn& warn) {
  return loadDatasets(openDatasets(names, {.warn = warn}), 0,
                      {.memoryLimitBytes = memoryLimitBytes, .warn = warn});
}

}  // namespace scolopax::io
