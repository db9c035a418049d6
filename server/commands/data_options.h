// SPDX-License-Identifier: Apache-2.0
// Options for opening volume files, the same in several commands.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "renderer/io/volume_file.h"

namespace scolopax {

inline constexpr const char* kDataDoc =
    "Volume files or folders; FILE:NAME is one data set or channel of a file. Those with the same grid form "
    "one data "
    "set";
inline constexpr const char* kFourthAxisDoc =
    "What a fourth axis of NIfTI and NRRD files is; auto: as the header says, otherwise channels if it has a "
    "length of "
    "3, and times if not";

/// Restricts an option to the names of FourthAxis.
CLI::Option* checkFourthAxis(CLI::Option* option);
/// `name` must have passed the check.
io::FourthAxis fourthAxisOf(const std::string& name);

}  // namespace scolopax
