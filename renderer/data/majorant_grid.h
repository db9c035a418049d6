// SPDX-License-Identifier: Apache-2.0
// Upper bounds of the extinction per macrocell. An edit makes new ones: of a channel's curve, it costs a new
// table of that channel, the totals of those cells whose values it changes, and a copy of the others'.
#pragma once
#include <memory>
#include <vector>

#include "renderer/core/memory_budget.h"
#include "renderer/data/transfer_function.h"
#include "renderer/kernel/majorants.h"

namespace scolopax {

/// Bounds of the channel in `column` of the macrocells. For every sample x of a cell, in float: extinction(x)
/// <= over(the cell's interval), which is the least upper bound over the interval's stored values.
kernel::BoundTable buildBounds(const ValueLevels& levels, const TransferFunction& transfer, int column);

/// Bounds of a channel whose column of the macrocells has levels of the extinction itself.
kernel::BoundTable boundsOfExtinction(const ValueLevels& levels, int column);

class MajorantGrid {
 public:
  /// Of the visible channels' tables, in the order of the channels, and the macrocells they belong to.
  /// `sums`: the channels' extinctions add up; else the largest hides the others. `apart`: kernels need to
  /// know of every cell which channels are active. What is as it was in `before`, if that is given, is not
  /// worked out again, and shared where nothing is new. The memory is of the budget, if there is one.
  MajorantGrid(std::shared_ptr<const MacrocellGrid> macrocells, std::vector<kernel::BoundTable> tables,
               bool sums, bool apart, const MajorantGrid* before = nullptr,
               const std::shared_ptr<MemoryBudget>& memory = nullptr);
  /// In how many cells the total was worked out.
  std::size_t cellsRebuilt() const { return cellsRebuilt_; }
  /// Valid while a copy of this lives.
  kernel::MajorantView view() const;

 private:
  struct Totals;
  struct Changes;
  Changes changesSince(const MajorantGrid& before, bool apart) const;
  std::size_t rebuild(const Changes& changes, Totals& totals) const;
  float totalOf(const kernel::LevelInterval* intervals) const;
  std::uint32_t activeOf(const kernel::LevelInterval* intervals) const;

  std::shared_ptr<const MacrocellGrid> macrocells_;
  std::shared_ptr<const std::vector<kernel::BoundTable>> tables_;
  bool sums_;
  std::shared_ptr<const Totals> totals_;
  std::size_t cellsRebuilt_ = 0;

  /// Of so many channels all are looked at where one may be something, if that gives the same picture.
  static constexpr std::size_t kFewColumns = 4;
};

}  // namespace scolopax
