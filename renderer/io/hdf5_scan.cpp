// SPDX-License-Identifier: Apache-2.0
// What groups, arrays and attributes an HDF5 file has.
#include "renderer/io/hdf5_library.h"

#if SCOLOPAX_HAS_HDF5
#include <algorithm>
#include <array>
#include <cstring>
#include <set>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kMostHdf5Attributes = 1024, kMostHdf5Numbers = 1 << 16, kMostHdf5Links = 1 << 18;
constexpr std::uint64_t kMostHdf5AttributeBytes = 1 << 20;
constexpr int kMostHdf5Depth = 64;

struct Hdf5Link {
  std::string path;
  int depth;
};

/// Texts of a fixed length, each with `bytes`.
std::vector<std::string> readHdf5FixedTexts(hid_t attribute, hid_t type, std::size_t count) {
  const std::size_t bytes = H5Tget_size(type);
  std::vector<char> buffer(count * bytes);
  std::vector<std::string> texts;
  if (H5Aread(attribute, type, buffer.data()) < 0) return texts;
  for (std::size_t i = 0; i < count; ++i) {
    const char* first = buffer.data() + i * bytes;
    texts.emplace_back(first, ::strnlen(first, bytes));
  }
  return texts;
}

std::vector<std::string> readHdf5Texts(hid_t attribute, hid_t type, hid_t space, std::size_t count) {
  if (H5Tis_variable_str(type) <= 0) return readHdf5FixedTexts(attribute, type, count);
  std::vector<char*> pointers(count, nullptr);
  std::vector<std::string> texts;
  if (H5Aread(attribute, type, pointers.data()) < 0) return texts;
  for (const char* text : pointers)
    texts.emplace_back(text ? std::string(text, ::strnlen(text, kMostHdf5AttributeBytes)) : "");
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, pointers.data());
  return texts;
}

ArrayAttribute readHdf5Attribute(hid_t object, const char* name) {
  ArrayAttribute result{name};
  const Hdf5Id attribute(H5Aopen(object, name, H5P_DEFAULT));
  if (!attribute.good() || H5Aget_storage_size(attribute) > kMostHdf5AttributeBytes) return result;
  const Hdf5Id type(H5Aget_type(attribute)), space(H5Aget_space(attribute));
  const hssize_t points = H5Sget_simple_extent_npoints(space);
  if (points <= 0 || std::uint64_t(points) > kMostHdf5Numbers) return result;
  const auto count = std::size_t(points);
  if (H5Tget_class(type) == H5T_STRING) {
    const std::uint64_t bytes = H5Tget_size(type) * count;
    if (bytes <= kMostHdf5AttributeBytes) result.texts = readHdf5Texts(attribute, type, space, count);
  } else if (hdf5StoredType(type)) {
    result.numbers.resize(count);
    if (H5Aread(attribute, H5T_NATIVE_DOUBLE, result.numbers.data()) < 0) result.numbers.clear();
  }
  return result;
}

herr_t addHdf5Attribute(hid_t object, const char* name, const H5A_info_t*, void* attributes) {
  auto& all = *static_cast<std::vector<ArrayAttribute>*>(attributes);
  if (all.size() == kMostHdf5Attributes) return 1;
  all.push_back(readHdf5Attribute(object, name));
  return 0;
}

/// What the callbacks of the library collect of a group.
struct Hdf5Entries {
  std::vector<std::string> inside, outside;
  std::size_t count = 0;
};

herr_t addHdf5Link(hid_t, const char* name, const H5L_info_t* info, void* entries) {
  auto& all = *static_cast<Hdf5Entries*>(entries);
  if (++all.count > kMostHdf5Links) return -1;
  // What a soft link leads to in this file has a name of its own.
  if (info->type == H5L_TYPE_HARD) all.inside.emplace_back(name);
  if (info->type >= H5L_TYPE_UD_MIN) all.outside.emplace_back(name);
  return 0;
}

