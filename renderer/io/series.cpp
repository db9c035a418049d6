// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/series.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

using File = std::shared_ptr<const VolumeFile>;

bool isDigit(char c) { return c >= '0' && c <= '9'; }

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

bool sameChannels(const VolumeInfo& a, const VolumeInfo& b, bool named) {
  return std::ranges::equal(a.channels, b.channels, [&](const ChannelInfo& x, const ChannelInfo& y) {
    return x.type == y.type && (!named || x.name == y.name);
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

File joined(std::vector<std::pair<double, File>> steps) {
  std::ranges::stable_sort(steps, {}, [](const auto& step) { return step.first; });
  auto series = std::make_shared<VolumeFile>(*steps[0].second);
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
  using Key = std::tuple<std::filesystem::path, std::string, std::string>;
  std::map<Key, std::vector<std::pair<double, File>>> groups;
  const auto keyOf = [](const VolumeFile& file, double* number) -> std::optional<Key> {
    const std::string filename = file.path.filename().string();
    const NumberedName name = numberedName(filename);
    if (!name.numbered || !hasOneStep(file)) return std::nullopt;
    *number = name.number;
    return Key{file.path.parent_path(), name.before, name.after};
  };
  double number = 0;
  for (const File& file : files)
    if (const auto key = keyOf(*file, &number)) {
      auto& group = groups[*key];
      if (group.empty() || sameVolumes(*group[0].second, *file)) group.emplace_back(number, file);
    }
  std::vector<File> result;
  for (const File& file : files) {
    const auto key = keyOf(*file, &number);
    const auto group = key ? groups.find(*key) : groups.end();
    const auto inGroup = [&] {
      return std::ranges::any_of(group->second, [&](const auto& step) { return step.second == file; });
    };
    if (group == groups.end() || group->second.size() < kLeastSteps || !inGroup())
      result.push_back(file);
    else if (group->second[0].second == file)
      result.push_back(joined(group->second));
  }
  return result;
}

}  // namespace scolopax::io
