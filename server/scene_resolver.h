// SPDX-License-Identifier: Apache-2.0
// Resolves a sparse wire scene for a volume: sets every value, for the renderer and for the client.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "protocol/lists.h"
#include "protocol/scene.h"
#include "renderer/core/memory_budget.h"
#include "renderer/data/macrocell_grid.h"
#include "renderer/data/scene.h"
#include "server/dataset_store.h"
#include "server/enum_lists.h"
#include "server/sparse_scene.h"
#include "server/stop_rule.h"
#include "server/unmeasured.h"

namespace scolopax::server {

/// Values that were chosen automatically from a scene's curves. They do not change while the curves are
/// edited, so that nothing jumps.
struct AutomaticValues {
  std::shared_ptr<const Dataset> dataset;  ///< the data set that they were chosen for
  /// The points that the automatic view frames (renderer/data/visible_hull.h); null: not needed so far.
  std::shared_ptr<const std::vector<glm::vec3>> framed;
  /// For each channel, the automatic range of its gradientOpacity; empty if it has none or if the range is
  /// set.
  std::vector<std::optional<std::array<double, 2>>> gradientRanges;
};

/// A scene in the forms that the server needs. Immutable once made.
struct ResolvedScene {
  SparseScene sparse;        ///< what the user set
  protocol::Scene resolved;  ///< with every value filled in; method `auto` remains
  Scene render;
  StopRule stop;
  std::shared_ptr<const Dataset> dataset;
  std::size_t time = 0;                           ///< the step that is shown
  std::uint32_t defaultSamples = kRenderSamples;  ///< of this scene and of those that patches make of it
  AutomaticValues automatic = {};
  MemoryBudget::Share memory = {};
};

/// Whether two scenes make the same film: an edit from one to the other changes names, the stop rule or the
/// background, if anything.
bool makeSameFilm(const ResolvedScene& a, const ResolvedScene& b);
/// The parts of the resolved scene that determine the picture at a given number of samples.
nlohmann::json pictureJson(const protocol::Scene& resolved);

class SceneResolver {
 public:
  /// Macrocells x channels that a data set may have, for macrocells below the default size.
  static constexpr std::size_t kMaxIntervals = 1 << 25;

  struct Options {
    std::uint64_t maxPixels;  ///< width x height
    std::size_t maxIntervals = kMaxIntervals;
    std::shared_ptr<MemoryBudget> memory = nullptr;  ///< for pictures and long curves; null: no limit
  };
  SceneResolver(std::shared_ptr<const DatasetStore> datasets, Options options);
  virtual ~SceneResolver() = default;

  using Resolved = std::shared_ptr<const ResolvedScene>;
  /// Resolves a whole scene; `defaultSamples` is its stop rule if it has none. Chooses automatic values (the
  /// view and the ranges of gradients) from its curves, and waits until the data that this needs has been
  /// measured. Throws ProtocolError(422) with the pointer of the bad field, Error(cancelled) once `stop` is
  /// requested, and Error(busy or tooLarge) if there is not enough memory.
  Resolved replace(const nlohmann::json& scene, const std::stop_token& stop = {},
                   std::uint32_t defaultSamples = kRenderSamples) const;
  /// Applies a patch to the sparse form of `base`. Automatic values stay, unless the patch asks for new ones
  /// (by a camera, eye, target, channel, gradientOpacity or range that is null, or by replacing all channels)
  /// or names another data set. Waits and throws as replace() does.
  Resolved patch(const ResolvedScene& base, const nlohmann::json& patch,
                 const std::stop_token& stop = {}) const;
  /// The same for callers that must not wait: throws Unmeasured instead.
  virtual Resolved replaceNow(const nlohmann::json& scene,
                              std::uint32_t defaultSamples = kRenderSamples) const;
  virtual Resolved patchNow(const ResolvedScene& base, const nlohmann::json& patch) const;
  /// The reason why a picture of the scene, with AOVs if they are recorded, can never fit into the memory
  /// budget; nullopt if it may fit.
  std::optional<std::string> tooLarge(const Scene& scene, bool aovs) const;
  const protocol::Lists& lists() const { return lists_; }

 private:
  Resolved resolve(SparseScene sparse, const AutomaticValues& automatic, std::uint32_t defaultSamples) const;
  void frame(const protocol::Scene& scene, const DatasetFacts& facts, ResolvedScene& result) const;
  void resolveGradientOpacity(const VolumeFacts& volume, protocol::Scene& scene, ResolvedScene& result) const;
  std::array<double, 2> gradientRange(const VolumeFacts& volume, const ResolvedScene& scene,
                                      int channel) const;
  std::shared_ptr<const Dataset> datasetOf(const nlohmann::json& scene) const;

  std::shared_ptr<const DatasetStore> datasets_;
  Options options_;
  protocol::Lists lists_;
};

}  // namespace scolopax::server
