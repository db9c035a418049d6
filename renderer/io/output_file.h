// SPDX-License-Identifier: Apache-2.0
// Writes files whole or not at all.
#pragma once
#include <filesystem>
#include <span>
#include <string_view>

namespace scolopax::io {

/// Throws Error(io), naming the path, if no file can be written there. Meant to be called before long work;
/// changes nothing.
void checkWritable(const std::filesystem::path& path);

/// Writes a file under a temporary name beside `path` and renames it, so that `path` never holds a partial
/// file. Pipes, devices, and files in folders that cannot be written to, are written directly. Throws
/// Error(io).
void writeFile(const std::filesystem::path& path, std::string_view bytes);
/// The same for bytes in several parts, written one after the other.
void writeFile(const std::filesystem::path& path, std::span<const std::string_view> parts);

}  // namespace scolopax::io
