// SPDX-License-Identifier: Apache-2.0
// The list of formats, and the way from files to data sets.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <optional>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/format.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::array kFormats = {
    Format{"NIfTI", ".nii, .nii.gz, .hdr + .img", matchesNifti, loadNifti},
    Format{"NRRD", ".nrrd, .nhdr", matchesNrrd, loadNrrd},
    Format{"TIFF", ".tif, .tiff", matchesTiff, loadTiff},
    Format{"raw", "name_XxYxZ_type.raw, .dat, .ivf", matchesRaw, loadRaw},
};

/// Lower-case letters, digits and single dashes; "volume" when nothing is left.
std::string slugOf(const std::string& text) {
  std::string slug;
  for (const char c : lowerCase(text)) {
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'))
      slug += c;
    else if (!slug.empty() && slug.back() != '-')
      slug += '-';
  }
  while (slug.ends_with('-')) slug.pop_back();
  return slug.empty() ? "volume" : slug;
}

bool isHeader(const fs::path& path) {
  return std::ranges::any_of(std::array{".hdr", ".hdr.gz", ".nhdr", ".dat", ".ivf"},
                             [&](const char* ending) { return hasEnding(path, ending); });
}

bool isAmong(const std::vector<fs::path>& files, const fs::path& path) {
  std::error_code ignored;
  return std::ranges::any_of(files,
                             [&](const fs::path& file) { return fs::equivalent(file, path, ignored); });
}

/// Files on one grid, while they are gathered.
struct Group {
  Grid grid;
  std::vector<ChannelSource> channels;
  std::vector<fs::path> files;
};

}  // namespace

std::span<const Format> formats() { return kFormats; }

LoadedFile loadFile(const fs::path& path, std::uint64_t memoryLimitBytes, const Warn& warn) {
  requireRegularFile(path);
  const auto format = std::ranges::find_if(kFormats, [&](const Format& f) { return f.matches(path); });
  if (format != kFormats.end()) return format->load(path, memoryLimitBytes, warn);
  std::string known;
  for (const Format& f : kFormats) {
    known += (known.empty() ? "" : "; ") + std::string(f.name) + " (" + std::string(f.extensions) + ")";
  }
  throw Error(ErrorCode::unsupported, shown(path) + ": expected one of " + known);
}

std::vector<LoadedDataset> loadDatasets(std::span<const fs::path> paths, std::uint64_t memoryLimitBytes,
                                        const Warn& warn) {
  // Headers first: they tell which of the other files belong to them.
  std::vector<LoadedFile> files(paths.size());
  std::vector<fs::path> dataFiles;
  std::uint64_t left = memoryLimitBytes;
  for (const bool headers : {true, false}) {
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (isHeader(paths[i]) != headers || isAmong(dataFiles, paths[i])) continue;
      files[i] = loadFile(paths[i], left, warn);
      if (!files[i].dataFile.empty()) dataFiles.push_back(files[i].dataFile);
      for (const ChannelSource& channel : files[i].channels)
        left -= std::min<std::uint64_t>(left, channel.voxels.sizeBytes());
    }
  }

  std::vector<Group> groups;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const fs::path& path = paths[i];
    LoadedFile& loaded = files[i];
    if (loaded.channels.empty()) continue;
    auto group = std::ranges::find_if(groups, [&](const Group& g) { return sameGrid(g.grid, loaded.grid); });
    if (group == groups.end()) group = groups.insert(groups.end(), Group{loaded.grid, {}, {}});
    const std::size_t channels = group->channels.size() + loaded.channels.size();
    if (channels > std::size_t(kMaxChannels)) {
      throw Error(ErrorCode::unsupported, shown(path) + ": expected at most " + std::to_string(kMaxChannels) +
                                              " channels on one grid, found " + std::to_string(channels));
    }
    std::ranges::move(loaded.channels, std::back_inserter(group->channels));
    group->files.push_back(path);
  }

  std::vector<LoadedDataset> datasets;
  for (Group& group : groups) {
    const std::string slug = slugOf(stemOf(group.files.front()));
    const auto taken = [&](const std::string& id) {
      return std::ranges::any_of(datasets, [&](const LoadedDataset& other) { return other.id == id; });
    };
    std::string id = slug;
    for (int suffix = 2; taken(id); ++suffix) id = slug + "-" + std::to_string(suffix);
    std::string title = cleanText(group.files.front().filename().string());
    if (group.files.size() > 1) title += " +" + std::to_string(group.files.size() - 1);
    try {
      auto volume = std::make_shared<const Volume>(group.grid, std::move(group.channels));
      datasets.push_back({std::move(id), std::move(title), std::move(group.files), std::move(volume)});
    } catch (const Error& error) {  // whose message does not name the file
      throw Error(error.code(), shown(group.files.front()) + ": " + error.what());
    }
  }
  return datasets;
}

std::uint64_t defaultMemoryLimitBytes() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), pageBytes = ::sysconf(_SC_PAGE_SIZE);
  if (pages <= 0 || pageBytes <= 0) return std::uint64_t(1) << 32;
  return std::uint64_t(pages) * std::uint64_t(pageBytes) / 2;
}

}  // namespace scolopax::io
