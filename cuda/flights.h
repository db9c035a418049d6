// SPDX-License-Identifier: Apache-2.0
// The rows of a pass that are left to render, and the bands of rows that devices are rendering.
#pragma once
#include <cstddef>
#include <deque>
#include <memory>
#include <optional>

#include "cuda/device.h"

namespace scolopax::cuda {

/// Neighbouring rows.
struct RowRun {
  int first, count;
};

/// The rows of a pass that are not done, as runs of neighbouring rows. A row that is done in part is rendered
/// again: it comes out the same.
class RowsLeft {
 public:
  explicit RowsLeft(const Pass& pass) : pass_(pass) {}
  /// The next run, of at most `most` rows.
  std::optional<RowRun> next(int most);

 private:
  bool done(int row) const;

  const Pass& pass_;
  int row_ = 0;
};

/// Bands under way; gives them back, or releases them if they have not been finished.
class Flights {
 public:
  explicit Flights(const Pass& pass) : pass_(pass) {}
  Flights(const Flights&) = delete;
  Flights& operator=(const Flights&) = delete;
  ~Flights();

  bool empty() const { return flights_.empty(); }
  std::size_t on(const Device& device) const;
  /// A band of the device, which must be the current one; null if there is no memory for one more.
  std::unique_ptr<Band> take(Device& device) const;
  /// `scene`: the pass's view in memory of the device.
  void begin(Device& device, std::unique_ptr<Band> band, const kernel::SceneView& scene, RowRun rows);
  /// Waits for the oldest band. Returns false if its rows are not done, because the pass was cancelled.
  bool finishOldest();

 private:
  struct Flight {
    Device& device;
    std::unique_ptr<Band> band;
  };
  const Pass& pass_;
  std::deque<Flight> flights_;
};

}  // namespace scolopax::cuda
