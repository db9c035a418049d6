// SPDX-License-Identifier: Apache-2.0
// Upper bounds of the extinction per macrocell. After an edit of a channel's curve, only that channel's table
// and the totals of the cells whose bounds it changes are computed anew; the other totals are copied.
#pragma once
#include <memory>
#include <stop_token>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/surfaces.h"
#include "renderer/data/transfer_function.h"
#include "renderer/kernel/majorants.h"

namespace scolopax {

/// Bounds of the channel in `column` of the macrocells. Every sample x of a cell satisfies, in float,
/// extinction(x) <= over(the cell's interval), the least upper bound over the interval's stored values.
kernel::BoundTable buildBounds(const ValueLevels& levels, const TransferFunction& transfer, int column);

/// A table that tells, for intervals of a channel in `column`, whether they may hold a surface: 1, else 0.
kernel::BoundTable buildPresence(const ValueLevels& levels, const Surfaces& surfaces, int column);

/// Bounds of a channel whose column of the macrocells holds levels of the extinction itself.
kernel::BoundTable boundsOfExtinction(const ValueLevels& levels, int column);

class MajorantGrid {
 public:
  /// `tables`: one per visible channel, in the order of the channels, each for a column of `macrocells`.
  /// `sums`: the channels' extinctions add up; otherwise the largest hides the others. `apart`: kernels need
  /// to know which channels are active in each cell. Totals that are as in `before`, if given, are not
  /// recomputed, and all are shared with it if none has changed. The memory is charged to `memory`, if given.
  /// Throws Error(cancelled) once `stop` is requested while totals are computed.
  MajorantGrid(std::shared_ptr<const MacrocellGrid> macrocells, std::vector<kernel::BoundTable> tables,
               bool sums, bool apart, const MajorantGrid* before = nullptr,
               const std::shared_ptr<MemoryBudget>& memory = nullptr, const std::stop_token& stop = {});
  /// Number of cells whose total was recomputed.
  std::size_t cellsRebuilt() const { return cellsRebuilt_; }
  /// Valid while this object or a copy of it lives.
  kernel::MajorantView view() const;

 private:
  struct Totals;
  struct Changes;
  Changes changesSince(const MajorantGrid& before, bool apart) const;
  std::size_t rebuild(const Changes& changes, Totals& totals, const std::stop_token& stop) const;
  float totalOf(const kernel::LevelInterval* intervals) const;
  std::uint32_t activeOf(const kernel::LevelInterval* intervals) const;

  std::shared_ptr<const MacrocellGrid> macrocells_;
  std::shared_ptr<const std::vector<kernel::BoundTable>> tables_;
  bool sums_;
  std::shared_ptr<const Totals> totals_;
  std::size_t cellsRebuilt_ = 0;

  /// Up to this many columns, kernels test all channels wherever one may be active, unless `apart` is set.
  static constexpr std::size_t kFewColumns = 4;
};

}  // namespace scolopax
