// SPDX-License-Identifier: Apache-2.0
#include "protocol/patch.h"

#include <algorithm>
#include <charconv>

#include "protocol/read_fields.h"
#include "protocol/scene_json.h"

namespace scolopax::protocol {
namespace {

/// Reads a list index: "0", "7", "12". nullopt for "", "-1", "07", "1e3" and more than 9 digits.
std::optional<std::size_t> indexOf(std::string_view key) {
  if (key.empty() || key.size() > 9 || (key.size() > 1 && key[0] == '0')) return std::nullopt;
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), index);
  if (error != std::errc() || end != key.data() + key.size()) return std::nullopt;
  return index;
}

std::size_t indexBelow(const std::string& key, std::size_t count, const Path& list) {
  const std::optional<std::size_t> index = indexOf(key);
  if (!index) fail(list / key, "expected the index of an entry");
  if (*index >= count) fail(list / key, "expected an index below " + std::to_string(count));
  return *index;
}

/// Patches a value that has no table: replaces it or, in a list, replaces single existing entries.
void patchLeaf(nlohmann::json& target, const nlohmann::json& patch, const Path& path) {
  if (!patch.is_object()) {
    target = patch;
    return;
  }
  if (!target.is_array()) fail(path, "an object patches the entries of a list, but no list is set here");
  for (const auto& [key, value] : patch.items()) {
    nlohmann::json& entry = target[indexBelow(key, target.size(), path)];
    if (value.is_null()) fail(path / key, "an entry of this list has no default");
    patchLeaf(entry, value, path / key);
  }
}

template <Described T>
void patchStruct(nlohmann::json& target, const nlohmann::json& patch, const Path& path,
                 std::size_t channelCount);

template <class T>
struct PatchValue {
  static void apply(nlohmann::json& target, const nlohmann::json& patch, const Path& path, const Traits&,
                    std::size_t) {
    patchLeaf(target, patch, path);
  }
};

template <Described T>
struct PatchValue<T> {
  static void apply(nlohmann::json& target, const nlohmann::json& patch, const Path& path, const Traits&,
                    std::size_t channelCount) {
    patchStruct<T>(target, patch, path, channelCount);
  }
};

/// An object that may be absent. patchStruct has already handled null.
template <Described T>
struct PatchValue<std::optional<T>> : PatchValue<T> {};

template <Described T>
struct PatchValue<std::vector<T>> {
  static void apply(nlohmann::json& target, const nlohmann::json& patch, const Path& path,
                    const Traits& traits, std::size_t channelCount) {
    std::size_t room = traits.maxItems;
    if constexpr (std::is_same_v<T, Channel>) room = std::min(room, channelCount);
    if (patch.is_array()) {
      target = nlohmann::json::array();
      if (patch.size() > room) fail(path / room, "expected at most " + std::to_string(room) + " entries");
      for (std::size_t i = 0; i < patch.size(); ++i) patchEntry(target, i, patch[i], path / i, channelCount);
    } else if (patch.is_object()) {
      if (!target.is_array()) target = nlohmann::json::array();
      for (const auto& [key, value] : patch.items()) {
        patchEntry(target, indexBelow(key, room, path), value, path / key, channelCount);
      }
    } else {
      failExpected(path, "a list, or an object with indices as keys", patch);
    }
  }

  static void patchEntry(nlohmann::json& list, std::size_t index, const nlohmann::json& patch,
                         const Path& path, std::size_t channelCount) {
    while (list.size() <= index) list.push_back(nlohmann::json::object());
    if (patch.is_null())
      list[index] = nlohmann::json::object();
    else
      patchStruct<T>(list[index], patch, path, channelCount);
  }
};

/// If a patch sets only one of two fields that exclude each other, removes the other one.
template <Described T>
void removeExcluded(nlohmann::json& target, const nlohmann::json& patch) {
  const auto sets = [&](std::string_view key) {
    const auto found = patch.find(key);
    return found != patch.end() && !found->is_null();
  };
  forEachExclusive<T>([&](const Exclusive& pair) {
    if (sets(pair.first) && !patch.contains(pair.second)) target.erase(std::string(pair.second));
    if (sets(pair.second) && !patch.contains(pair.first)) target.erase(std::string(pair.first));
  });
}

template <Described T>
void patchStruct(nlohmann::json& target, const nlohmann::json& patch, const Path& path,
                 std::size_t channelCount) {
  if (!patch.is_object()) failExpected(path, "an object", patch);
  refuseUnknown<T>(patch, path);
  if (!target.is_object()) target = nlohmann::json::object();
  removeExcluded<T>(target, patch);
  forEachField<T>([&]<class Value>(const Field<T, Value>& field) {
    const auto found = patch.find(field.name);
    if (found == patch.end()) return;
    const std::string name(field.name);
    if (found->is_null())
      target.erase(name);
    else
      PatchValue<Value>::apply(target[name], *found, path / field.name, field.traits, channelCount);
  });
}

template <Described T>
nlohmann::json structPatchBetween(const T& from, const T& to);

/// The patch for a member that differs.
template <class T>
struct MemberPatch {
  static nlohmann::json between(const T&, const T& to) { return writeValue(to); }
};

template <Described T>
struct MemberPatch<T> {
  static nlohmann::json between(const T& from, const T& to) { return structPatchBetween(from, to); }
};

template <Described T>
struct MemberPatch<std::optional<T>> {
  static nlohmann::json between(const std::optional<T>& from, const std::optional<T>& to) {
    return from && to ? structPatchBetween(*from, *to) : writeValue(to);
  }
};

template <Described T>
struct MemberPatch<std::vector<T>> {
  static nlohmann::json between(const std::vector<T>& from, const std::vector<T>& to) {
    if (to.size() < from.size()) return writeValue(to);  // only a new list can be shorter
    nlohmann::json patch = nlohmann::json::object();
    for (std::size_t i = 0; i < to.size(); ++i) {
      if (i >= from.size())
        patch[std::to_string(i)] = writeValue(to[i]);
      else if (from[i] != to[i])
        patch[std::to_string(i)] = structPatchBetween(from[i], to[i]);
    }
    return patch;
  }
};

template <Described T>
nlohmann::json structPatchBetween(const T& from, const T& to) {
  nlohmann::json patch = nlohmann::json::object();
  forEachField<T>([&]<class Value>(const Field<T, Value>& field) {
    const Value &before = from.*field.member, &after = to.*field.member;
    if (before != after) patch[std::string(field.name)] = MemberPatch<Value>::between(before, after);
  });
  // Of two fields that exclude each other, one that remains must be in the patch, or applying it would remove
  // the field.
  const auto keep = [&](std::string_view partner) {
    forEachField<T>([&](const auto& field) {
      if (field.name != partner) return;
      nlohmann::json value = writeValue(to.*field.member);
      if (!value.is_null()) patch[std::string(partner)] = std::move(value);
    });
  };
  const auto named = [&](std::string_view name) { return patch.contains(name); };
  const auto set = [&](std::string_view name) { return named(name) && !patch[name].is_null(); };
  forEachExclusive<T>([&](const Exclusive& pair) {
    if (set(pair.first) && !named(pair.second))
      keep(pair.second);
    else if (set(pair.second) && !named(pair.first))
      keep(pair.first);
  });
  return patch;
}

}  // namespace

nlohmann::json applyPatch(nlohmann::json sparse, const nlohmann::json& patch, std::size_t channelCount) {
  patchStruct<Scene>(sparse, patch, Path(), channelCount);
  return sparse;
}

nlohmann::json patchBetween(const Scene& from, const Scene& to) { return structPatchBetween(from, to); }

}  // namespace scolopax::protocol
