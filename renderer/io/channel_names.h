// SPDX-License-Identifier: Apache-2.0
// Short names for the channels of one data set.
#pragma once
#include <string>
#include <vector>

namespace scolopax::io {

/// Drops the words that all names have in common at the beginning and at the end: "TCGA_t1_bet" and
/// "TCGA_t1c_bet" become "t1" and "t1c". Words end at spaces and at _ - . : / and every name keeps one that
/// has a letter. A single name, and names that would become equal to nothing, stay as they are.
std::vector<std::string> shortNames(std::vector<std::string> names);

}  // namespace scolopax::io