/// The values of the small arrays by which MINC scales an image.
std::vector<double> hdf5Values(hid_t dataset, const ArrayNode& node) {
  constexpr std::uint64_t kMostValues = 1 << 16;
  const std::string name = lastOf(node.path);
  if ((name != "image-min" && name != "image-max") || !node.type || !node.problem.empty()) return {};
  std::uint64_t count = 1;
  for (const std::uint64_t side : node.dims) count = saturatingProduct(count, side);
  if (count > kMostValues || node.chunkBytes > kMostHdf5AttributeBytes) return {};
  std::vector<double> values(static_cast<std::size_t>(count));
  const bool read = H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0;
  return read ? values : std::vector<double>();
}

void describeHdf5Dataset(hid_t dataset, ArrayNode& node) {
  const Hdf5Id space(H5Dget_space(dataset)), type(H5Dget_type(dataset));
  const Hdf5Id creation(H5Dget_create_plist(dataset));
  std::array<hsize_t, H5S_MAX_RANK> dims{}, chunk{};
  const int rank = H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  if (rank > 0) node.dims.assign(dims.begin(), dims.begin() + rank);
  node.type = hdf5StoredType(type);
  node.problem = hdf5Problem(dataset);
  if (H5Pget_layout(creation) == H5D_CHUNKED) {
    node.chunkBytes = H5Tget_size(type);
    const int chunkRank = H5Pget_chunk(creation, H5S_MAX_RANK, chunk.data());
    for (int d = 0; d < chunkRank; ++d)
      node.chunkBytes = saturatingProduct(node.chunkBytes, chunk[std::size_t(d)]);
  }
  node.values = hdf5Values(dataset, node);
}

/// Where the object lies in the file, so that it is seen once.
std::uint64_t hdf5Address(hid_t object) {
#if H5_VERSION_GE(1, 12, 0)
  H5O_info2_t info{};
  if (H5Oget_info3(object, &info, H5O_INFO_BASIC) < 0) return 0;
  std::uint64_t address = 0;
  std::memcpy(&address, &info.token, sizeof(address));
  return address;
#else
  H5O_info_t info{};
  return H5Oget_info(object, &info) < 0 ? 0 : info.addr;
#endif
}

}  // namespace

void scanHdf5(const std::filesystem::path& path, const Sender& sender) {
  const Hdf5Id file = openHdf5File(path);
  const std::string name = shown(path);
  std::vector<Hdf5Link> waiting{{"/", 0}};
  std::set<std::uint64_t> seen;
  while (!waiting.empty()) {
    const Hdf5Link link = waiting.back();
    waiting.pop_back();
    ArrayNode node{link.path};
    const Hdf5Id object(H5Oopen(file, link.path.c_str(), H5P_DEFAULT));
    if (!object.good()) {
      if (link.depth == 0) failBadInput(name + ": expected an HDF5 file, found a damaged one" + hdf5Reason());
      node.problem = "cannot be opened" + hdf5Reason();
      sendNode(sender, node);
      continue;
    }
    if (!seen.insert(hdf5Address(object)).second) continue;
    const H5I_type_t kind = H5Iget_type(object);
    if (kind != H5I_GROUP && kind != H5I_DATASET) continue;
    node.isGroup = kind == H5I_GROUP;
    if (!node.isGroup) describeHdf5Dataset(object, node);
    H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, addHdf5Attribute, &node.attributes);
    sendNode(sender, node);
    if (!node.isGroup) continue;
    Hdf5Entries entries;
    if (H5Literate(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, addHdf5Link, &entries) < 0)
      sender.warn(name + ":" + cleanText(link.path) + ": not all of this group can be read" + hdf5Reason());
    if (link.depth == kMostHdf5Depth && !entries.inside.empty()) {
      sender.warn(name + ":" + cleanText(link.path) + ": groups in it are left out: they lie too deep");
      continue;
    }
    const std::string prefix = link.path == "/" ? "/" : link.path + "/";
    for (const std::string& entry : entries.outside)
      sendNode(sender, {.path = prefix + entry, .problem = "leads to another file, which is not supported"});
    for (auto entry = entries.inside.rbegin(); entry != entries.inside.rend(); ++entry)
      waiting.push_back({prefix + *entry, link.depth + 1});
  }
}

}  // namespace scolopax::io
#endif
