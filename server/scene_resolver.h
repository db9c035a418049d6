// SPDX-License-Identifier: Apache-2.0
// The wire's sparse scene and a volume to a scene with every value: for the renderer and for the client.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "protocol/lists.h"
#include "protocol/scene.h"
#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"
#include "server/dataset_store.h"
#include "server/stop_rule.h"

namespace scolopax::server {

/// A scene in the forms the server needs it in. Immutable once made.
struct ResolvedScene {
  nlohmann::json sparse;    ///< what the user set
  nlohmann::json resolved;  ///< every value filled in; `auto` stays
  nlohmann::json picture;   ///< `resolved` without what leaves the picture as it is
  Scene render;
  StopRule stop;
  std::shared_ptr<const Dataset> dataset;
  /// What the automatic view frames (renderer/data/visible_hull.h); null: no scene so far has needed it.
  std::shared_ptr<const std::vector<glm::vec3>> framed = nullptr;
};

/// The names the renderer knows, for validation, schema and capabilities.
protocol::Lists rendererLists();

class SceneResolver {
 public:
  struct Options {
    std::uint32_t defaultSamples = 64;     ///< when the scene has no stop rule
    std::uint64_t maxPixels = 16'777'216;  ///< width x height
    std::size_t maxIntervals = 1 << 25;    ///< macrocells x channels, where the size is not the default
  };
  SceneResolver(std::shared_ptr<const DatasetStore> datasets, Options options);

  /// The scene of a document. Its automatic view frames what its curves show. Throws ProtocolError(422) with
  /// the pointer of the bad field.
  std::shared_ptr<const ResolvedScene> replace(const nlohmann::json& scene) const;
  /// `base` with a patch applied to its sparse form. What its automatic view frames stays, so that nothing
  /// jumps while curves are edited, unless the patch asks for that view (a null camera, eye or target) or
  /// names another data set. Throws as above.
  std::shared_ptr<const ResolvedScene> patch(const ResolvedScene& base, const nlohmann::json& patch) const;
  const protocol::Lists& lists() const { return lists_; }

 private:
  using Framed = std::shared_ptr<const std::vector<glm::vec3>>;
  std::shared_ptr<const ResolvedScene> resolve(nlohmann::json sparse, const ResolvedScene* base) const;
  Framed frame(const Dataset& dataset, const Scene& render) const;
  std::shared_ptr<const Dataset> datasetOf(const nlohmann::json& scene) const;

  std::shared_ptr<const DatasetStore> datasets_;
  std::map<const Dataset*, MacrocellGrid> coarse_;  ///< of each, for frame()
  Options options_;
  protocol::Lists lists_;
};

}  // namespace scolopax::server
