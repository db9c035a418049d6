// SPDX-License-Identifier: Apache-2.0
// OME-Zarr (NGFF 0.1 to 0.5) and plain Zarr, versions 2 and 3: https://ngff.openmicroscopy.org
#include <algorithm>
#include <set>

#include "renderer/core/error.h"
#include "renderer/io/formats.h"
#include "renderer/io/text.h"
#include "renderer/io/zarr_volume.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMostZarrVolumes = 4096, kMostZarrNodes = 4096;
constexpr int kMostZarrDepth = 8;

/// Looks for volumes in a hierarchy. What cannot be shown is left out with a warning if there is something
/// else.
class ZarrSearch {
 public:
  ZarrSearch(const ZarrStore& store, const OpenOptions& options) : store_(store), options_(options) {}

  /// Throws the first of the errors that were met if there is no volume.
  std::vector<ZarrVolume> all() {
    visit("", 0);
    if (volumes_.empty() && !errors_.empty()) throw errors_[0];
    for (const Error& error : errors_) options_.warn(std::string(error.what()) + "; left out");
    if (volumes_.size() == 1) volumes_[0].info.path.clear();
    return std::move(volumes_);
  }

 private:
  /// A node, and what it or its documents tell of others. Errors of this node are kept.
  void visit(const std::string& path, int depth) {
    if (options_.stop.stop_requested())
      throw Error(ErrorCode::cancelled, store_.shownKey("") + ": cancelled");
    if (++nodes_ > kMostZarrNodes)
      throw Error(ErrorCode::unsupported, store_.shownKey("") + ": expected at most " +
                                              std::to_string(kMostZarrNodes) +
                                              " groups and arrays, found more");
    try {
      if (const auto node = readZarrNode(store_, path)) visitNode(*node, depth);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::cancelled || error.code() == ErrorCode::io) throw;
      errors_.push_back(error);
    }
  }

  void visitNode(const ZarrNode& node, int depth) {
    if (node.isArray) return add(plainZarrImage(node, options_), node.path);
    if (const auto image = ngffImageOf(node, options_.warn)) {
      add(*image, node.path);
      return visitLabels(node.path);
    }
    if (depth >= kMostZarrDepth) return;
    const ZarrField attributes = ngffAttributes(node);
    if (attributes["plate"].isObject()) return visitPlate(node.path, attributes["plate"]);
    if (attributes["bioformats2raw.layout"].exists()) return visitSeries(node.path);
    std::vector<std::string> names = store_.list(node.path);
    if (names.empty() && depth == 0) readConsolidated(node);
    if (names.empty()) names = consolidatedNames(node.path);
    for (const std::string& name : names)
      if (!name.starts_with('.')) visit(joinZarrPath(node.path, name), depth + 1);
  }

  /// What lies directly in a group, by the copy of all documents that writers put beside those of the root.
  std::vector<std::string> consolidatedNames(const std::string& group) {
    std::set<std::string> names;
    const std::string folder = group.empty() ? "" : group + "/";
    for (const std::string& key : consolidated_)
      if (key.starts_with(folder))
        names.insert(key.substr(folder.size(), key.find('/', folder.size()) - folder.size()));
    return {names.begin(), names.end()};
  }

  void readConsolidated(const ZarrNode& root) {
    const auto copy = root.format == 2 ? readZarrJson(store_, ".zmetadata") : std::nullopt;
    const ZarrField document =
        copy ? ZarrField(*copy, root.documentName) : root.field()["consolidated_metadata"];
    if (!document.isObject() || !document["metadata"].isObject()) return;
    for (const auto& [key, value] : document["metadata"].value().items())
      if (const auto path = cleanZarrPath(key); path && !path->empty()) consolidated_.push_back(*path);
  }

  void add(const NgffImage& image, const std::string& path) {
    if (volumes_.size() >= kMostZarrVolumes)
      throw Error(ErrorCode::unsupported, store_.shownKey("") + ": expected at most " +
                                              std::to_string(kMostZarrVolumes) + " volumes, found more");
    volumes_.push_back(ngffVolume(store_, image, path, options_));
  }

  /// Paths that a group lists in an attribute, relative to it.
  std::vector<std::string> listedIn(const std::string& path, const char* attribute) {
    std::vector<std::string> paths;
    const auto group = readZarrNode(store_, path);
    if (!group) return paths;
    const ZarrField ome = ngffAttributes(*group)[attribute];
    const ZarrField names = ome.exists() ? ome : group->attribute()[attribute];
    if (!names.exists()) return paths;
    for (const ZarrField& name : names.list(kMostZarrVolumes)) paths.push_back(pathOf(name));
    return paths;
  }

  static std::string pathOf(const ZarrField& field) {
    const auto path = cleanZarrPath(field.text());
    if (!path || path->empty()) field.refuse("a path inside of the group");
    return *path;
  }

  void visitLabels(const std::string& image) {
    const std::string group = joinZarrPath(image, "labels");
    for (const std::string& name : listedIn(group, "labels")) {
      const std::size_t before = volumes_.size();
      visit(joinZarrPath(group, name), kMostZarrDepth);
      for (std::size_t i = before; i < volumes_.size(); ++i)
        for (ChannelInfo& channel : volumes_[i].info.channels) channel.look.labels = true;
    }
  }

  /// The layout of bioformats2raw: images "0", "1", ..., or as the group OME tells.
  void visitSeries(const std::string& path) {
    std::vector<std::string> series = listedIn(joinZarrPath(path, "OME"), "series");
    if (series.empty())
      while (series.size() < kMostZarrVolumes &&
             readZarrNode(store_, joinZarrPath(path, std::to_string(series.size()))))
        series.push_back(std::to_string(series.size()));
    for (const std::string& name : series) visit(joinZarrPath(path, name), kMostZarrDepth);
  }

  /// A plate of wells, each of which lists its images.
  void visitPlate(const std::string& path, const ZarrField& plate) {
    for (const ZarrField& well : plate["wells"].list(kMostZarrVolumes)) {
      const std::string wellPath = joinZarrPath(path, pathOf(well["path"]));
      const auto group = readZarrNode(store_, wellPath);
      if (!group) {
        options_.warn(well["path"].where() + ": expected a group, found none; left out");
        continue;
      }
      for (const ZarrField& image : ngffAttributes(*group)["well"]["images"].list(kMostZarrVolumes))
        visit(joinZarrPath(wellPath, pathOf(image["path"])), kMostZarrDepth);
    }
  }

  const ZarrStore& store_;
  const OpenOptions& options_;
  std::vector<ZarrVolume> volumes_;
  std::vector<Error> errors_;
  std::vector<std::string> consolidated_;  ///< paths of documents, if the store cannot list groups
  std::size_t nodes_ = 0;
};

