// SPDX-License-Identifier: Apache-2.0
// The list of formats: one line and one file each. A format is found by what a file contains, then by its
// name. docs/adding-a-reader.md tells what a new one needs.
#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "renderer/io/volume_file.h"

/// Every format, in the order in which they are tried: NAME of its functions matchNAME and openNAME, the name
/// shown, its endings for --help and errors, and what it needs: the Debian package of its library, or "" if
/// the build has all that it needs. tests/CMakeLists.txt makes a fuzz target of every line.
// clang-format off
#define SCOLOPAX_FORMATS(X)                                                                         \
  X(Raw, "raw", "name_XxYxZ_type.raw, .dat, .ivf", "")                                              \
  X(Nifti, "NIfTI", ".nii, .nii.gz, .hdr + .img", "")                                               \
  X(Nrrd, "NRRD", ".nrrd, .nhdr", "")                                                               \
  X(MetaImage, "MetaImage", ".mha, .mhd", "")                                                       \
  X(Dicom, "DICOM", ".dcm, a folder of such files", SCOLOPAX_LACKS_GDCM)                            \
  X(OmeTiff, "OME-TIFF", ".ome.tif, .ome.tiff, .companion.ome", "")                                 \
  X(Tiff, "TIFF", ".tif, .tiff", "")                                                                \
  X(Zarr, "OME-Zarr", "folders .zarr, .zarr.zip, .ozx, http(s)://", "")                             \
  X(Imaris, "Imaris", ".ims", SCOLOPAX_LACKS_HDF5)                                                  \
  X(OpenPmd, "openPMD", ".h5", SCOLOPAX_LACKS_HDF5)                                                 \
  X(Minc, "MINC", ".mnc", SCOLOPAX_LACKS_HDF5)                                                      \
  X(Netcdf, "NetCDF", ".nc, .nc4, .cdf", SCOLOPAX_LACKS_NETCDF)                                     \
  X(Hdf5, "HDF5", ".h5, .hdf5, .hdf", SCOLOPAX_LACKS_HDF5)                                          \
  X(VtkXml, "VTK XML", ".vti, .vtr, .pvti, .pvtr", "")                                              \
  X(VtkLegacy, "VTK legacy", ".vtk", "")                                                            \
  X(VtkJs, "vtk.js", "folders with index.json", "")                                                 \
  X(OpenVdb, "OpenVDB", ".vdb", SCOLOPAX_LACKS_OPENVDB)                                             \
  X(Npy, "NumPy array", ".npy", "")                                                                 \
  X(Npz, "NumPy archive", ".npz", SCOLOPAX_LACKS_ZIP)                                               \
  X(Slc, "SLC", ".slc", "")                                                                         \
  X(Atlas, "texture atlas", ".json + .png", "")
// clang-format on

namespace scolopax::io {

/// The beginning of a file, or a folder, or a URL, of which nothing is known.
struct FileStart {
  std::filesystem::path path;
  bool folder = false;
  std::string bytes = {};     ///< the first 4096, or all there are; none for a folder
  std::string unpacked = {};  ///< the same of what a gzip file contains; of another file, `bytes`

  /// Whether the name, in lower case, ends so: ".nii.gz".
  bool hasEnding(std::string_view ending) const;
  /// Whether it is a file, unpacked or not, with these bytes at `offset`.
  bool holds(std::string_view magic, std::size_t offset = 0) const;
  /// Whether it is a folder that holds an entry of this name.
  bool contains(std::string_view entry) const;
};

/// Whether the path is that of something on a server: "http://..." or "https://...".
bool isUrl(const std::filesystem::path& path);

/// How well a file or folder matches a format. What it contains takes precedence over its name. A folder that
/// matches by name or content is the format's with all that is below it; `files` is for a folder of which
/// only the format's files directly in it are read, as one.
enum class Match { no, name, files, content };

struct Format {
  std::string_view name;     ///< "NIfTI"
  std::string_view endings;  ///< for --help: ".nii, .nii.gz, .hdr + .img"
  std::string_view missing;  ///< the Debian package of a library that this build lacks; "" if none is missing
  /// Looks at little more than the start of the file, without an error.
  Match (*match)(const FileStart& start);
  /// Reads the headers, and no voxels. Throws Error with one line: file, field, expected, found. Checks sizes
  /// before memory is taken, and that the file can hold the voxels where that is known. nullptr if a library
  /// is missing.
  VolumeFile (*open)(const std::filesystem::path& path, const OpenOptions& options);
};

#define X(NAME, shown, endings, missing)     \
  Match match##NAME(const FileStart& start); \
  VolumeFile open##NAME(const std::filesystem::path& path, const OpenOptions& options);
SCOLOPAX_FORMATS(X)
#undef X

std::span<const Format> formats();

/// The format that matches a file or folder best; nullptr if none does or if it cannot be read.
const Format* findFormat(const std::filesystem::path& path);

/// The same, and how it matches.
struct FormatMatch {
  const Format* format = nullptr;
  Match match = Match::no;
};
FormatMatch findMatch(const std::filesystem::path& path);

/// Opens a file, folder or URL with the format that matches it best. Never waits for a pipe. Names are clean
/// text in what it returns. Throws Error: unsupported, naming the known formats, if none matches, and naming
/// the library if that is missing; badInput unless it is a regular file or a folder of a format, or if it
/// holds no volume; and what the reader throws.
std::shared_ptr<const VolumeFile> openFile(const std::filesystem::path& path,
                                           const OpenOptions& options = {});
/// The same with a given format.
std::shared_ptr<const VolumeFile> openFile(const Format& format, const std::filesystem::path& path,
                                           const OpenOptions& options = {});

}  // namespace scolopax::io
