// SPDX-License-Identifier: Apache-2.0
#include "server/pick.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "protocol/problem.h"

namespace scolopax::server {
namespace {

using nlohmann::json;
using protocol::ProtocolError;

/// The pixel that a coordinate lies in. Throws ProtocolError(422) outside the picture.
int pixelOf(const std::string& name, double coordinate, int size) {
  if (!(coordinate >= 0 && coordinate < size))
    throw ProtocolError(422, "/" + name,
                        "/" + name + ": expected a number >= 0 and < " + std::to_string(size) + ", found " +
                            json(coordinate).dump());
  return int(coordinate);
}

struct Span {
  int first, count;
};
Span spanBetween(int a, int b) { return {std::min(a, b), std::abs(a - b) + 1}; }

std::array<int, 3> nearestVoxel(const Picked& picked, const glm::ivec3& dims) {
  std::array<int, 3> voxel{};
  for (int axis = 0; axis < 3; ++axis)
    voxel[std::size_t(axis)] = std::clamp(int(std::floor(picked.voxel[axis] + 0.5)), 0, dims[axis] - 1);
  return voxel;
}

json hitJson(const ResolvedScene& scene, const Volume& volume, const Picked& picked) {
  return {{"point", {picked.point.x, picked.point.y, picked.point.z}},
          {"voxel", nearestVoxel(picked, volume.grid().dims)},
          {"channel", picked.channel},
          {"name", *scene.resolved.channels[std::size_t(picked.channel)].name},
          {"depth", picked.depth},
          {"values", valuesJson(volume, picked.voxel, scene.render.channels)}};
}

}  // namespace

PixelArea areaOf(const PickQuery& query, int width, int height) {
  if (query.x2.has_value() != query.y2.has_value()) {
    const std::string missing = query.x2 ? "y2" : "x2";
    throw ProtocolError(422, "/" + missing,
                        "/" + missing + ": expected both x2 and y2 or neither, found one");
  }
  const int x = pixelOf("x", query.x, width), y = pixelOf("y", query.y, height);
  const Span columns = spanBetween(x, query.x2 ? pixelOf("x2", *query.x2, width) : x);
  const Span rows = spanBetween(y, query.y2 ? pixelOf("y2", *query.y2, height) : y);
  return {columns.first, rows.first, columns.count, rows.count};
}

json pickedJson(const ResolvedScene& scene, const Volume& volume, std::uint32_t revision,
                const PickQuery& query, const std::vector<Picked>& found) {
  json answer = {{"revision", revision}};
  if (!query.x2) {
    answer["hit"] = !found.empty();
    if (!found.empty()) answer.update(hitJson(scene, volume, found.front()));
    return answer;
  }
  const PixelArea area = areaOf(query, scene.render.width, scene.render.height);
  answer["truncated"] = std::int64_t(area.width) * area.height > kMaxPickPixels;
  json& hits = answer["hits"] = json::array();
  std::set<std::array<int, 3>> seen;
  for (const Picked& picked : found)
    if (seen.insert(nearestVoxel(picked, volume.grid().dims)).second)
      hits.push_back(hitJson(scene, volume, picked));
  return answer;
}

}  // namespace scolopax::server
