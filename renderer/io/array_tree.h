// SPDX-License-Identifier: Apache-2.0
// What a file of named arrays (HDF5, NetCDF) holds, as plain facts: a child process finds them by the
// library, this process makes volumes of them.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/io/apart.h"
#include "renderer/io/loading.h"
#include "renderer/io/stored_type.h"

namespace scolopax::io {

/// Numbers or texts; neither if it is of another type or too large.
struct ArrayAttribute {
  std::string name;
  std::vector<double> numbers = {};
  std::vector<std::string> texts = {};
};

/// A group or an array.
struct ArrayNode {
  std::string path;  ///< "/" or "/a/b"; any bytes
  bool isGroup = false;
  std::vector<std::uint64_t> dims = {};    ///< slowest first, as all of these lists
  std::vector<std::string> dimNames = {};  ///< NetCDF only
  std::optional<StoredType> type = {};     ///< none if it is not numbers
  std::uint64_t chunkBytes = 0;            ///< of an unpacked chunk; 0 if it is not in chunks
  std::string problem = {};                ///< why its values cannot be had, after its path; "" if they can
  std::vector<double> values = {};         ///< only of coordinates and scales
  std::vector<ArrayAttribute> attributes = {};

  const ArrayAttribute* find(std::string_view attribute) const;
  /// The attribute's numbers; none if there is no such attribute.
  std::vector<double> numbers(std::string_view attribute) const;
  /// All texts of the attribute in one: Imaris writes arrays of letters. "" if there is no such attribute.
  std::string joined(std::string_view attribute) const;
  /// The attribute's only number or text.
  std::optional<double> number(std::string_view attribute) const;
  std::optional<std::string> text(std::string_view attribute) const;
};

struct ArrayTree {
  std::vector<ArrayNode> nodes;  ///< each group before what it contains
  std::map<std::string, std::size_t, std::less<>> byPath = {};

  const ArrayNode* find(std::string_view path) const;
};

/// "/a" of "/a/b", "/" of "/a"; "b" of "/a/b".
std::string parentOf(const std::string& path);
std::string lastOf(const std::string& path);

/// In the child.
void sendNode(const Sender& sender, const ArrayNode& node);

/// Runs `scan`, which sends nodes, in a child that may compute for so long. Throws Error as runApart, and
/// tooLarge for too many nodes.
ArrayTree scanApart(const std::filesystem::path& path, std::chrono::seconds computing, const Warn& warn,
                    const std::stop_token& stop, const std::function<void(const Sender&)>& scan);

}  // namespace scolopax::io
