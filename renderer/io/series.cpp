// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/series.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <string>

#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

using File = std::shared_ptr<const VolumeFile>;

/// Whether the text ends with a word that counts channels or slices.
bool countsOther(std::string_view before) {
  while (!before.empty() && !std::isalnum(static_cast<unsigned char>(before.back()))) before.remove_suffix(1);
  std::size_t begin = before.size();
  while (begin > 0 && std::isalpha(static_cast<unsigned char>(before[begin - 1]))) --begin;
  const std::string word = lowerCase(before.substr(begin));
  static constexpr std::string_view kWords[] = {"c", "ch", "channel", "w", "wave", "z"};
  return std::ranges::find(kWords, word) != std::end(kWords);
}

bool hasOneStep(const VolumeFile& file) {
  return std::ranges::all_of(file.volumes, [](const VolumeInfo& v) { return v.times.count == 1; });
}

/// Whether the channels of one stand for those of the other: their scales hold for all steps.
bool sameChannels(const VolumeInfo& a, const VolumeInfo& b, bool named) {
  return std::ranges::equal(a.channels, b.channels, [&](const ChannelInfo& x, const ChannelInfo& y) {
    return x.type == y.type && x.unit == y.unit && x.slope == y.slope && x.intercept == y.intercept &&
           (!named || x.name == y.name);
  });
}

/// Channels without a name of their own have the file's.
bool sameVolumes(const VolumeFile& a, const VolumeFile& b) {
  return std::ranges::equal(a.volumes, b.volumes, [&](const VolumeInfo& x, const VolumeInfo& y) {
    const bool named = x.channels.size() > 1 || x.channels[0].name != stemOf(a.path);
    return x.path == y.path && sameChannels(x, y, named) && x.levels.size() == y.levels.size() &&
           std::ranges::equal(x.levels, y.levels, sameGrid);
  });
}

/// What may become a series: the steps by their numbers.
struct Group {
  File first = {};
  std::map<double, File> steps = {};

  /// Whether the file is now a step: one like the first, of a number that no other has.
  bool take(double number, const File& file) {
    if (!first) first = file;
    return sameVolumes(*first, *file) && steps.emplace(number, file).second;
  }
};

struct StepName {
  std::string group;  ///< the path without the number
  double number = 0;
};

/// None if the file cannot be a step.
std::optional<StepName> stepName(const VolumeFile& file) {
  const std::string filename = file.path.filename().string();
  const NumberedName name = numberedName(filename);
  if (!name.numbered || !hasOneStep(file)) return std::nullopt;
  // No name contains a slash.
  const std::string unnumbered = std::string(name.before) + "/" + std::string(name.after);
  return StepName{file.path.parent_path().string() + "/" + unnumbered, name.number};
}

File joined(const std::map<double, File>& steps) {
  auto series = std::make_shared<VolumeFile>(*steps.begin()->second);
  std::vector<File> files;
  Times times{.count = steps.size()};
  for (const auto& [number, file] : steps) {
    times.values.push_back(number);
    files.push_back(file);
    series->dataFiles.push_back(file->path);
    series->dataFiles.insert(series->dataFiles.end(), file->dataFiles.begin(), file->dataFiles.end());
  }
  for (VolumeInfo& volume : series->volumes) volume.times = times;
  series->read = [files](const VolumeInfo& volume, const Part& part, Loading& loading) {
    Part step = part;
    step.time = 0;
    VolumeInfo own = files[part.time]->volumes[part.volume];
    own.channels = volume.channels;
    return files[part.time]->read(own, step, loading);
  };
  return series;
}

}  // namespace

NumberedName numberedName(std::string_view filename) {
  // Numbers in the ending are not meant: .hdf5, .nii.gz.
  std::string_view stem = filename;
  if (stem.ends_with(".gz")) stem.remove_suffix(3);
  std::size_t end = std::min(stem.rfind('.'), stem.size());
  while (end > 0 && !isDigit(filename[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && isDigit(filename[begin - 1])) --begin;
  NumberedName name{filename.substr(0, begin), filename.substr(end)};
  std::uint64_t number = 0;
  const auto result = std::from_chars(filename.data() + begin, filename.data() + end, number);
  name.numbered = end - begin >= 2 && result.ec == std::errc() && !countsOther(name.before);
  name.number = double(number);
  return name;
}

std::vector<File> joinSeries(std::span<const File> files) {
  std::map<std::string, Group> groups;
  std::vector<const Group*> groupOf;  // of each file; nullptr if it stays alone
  for (const File& file : files) {
    const auto name = stepName(*file);
    Group* group = name ? &groups[name->group] : nullptr;
    groupOf.push_back(group && group->take(name->number, file) ? group : nullptr);
  }
  std::vector<File> result;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Group* group = groupOf[i];
    if (!group || group->steps.size() < kLeastSteps)
      result.push_back(files[i]);
    else if (group->first == files[i])
      result.push_back(joined(group->steps));
  }
  return result;
}

}  // namespace scolopax::io
