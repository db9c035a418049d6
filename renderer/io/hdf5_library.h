// SPDX-License-Identifier: Apache-2.0
// HDF5 files by libhdf5, of which many versions crash on damaged files: everything here runs in a child
// process (apart.h). Between array_tree.h, array_slabs.h and the library.
#pragma once
#if SCOLOPAX_HAS_HDF5
#include <hdf5.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "renderer/io/array_slabs.h"
#include "renderer/io/array_tree.h"

namespace scolopax::io {

/// Owns an identifier of the library; of any kind.
class Hdf5Id {
 public:
  explicit Hdf5Id(hid_t id = -1) : id_(id) {}
  Hdf5Id(Hdf5Id&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Hdf5Id& operator=(Hdf5Id&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Hdf5Id() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
};

/// ": ", and what the library says of its last failure; "" if it says nothing.
std::string hdf5Reason();
/// Opens for reading. From then on no other file can be opened; nothing is printed and no filter is loaded.
/// Throws Error(badInput).
Hdf5Id openHdf5File(const std::filesystem::path& path);
/// The type whose numbers the library is to give; none if the file's type is not numbers.
std::optional<StoredType> hdf5StoredType(hid_t fileType);
hid_t hdf5MemoryType(StoredType type);
/// Why the values of an array cannot be had; "" if they can.
std::string hdf5Problem(hid_t dataset);

/// Sends a node for every group and array that the file holds itself.
void scanHdf5(const std::filesystem::path& path, const Sender& sender);
OpenArrays openHdf5Arrays(const std::filesystem::path& path);

}  // namespace scolopax::io
#endif
