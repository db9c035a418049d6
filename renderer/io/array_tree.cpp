// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/array_tree.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <type_traits>

#include "renderer/core/error.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::size_t kMostArrayNodes = 200'000;
constexpr std::uint64_t kMostArrayTreeBytes = std::uint64_t(256) << 20;

/// Turns plain values, texts, vectors and what has parts into bytes.
struct ArrayPacker {
  std::vector<std::byte> bytes = {};

  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void operator()(T& value) {
    const auto* first = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), first, first + sizeof(T));
  }
  template <class Sequence>
  requires requires(Sequence s) { s.resize(0); }
  void operator()(Sequence& sequence) {
    std::uint64_t count = sequence.size();
    (*this)(count);
    for (auto& item : sequence) visitArray(*this, item);
  }
};

/// The reverse. The bytes come from a process in which a library may have overwritten anything.
struct ArrayUnpacker {
  std::span<const std::byte> bytes;

  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void operator()(T& value) {
    if (bytes.size() < sizeof(T)) failBadInput("expected more bytes from the library's process");
    if constexpr (std::is_same_v<T, bool>)
      value = bytes[0] != std::byte(0);
    else
      std::memcpy(&value, bytes.data(), sizeof(T));
    bytes = bytes.subspan(sizeof(T));
  }
  template <class Sequence>
  requires requires(Sequence s) { s.resize(0); }
  void operator()(Sequence& sequence) {
    std::uint64_t count = 0;
    (*this)(count);
    if (count > bytes.size()) failBadInput("expected more bytes from the library's process");
    sequence.resize(std::size_t(count));
    for (auto& item : sequence) visitArray(*this, item);
  }
};

template <class Archive, class T>
void visitArray(Archive& archive, T& value) {
  archive(value);
}
template <class Archive>
void visitArray(Archive& archive, ArrayAttribute& attribute) {
  archive(attribute.name);
  archive(attribute.numbers);
  archive(attribute.texts);
}
template <class Archive>
void visitArray(Archive& archive, ArrayNode& node) {
  archive(node.path);
  archive(node.isGroup);
  archive(node.dims);
  archive(node.dimNames);
  std::int32_t type = node.type ? std::int32_t(*node.type) : -1;
  archive(type);
  node.type.reset();
  if (type >= 0 && type <= std::int32_t(StoredType::f64)) node.type = StoredType(type);
  archive(node.chunkBytes);
  archive(node.problem);
  archive(node.values);
  archive(node.attributes);
}

}  // namespace

const ArrayAttribute* ArrayNode::find(std::string_view attribute) const {
  const auto found = std::ranges::find(attributes, attribute, &ArrayAttribute::name);
  return found == attributes.end() ? nullptr : &*found;
}

std::vector<double> ArrayNode::numbers(std::string_view attribute) const {
  const ArrayAttribute* found = find(attribute);
  return found ? found->numbers : std::vector<double>();
}

std::string ArrayNode::joined(std::string_view attribute) const {
  std::string all;
  if (const ArrayAttribute* found = find(attribute))
    for (const std::string& text : found->texts) all += text;
  return all;
}

std::optional<double> ArrayNode::number(std::string_view attribute) const {
  const ArrayAttribute* found = find(attribute);
  return found && found->numbers.size() == 1 ? std::optional(found->numbers[0]) : std::nullopt;
}

std::optional<std::string> ArrayNode::text(std::string_view attribute) const {
  const ArrayAttribute* found = find(attribute);
  return found && found->texts.size() == 1 ? std::optional(found->texts[0]) : std::nullopt;
}

const ArrayNode* ArrayTree::find(std::string_view path) const {
  const auto found = byPath.find(path);
  return found == byPath.end() ? nullptr : &nodes[found->second];
}

std::string parentOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == 0 || slash == std::string::npos ? "/" : path.substr(0, slash);
}

std::string lastOf(const std::string& path) { return path.substr(path.rfind('/') + 1); }

void sendNode(const Sender& sender, const ArrayNode& node) {
  ArrayPacker packer;
  ArrayNode copy = node;
  visitArray(packer, copy);
  sender.send({packer.bytes});
}

ArrayTree scanApart(const std::filesystem::path& path, std::chrono::seconds computing, const Warn& warn,
                    const std::stop_token& stop, const std::function<void(const Sender&)>& scan) {
  const std::string file = shown(path);
  ArrayTree tree;
  std::uint64_t received = 0;
  const auto receive = [&](std::span<const std::byte> bytes) {
    received += bytes.size();
    if (tree.nodes.size() == kMostArrayNodes || received > kMostArrayTreeBytes)
      throw Error(ErrorCode::tooLarge, file + ": expected at most " + std::to_string(kMostArrayNodes) +
                                           " groups and arrays with " + byteCount(kMostArrayTreeBytes) +
                                           " of attributes, found more");
    ArrayUnpacker unpacker{bytes};
    visitArray(unpacker, tree.nodes.emplace_back());
    tree.byPath.emplace(tree.nodes.back().path, tree.nodes.size() - 1);
  };
  runApart(file, {.computing = computing}, stop, scan, {receive, warn});
  return tree;
}

}  // namespace scolopax::io
