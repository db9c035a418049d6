// SPDX-License-Identifier: Apache-2.0
// The wire's sparse scene and a volume to a scene with every value: for the renderer and for the client.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <vector>

#include "protocol/lists.h"
#include "protocol/scene.h"
#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"
#include "server/dataset_store.h"
#include "server/stop_rule.h"
#include "server/unmeasured.h"

namespace scolopax::server {

/// What was chosen by the curves of a scene, and stays while they are edited, so that nothing jumps.
struct Chosen {
  std::shared_ptr<const Dataset> dataset;  ///< of which it was chosen
  /// What the automatic view frames (renderer/data/visible_hull.h); null: no scene so far has needed it.
  std::shared_ptr<const std::vector<glm::vec3>> framed;
  /// Per channel the automatic range of gradientOpacity; none where the scene has none that is automatic.
  std::vector<std::optional<std::array<double, 2>>> gradientRanges;
};

/// A scene in the forms the server needs it in. Immutable once made.
struct ResolvedScene {
  nlohmann::json sparse;    ///< what the user set
  nlohmann::json resolved;  ///< every value filled in; `auto` stays
  nlohmann::json picture;   ///< `resolved` without what leaves the picture as it is
  Scene render;
  StopRule stop;
  std::shared_ptr<const Dataset> dataset;
  Chosen chosen = {};
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

  using Resolved = std::shared_ptr<const ResolvedScene>;
  /// The scene of a document. What is automatic, the view and ranges of gradients, is chosen by its curves;
  /// what that needs of the data is waited for. Throws ProtocolError(422) with the pointer of the bad field,
  /// Error(cancelled) once `stop` is requested, and Error(busy, tooLarge) where memory is missing.
  Resolved replace(const nlohmann::json& scene, const std::stop_token& stop = {}) const;
  /// `base` with a patch applied to its sparse form. What was chosen by its curves stays, unless the patch
  /// asks for it anew (a null camera, eye or target; a null range of gradientOpacity, or one that comes back)
  /// or names another data set. Waits and throws as above.
  Resolved patch(const ResolvedScene& base, const nlohmann::json& patch,
                 const std::stop_token& stop = {}) const;
  /// The same for those who must not wait: throw Unmeasured instead.
  Resolved replaceNow(const nlohmann::json& scene) const;
  Resolved patchNow(const ResolvedScene& base, const nlohmann::json& patch) const;
  const protocol::Lists& lists() const { return lists_; }

 private:
  Resolved resolve(nlohmann::json sparse, const Chosen& chosen) const;
  void frame(const protocol::Scene& scene, ResolvedScene& result) const;
  void resolveGradientOpacity(protocol::Scene& scene, ResolvedScene& result) const;
  std::array<double, 2> gradientRange(const ResolvedScene& scene, int channel) const;
  std::shared_ptr<const Dataset> datasetOf(const nlohmann::json& scene) const;

  std::shared_ptr<const DatasetStore> datasets_;
  std::map<const Dataset*, MacrocellGrid> coarse_;  ///< of each, for frame()
  Options options_;
  protocol::Lists lists_;
};

}  // namespace scolopax::server
