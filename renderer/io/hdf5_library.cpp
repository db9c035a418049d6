// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/hdf5_library.h"

#if SCOLOPAX_HAS_HDF5
#include <algorithm>
#include <array>
#include <memory>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

herr_t keepFirstHdf5Reason(unsigned, const H5E_error2_t* error, void* text) {
  auto& reason = *static_cast<std::string*>(text);
  if (reason.empty() && error->desc && error->desc[0]) reason = std::string(": ") + cleanText(error->desc);
  return 0;
}

/// Why a packed array cannot be unpacked; "" if it can.
std::string hdf5FilterProblem(hid_t creation) {
  const int filters = H5Pget_nfilters(creation);
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    std::array<char, 256> name{};
    const H5Z_filter_t filter =
        H5Pget_filter2(creation, unsigned(i), &flags, &values, nullptr, name.size(), name.data(), &config);
    if (filter < 0 || H5Zfilter_avail(filter) > 0) continue;
    name.back() = 0;
    const std::string shownName =
        name[0] ? inQuotes(name.data()) : std::string("number ") + std::to_string(filter);
    return "is packed by the HDF5 filter " + shownName + ", which is not supported";
  }
  return "";
}

/// Checks an open array against what the headers told before.
void checkHdf5Array(const std::string& where, hid_t dataset, const ArraySlab& slab) {
  if (const std::string problem = hdf5Problem(dataset); !problem.empty())
    throw Error(ErrorCode::unsupported, where + " " + problem);
  const Hdf5Id space(H5Dget_space(dataset)), type(H5Dget_type(dataset));
  std::array<hsize_t, H5S_MAX_RANK> dims{};
  const int rank = H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  const bool same = rank >= 0 && std::ranges::equal(std::span(dims).first(std::size_t(rank)), slab.dims);
  if (!same || hdf5StoredType(type) != slab.type)
    failBadInput(where + ": expected the same array as before, found another");
}

std::vector<std::uint64_t> hdf5Chunk(hid_t creation, std::size_t rank) {
  std::array<hsize_t, H5S_MAX_RANK> chunk{};
  std::vector<std::uint64_t> shape(rank, 1);
  if (H5Pget_layout(creation) == H5D_CHUNKED && H5Pget_chunk(creation, int(rank), chunk.data()) == int(rank))
    std::copy_n(chunk.begin(), rank, shape.begin());
  return shape;
}

/// Opens with a cache that holds a chunk, so that one which is read in pieces is unpacked once.
Hdf5Id openHdf5Dataset(hid_t file, const ArraySlab& slab) {
  const Hdf5Id access(H5Pcreate(H5P_DATASET_ACCESS));
  H5Pset_chunk_cache(access, 521, std::max<std::size_t>(1 << 20, slab.chunkBytes), 1.0);
  return Hdf5Id(H5Dopen2(file, slab.path.c_str(), access));
}

}  // namespace

std::string hdf5Reason() {
  std::string reason;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keepFirstHdf5Reason, &reason);
  return reason;
}

Hdf5Id openHdf5File(const std::filesystem::path& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);
  H5Lunregister(H5L_TYPE_EXTERNAL);
  const Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS));
#if H5_VERSION_GE(1, 10, 7)
  H5Pset_file_locking(access, false, true);  // fails on file systems without locks
#endif
  Hdf5Id file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access));
  if (!file.good())
    failBadInput(shown(path) + ": expected an HDF5 file, found one that cannot be opened" + hdf5Reason());
  forbidOpening();
  return file;
}

std::optional<StoredType> hdf5StoredType(hid_t fileType) {
  H5T_class_t kind = H5Tget_class(fileType);
  const Hdf5Id base(kind == H5T_ENUM ? H5Tget_super(fileType) : H5I_INVALID_HID);
  const hid_t type = base.good() ? hid_t(base) : fileType;  // h5py's bool is an enumeration
  if (base.good()) kind = H5Tget_class(type);
  const std::size_t bytes = H5Tget_size(type);
  if (kind == H5T_FLOAT && bytes > 0) return bytes <= 4 ? StoredType::f32 : StoredType::f64;
  if (kind != H5T_INTEGER || bytes == 0 || bytes > 8) return std::nullopt;
  const bool negative = H5Tget_sign(type) != H5T_SGN_NONE;
  if (bytes == 1) return negative ? StoredType::i8 : StoredType::u8;
  if (bytes == 2) return negative ? StoredType::i16 : StoredType::u16;
  if (bytes <= 4) return negative ? StoredType::i32 : StoredType::u32;
  return negative ? StoredType::i64 : StoredType::u64;
}

hid_t hdf5MemoryType(StoredType type) {
  switch (type) {
    case StoredType::i8:
      return H5T_NATIVE_INT8;
    case StoredType::u8:
      return H5T_NATIVE_UINT8;
    case StoredType::i16:
      return H5T_NATIVE_INT16;
    case StoredType::u16:
      return H5T_NATIVE_UINT16;
    case StoredType::i32:
      return H5T_NATIVE_INT32;
    case StoredType::u32:
      return H5T_NATIVE_UINT32;
    case StoredType::i64:
      return H5T_NATIVE_INT64;
    case StoredType::u64:
      return H5T_NATIVE_UINT64;
    case StoredType::f16:  // hdf5StoredType never says so
    case StoredType::f32:
      return H5T_NATIVE_FLOAT;
    case StoredType::f64:
      return H5T_NATIVE_DOUBLE;
  }
  return H5I_INVALID_HID;
}

std::string hdf5Problem(hid_t dataset) {
  const Hdf5Id creation(H5Dget_create_plist(dataset));
  const H5D_layout_t layout = H5Pget_layout(creation);
  const bool elsewhere = layout == H5D_VIRTUAL || H5Pget_external_count(creation) != 0;
  return elsewhere ? "has its values in other files, which is not supported" : hdf5FilterProblem(creation);
}

OpenArrays openHdf5Arrays(const std::filesystem::path& path) {
  const auto file = std::make_shared<Hdf5Id>(openHdf5File(path));
  const std::string name = shown(path);
  return [file, name](const ArraySlab& slab) {
    const std::string where = name + ":" + cleanText(slab.path);
    const auto dataset = std::make_shared<Hdf5Id>(openHdf5Dataset(*file, slab));
    if (!dataset->good()) failBadInput(where + ": cannot be opened" + hdf5Reason());
    checkHdf5Array(where, *dataset, slab);
    const Hdf5Id creation(H5Dget_create_plist(*dataset));
    OpenArray array{hdf5Chunk(creation, slab.dims.size()), {}};
    array.read = [dataset, where, type = slab.type](std::span<const std::uint64_t> first,
                                                    std::span<const std::uint64_t> count, std::byte* to) {
      const std::vector<hsize_t> start(first.begin(), first.end()), size(count.begin(), count.end());
      const Hdf5Id space(H5Dget_space(*dataset));
      const Hdf5Id memory(H5Screate_simple(int(size.size()), size.data(), nullptr));
      if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr) < 0 ||
          H5Dread(*dataset, hdf5MemoryType(type), memory, space, H5P_DEFAULT, to) < 0)
        failBadInput(where + ": cannot be read" + hdf5Reason());
    };
    return array;
  };
}

}  // namespace scolopax::io
#endif
