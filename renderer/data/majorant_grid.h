// SPDX-License-Identifier: Apache-2.0
// Upper bounds of the extinction per macrocell, kept up to date edit by edit: an edit of a channel's curve
// costs a new table of that channel, and the totals of those cells whose values it changes.
#pragma once
#include <memory>
#include <vector>

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
  /// Takes over the visible channels' tables, in the order of the channels, and the macrocells they belong
  /// to. `sums`: the channels' extinctions add up; else the largest hides the others. `apart`: kernels need
  /// to know of every cell which channels are active. Returns in how many cells the total was worked out
  /// again. Nothing has changed when this throws.
  std::size_t update(std::shared_ptr<const MacrocellGrid> macrocells, std::vector<kernel::BoundTable> tables,
                     bool sums, bool apart = false);
  /// Memory that it takes for these macrocells, without theirs.
  static std::size_t sizeBytes(const MacrocellGrid& macrocells);
  /// Valid until the next update.
  kernel::MajorantView view() const;

 private:
  float totalOf(const kernel::LevelInterval* intervals) const;
  std::uint32_t activeOf(const kernel::LevelInterval* intervals) const;
  void measureFilled(glm::ivec3 blocks);
  std::shared_ptr<const MacrocellGrid> macrocells_;
  std::vector<kernel::BoundTable> tables_;
  bool sums_ = true;
  std::vector<kernel::TotalCode> totals_;
  std::vector<std::uint8_t> radii_;  // per block
  std::vector<std::uint32_t> active_;
  glm::ivec3 filledLow_{0}, filledHigh_{0};

  /// Of so many channels all are looked at where one may be something, if that gives the same picture.
  static constexpr std::size_t kFewColumns = 4;
};

}  // namespace scolopax