bool isZarrZip(const fs::path& path) { return hasEnding(path, ".zarr.zip") || hasEnding(path, ".ozx"); }

std::unique_ptr<ZarrStore> openZarrStore(const fs::path& path, const std::vector<std::string>& allowedHosts,
                                         const std::stop_token& stop) {
  std::error_code ignored;
  if (isUrl(path)) return openZarrHttp(path.string(), allowedHosts, stop);
  if (fs::is_directory(path, ignored)) return openZarrFolder(path);
  return openZarrZip(path);
}

}  // namespace

Match matchZarr(const FileStart& start) {
  for (const char* document : {"zarr.json", ".zgroup", ".zarray", ".zattrs"})
    if (start.contains(document)) return Match::content;
  if (isUrl(start.path)) return Match::content;
  if (start.folder) return start.hasEnding(".zarr") ? Match::name : Match::no;
  if (!isZarrZip(start.path)) return Match::no;
  return start.bytes.starts_with("PK") ? Match::content : Match::name;
}

VolumeFile openZarr(const fs::path& path, const OpenOptions& options) {
  std::vector<ZarrVolume> volumes =
      ZarrSearch(*openZarrStore(path, options.allowedHosts, options.stop), options).all();
  VolumeFile file{path};
  auto levels = std::make_shared<std::vector<std::vector<ZarrLevel>>>();
  for (ZarrVolume& volume : volumes) {
    file.volumes.push_back(std::move(volume.info));
    levels->push_back(std::move(volume.levels));
  }
  file.read = [path, levels, hosts = options.allowedHosts](const VolumeInfo& volume, const Part& part,
                                                           Loading& loading) {
    const auto store = openZarrStore(path, hosts, loading.stop());
    auto writers = makeWriters(shown(path), volume, part, loading);
    const ZarrLevel& level = levels->at(part.volume).at(part.level);
    readZarrChunks(*store, level.array, level.axes, part.time, part.channels, writers, loading);
    return takeAll(writers);
  };
  return file;
}

}  // namespace scolopax::io
