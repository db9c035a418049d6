// SPDX-License-Identifier: Apache-2.0
// Resolves the parts of a wire scene, one function per part: each sets what the client has left to the server
// and translates the part for the renderer. Called by SceneResolver in the order in which parts need each
// other. All throw ProtocolError(422) with the pointer of the bad field. Limits that the protocol and the
// renderer share are compared here, because the protocol does not depend on the renderer.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>

#include "protocol/problem.h"
#include "protocol/scene.h"
#include "renderer/core/error.h"
#include "renderer/data/method.h"
#include "renderer/data/scene.h"
#include "renderer/data/volume.h"

namespace scolopax::server {

/// All but gradientOpacity.
void resolveChannels(protocol::Scene& scene, Scene& render, const VolumeFacts& volume);
/// `seen`: the points that the automatic view frames; empty: the box.
void resolveCamera(protocol::Scene& scene, Scene& render, const Grid& grid, std::span<const glm::vec3> seen);
/// Clip planes and crop.
void resolveClipping(protocol::Scene& scene, Scene& render, const VolumeFacts& volume);
void resolveLights(const protocol::Scene& scene, Scene& render);
/// Blend mode and integrator. Small macrocells in a large volume cost much and gain little: they are refused
/// if there would be more than `maxIntervals` macrocells x channels, unless they are of the default size.
void resolveIntegrator(const protocol::Scene& scene, Scene& render, const VolumeFacts& volume,
                       std::size_t maxIntervals);
/// Size, background and pixel filter. Refuses more than `maxPixels`.
void resolveImage(const protocol::Scene& scene, Scene& render, std::uint64_t maxPixels);

/// The value with this wire name, which parseScene has checked.
template <class Enum, std::size_t N>
Enum valueOf(const NamedValue (&list)[N], std::string_view name) {
  return Enum(std::find_if(list, list + N, [&](const NamedValue& value) { return value.name == name; }) -
              list);
}

inline glm::dvec3 vectorOf(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
inline std::array<double, 3> arrayOf(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// Turns an Error of `check` into a ProtocolError(422), so that an edit is refused that the renderer would
/// refuse later.
template <class Check>
void refuseAt(const std::string& pointer, Check&& check) {
  try {
    check();
  } catch (const Error& error) {
    throw protocol::ProtocolError(422, pointer, error.what());
  }
}

}  // namespace scolopax::server
