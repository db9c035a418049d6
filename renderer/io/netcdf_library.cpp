// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/netcdf_library.h"

#if SCOLOPAX_HAS_NETCDF
#include <netcdf.h>
#if SCOLOPAX_HAS_HDF5
#include <hdf5.h>
#endif

#include <algorithm>
#include <array>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kMostNetcdfNumbers = 1 << 16, kMostNetcdfText = 1 << 16;
constexpr int kMostNetcdfDepth = 32, kMostNetcdfAttributes = 1024, kMostNetcdfVariables = 1 << 16;

void checkNetcdf(const std::string& where, int status) {
  if (status != NC_NOERR) failBadInput(where + ": cannot be read: " + cleanText(nc_strerror(status)));
}

/// Opens for reading. No other file can be opened from then on.
int openNetcdfFile(const std::filesystem::path& path) {
#if SCOLOPAX_HAS_HDF5
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);
  H5Lunregister(H5L_TYPE_EXTERNAL);
#endif
  int file = -1;
  // Absolute, so that no name is taken for an address of a server.
  const int status = nc_open(std::filesystem::absolute(path).c_str(), NC_NOWRITE, &file);
  if (status != NC_NOERR)
    failBadInput(shown(path) + ": expected a NetCDF file, found one that cannot be opened: " +
                 cleanText(nc_strerror(status)));
  forbidOpening();
#if !SCOLOPAX_HAS_HDF5  // by which alone links to other files can be left alone
  int format = 0, mode = 0;
  if (nc_inq_format_extended(file, &format, &mode) != NC_NOERR || format == NC_FORMATX_NC_HDF5)
    throw Error(ErrorCode::unsupported, shown(path) +
                                            ": NetCDF 4 needs the library of libhdf5-dev, without "
                                            "which this program was built");
#endif
  return file;
}

std::optional<StoredType> netcdfStoredType(int group, int variable) {
  nc_type type = NC_NAT;
  std::array<char, 8> isUnsigned{};
  std::size_t length = 0;
  if (nc_inq_vartype(group, variable, &type) != NC_NOERR) return std::nullopt;
  if (nc_inq_attlen(group, variable, "_Unsigned", &length) == NC_NOERR && length < isUnsigned.size())
    nc_get_att_text(group, variable, "_Unsigned", isUnsigned.data());
  const bool positive =
      std::string_view(isUnsigned.data()) == "true";  // of NetCDF 3, which has no such types
  switch (type) {
    case NC_BYTE:
      return positive ? StoredType::u8 : StoredType::i8;
    case NC_UBYTE:
      return StoredType::u8;
    case NC_SHORT:
      return positive ? StoredType::u16 : StoredType::i16;
    case NC_USHORT:
      return StoredType::u16;
    case NC_INT:
      return positive ? StoredType::u32 : StoredType::i32;
    case NC_UINT:
      return StoredType::u32;
    case NC_INT64:
      return StoredType::i64;
    case NC_UINT64:
      return StoredType::u64;
    case NC_FLOAT:
      return StoredType::f32;
    case NC_DOUBLE:
      return StoredType::f64;
    default:
      return std::nullopt;
  }
}

ArrayAttribute readNetcdfAttribute(int group, int variable, const char* name) {
  ArrayAttribute attribute{name};
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(group, variable, name, &type, &length) != NC_NOERR || length == 0) return attribute;
  if (type == NC_CHAR && length <= kMostNetcdfText) {
    std::string text(length, '\0');
    if (nc_get_att_text(group, variable, name, text.data()) == NC_NOERR)
      attribute.texts = {text.substr(0, text.find('\0'))};
  } else if (type == NC_STRING && length <= 1024) {
    std::vector<char*> texts(length, nullptr);
    if (nc_get_att_string(group, variable, name, texts.data()) != NC_NOERR) return attribute;
    for (const char* text : texts) attribute.texts.emplace_back(text ? text : "");
    nc_free_string(length, texts.data());
  } else if (type != NC_CHAR && type <= NC_UINT64 && length <= kMostNetcdfNumbers) {
    attribute.numbers.resize(length);
    if (nc_get_att_double(group, variable, name, attribute.numbers.data()) != NC_NOERR)
      attribute.numbers.clear();
  }
  return attribute;
}

std::vector<ArrayAttribute> readNetcdfAttributes(int group, int variable) {
  std::vector<ArrayAttribute> attributes;
  int count = 0;
  if (nc_inq_varnatts(group, variable, &count) != NC_NOERR) return attributes;
  std::array<char, NC_MAX_NAME + 1> name{};
  for (int i = 0; i < std::min(count, kMostNetcdfAttributes); ++i)
    if (nc_inq_attname(group, variable, i, name.data()) == NC_NOERR)
      attributes.push_back(readNetcdfAttribute(group, variable, name.data()));
  return attributes;
}

/// Lengths of a variable's dimensions and their ids; none if it cannot be read.
std::vector<std::uint64_t> netcdfDims(int group, int variable, std::vector<int>& ids) {
  int rank = 0;
  if (nc_inq_varndims(group, variable, &rank) != NC_NOERR || rank < 0 || rank > NC_MAX_VAR_DIMS) return {};
  ids.resize(std::size_t(rank));
  if (nc_inq_vardimid(group, variable, ids.data()) != NC_NOERR) return {};
  std::vector<std::uint64_t> dims;
  for (const int id : ids) {
    std::size_t length = 0;
    if (nc_inq_dimlen(group, id, &length) != NC_NOERR) return {};
    dims.push_back(length);
  }
  return dims;
}

