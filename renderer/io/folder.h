// SPDX-License-Identifier: Apache-2.0
// The volume files in a folder.
#pragma once
#include <filesystem>
#include <vector>

#include "renderer/io/volume_file.h"

namespace scolopax::io {

/// The most entries, files and folders, that are looked at.
inline constexpr std::size_t kMostFolderEntries = 20'000;

/// Files, and folders of formats that consist of folders, that some format claims, sorted with numbers in
/// their order, each folder's own files first. In place of files that belong together (Match::files) comes
/// their folder, which may be `folder` itself. Hidden entries are left out, as are symbolic links that lead
/// out of the folder; other links to folders are followed only if a format claims them. Files and folders
/// below that cannot be read are left out with a warning. Throws Error: io if the folder itself cannot be
/// read, tooLarge if it has more than kMostFolderEntries, cancelled once options.stop is requested.
std::vector<std::filesystem::path> volumesIn(const std::filesystem::path& folder, const OpenOptions& options);

/// Whether a format claims the folder with all that is below it.
bool claimsAllBelow(const std::filesystem::path& folder);

/// Whether `a` comes before `b`; digits compare as numbers: "a9" before "a10".
bool comesBefore(std::string_view a, std::string_view b);

}  // namespace scolopax::io
