// SPDX-License-Identifier: Apache-2.0
// Makes HDF5 files by the library, for the tests of their readers.
#pragma once
#include <hdf5.h>

#include <filesystem>
#include <string>
#include <vector>

#include "renderer/io/formats.h"

namespace scolopax::io {

template <class T>
hid_t hdf5NativeType() {
  if constexpr (std::is_same_v<T, std::int8_t>) return H5T_NATIVE_INT8;
  if constexpr (std::is_same_v<T, std::uint8_t>) return H5T_NATIVE_UINT8;
  if constexpr (std::is_same_v<T, std::int16_t>) return H5T_NATIVE_INT16;
  if constexpr (std::is_same_v<T, std::uint16_t>) return H5T_NATIVE_UINT16;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::uint64_t>) return H5T_NATIVE_UINT64;
  if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
  return H5T_NATIVE_DOUBLE;
}

class Hdf5Maker {
 public:
  struct Storage {
    hid_t type = -1;  ///< in the file; that of the values if -1
    std::vector<hsize_t> chunk = {};
    int deflate = -1;
    bool shuffle = false;
  };

  explicit Hdf5Maker(const std::filesystem::path& path, hsize_t userBlock = 0) {
    const hid_t creation = H5Pcreate(H5P_FILE_CREATE);
    if (userBlock > 0) H5Pset_userblock(creation, userBlock);
    file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, H5P_DEFAULT);
    H5Pclose(creation);
    links_ = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links_, 1);
  }
  ~Hdf5Maker() {
    H5Pclose(links_);
    H5Fclose(file_);
  }
  Hdf5Maker(const Hdf5Maker&) = delete;
  Hdf5Maker& operator=(const Hdf5Maker&) = delete;

  hid_t file() const { return file_; }
  /// Creates the groups above a link.
  hid_t links() const { return links_; }

  void group(const std::string& path) {
    H5Gclose(H5Gcreate2(file_, path.c_str(), links_, H5P_DEFAULT, H5P_DEFAULT));
  }
  template <class T>
  void array(const std::string& path, const std::vector<hsize_t>& dims, const std::vector<T>& values,
             const Storage& storage) {
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    if (!storage.chunk.empty()) H5Pset_chunk(creation, int(dims.size()), storage.chunk.data());
    if (storage.shuffle) H5Pset_shuffle(creation);
    if (storage.deflate >= 0) H5Pset_deflate(creation, unsigned(storage.deflate));
    const hid_t space = H5Screate_simple(int(dims.size()), dims.data(), nullptr);
    const hid_t set = H5Dcreate2(file_, path.c_str(), storage.type < 0 ? hdf5NativeType<T>() : storage.type,
                                 space, links_, creation, H5P_DEFAULT);
    if (!values.empty()) H5Dwrite(set, hdf5NativeType<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(creation);
  }
  template <class T>
  void array(const std::string& path, const std::vector<hsize_t>& dims, const std::vector<T>& values) {
    array(path, dims, values, Storage());
  }
  void attribute(const std::string& path, const std::string& name, const std::vector<double>& numbers) {
    const hsize_t count = numbers.size();
    const hid_t space = count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr);
    write(path, name, H5T_NATIVE_DOUBLE, space, numbers.data());
  }
  void attribute(const std::string& path, const std::string& name, const std::string& text) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, std::max<std::size_t>(text.size(), 1));
    write(path, name, type, H5Screate(H5S_SCALAR), text.c_str());
    H5Tclose(type);
  }
  /// Texts of variable length.
  void attribute(const std::string& path, const std::string& name, const std::vector<std::string>& texts) {
    std::vector<const char*> pointers;
    for (const std::string& text : texts) pointers.push_back(text.c_str());
    const hsize_t count = texts.size();
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    write(path, name, type, H5Screate_simple(1, &count, nullptr), pointers.data());
    H5Tclose(type);
  }
  /// As Imaris does: an array of texts of one letter.
  void letters(const std::string& path, const std::string& name, const std::string& text) {
    const hsize_t count = text.size();
    const hid_t type = H5Tcopy(H5T_C_S1);
    write(path, name, type, H5Screate_simple(1, &count, nullptr), text.data());
    H5Tclose(type);
  }

 private:
  void write(const std::string& path, const std::string& name, hid_t type, hid_t space, const void* values) {
    const hid_t object = H5Oopen(file_, path.c_str(), H5P_DEFAULT);
    const hid_t attribute = H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, type, values);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Oclose(object);
  }

  hid_t file_, links_;
};

/// 0, 1, ...
template <class T>
std::vector<T> rampOf(std::size_t count) {
  std::vector<T> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = T(i);
  return values;
}

/// The paths of a file's volumes.
inline std::vector<std::string> hdf5Paths(const std::filesystem::path& path, const Warn& warn = {}) {
  std::vector<std::string> paths;
  const auto file = openFile(path, {.warn = warn});
  for (const VolumeInfo& volume : file->volumes) paths.push_back(volume.path);
  return paths;
}

}  // namespace scolopax::io