std::vector<std::uint64_t> netcdfChunk(int group, int variable, std::size_t rank) {
  int storage = NC_CONTIGUOUS;
  std::vector<std::size_t> chunk(rank, 1);
  const bool chunked =
      nc_inq_var_chunking(group, variable, &storage, chunk.data()) == NC_NOERR && storage == NC_CHUNKED;
  return chunked ? std::vector<std::uint64_t>(chunk.begin(), chunk.end())
                 : std::vector<std::uint64_t>(rank, 1);
}

ArrayNode describeNetcdfVariable(int group, int variable, const std::string& prefix) {
  std::array<char, NC_MAX_NAME + 1> name{};
  ArrayNode node;
  std::vector<int> ids;
  if (nc_inq_varname(group, variable, name.data()) == NC_NOERR) node.path = prefix + name.data();
  node.dims = netcdfDims(group, variable, ids);
  for (const int id : ids) {
    if (nc_inq_dimname(group, id, name.data()) == NC_NOERR) node.dimNames.emplace_back(name.data());
  }
  if (node.dims.size() != ids.size() || node.dimNames.size() != ids.size())
    node.problem = "has dimensions that cannot be read";
  node.type = netcdfStoredType(group, variable);
  node.attributes = readNetcdfAttributes(group, variable);
  if (!node.type || !node.problem.empty()) return node;
  const auto chunk = netcdfChunk(group, variable, node.dims.size());
  node.chunkBytes = sizeBytes(*node.type);
  for (const std::uint64_t side : chunk) node.chunkBytes = saturatingProduct(node.chunkBytes, side);
  if (node.dims.size() == 1 && node.dims[0] > 0 && node.dims[0] <= kMostNetcdfNumbers) {
    node.values.resize(std::size_t(node.dims[0]));
    if (nc_get_var_double(group, variable, node.values.data()) != NC_NOERR) node.values.clear();
  }
  return node;
}

void scanNetcdfGroup(const Sender& sender, int group, const std::string& path, int depth) {
  ArrayNode node{path.empty() ? "/" : path, true};
  node.attributes = readNetcdfAttributes(group, NC_GLOBAL);
  sendNode(sender, node);
  int variables = 0, groups = 0;
  nc_inq_nvars(group, &variables);
  for (int i = 0; i < std::min(variables, kMostNetcdfVariables); ++i)
    sendNode(sender, describeNetcdfVariable(group, i, path + "/"));
  if (depth == kMostNetcdfDepth || nc_inq_grps(group, &groups, nullptr) != NC_NOERR || groups <= 0) return;
  std::vector<int> ids(std::size_t(groups), 0);
  nc_inq_grps(group, &groups, ids.data());
  std::array<char, NC_MAX_NAME + 1> name{};
  for (const int id : ids)
    if (nc_inq_grpname(id, name.data()) == NC_NOERR)
      scanNetcdfGroup(sender, id, path + "/" + name.data(), depth + 1);
}

/// The group and the variable of a path.
std::pair<int, int> findNetcdfVariable(const std::string& where, int file, const std::string& path) {
  int group = file, variable = -1;
  std::size_t at = 1;
  for (std::size_t slash; (slash = path.find('/', at)) != std::string::npos; at = slash + 1)
    checkNetcdf(where, nc_inq_grp_ncid(group, path.substr(at, slash - at).c_str(), &group));
  checkNetcdf(where, nc_inq_varid(group, path.substr(at).c_str(), &variable));
  return {group, variable};
}

}  // namespace

void scanNetcdf(const std::filesystem::path& path, const Sender& sender) {
  scanNetcdfGroup(sender, openNetcdfFile(path), "", 0);
}

OpenArrays openNetcdfArrays(const std::filesystem::path& path) {
  const int file = openNetcdfFile(path);
  return [file, name = shown(path)](const ArraySlab& slab) {
    const std::string where = name + ":" + cleanText(slab.path);
    const auto [group, variable] = findNetcdfVariable(where, file, slab.path);
    std::vector<int> ids;
    if (netcdfDims(group, variable, ids) != slab.dims || netcdfStoredType(group, variable) != slab.type)
      failBadInput(where + ": expected the same variable as before, found another");
    OpenArray array{netcdfChunk(group, variable, slab.dims.size()), {}};
    // Fails for NetCDF 3, which has no chunks.
    nc_set_var_chunk_cache(group, variable, std::max<std::size_t>(1 << 20, slab.chunkBytes), 521, 1.0F);
    array.read = [in = group, id = variable, where](std::span<const std::uint64_t> first,
                                                    std::span<const std::uint64_t> count, std::byte* to) {
      const std::vector<std::size_t> start(first.begin(), first.end()), size(count.begin(), count.end());
      checkNetcdf(where, nc_get_vara(in, id, start.data(), size.data(), to));
    };
    return array;
  };
}

}  // namespace scolopax::io
#endif
