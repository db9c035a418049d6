// SPDX-License-Identifier: Apache-2.0
#include "cuda/flights.h"

#include <algorithm>

#include "renderer/core/error.h"

namespace scolopax::cuda {

std::optional<RowRun> RowsLeft::next(int most) {
  while (row_ < pass_.scene.height && done(row_)) ++row_;
  const int first = row_;
  while (row_ < pass_.scene.height && row_ - first < most && !done(row_)) ++row_;
  if (row_ == first) return std::nullopt;
  return RowRun{.first = first, .count = row_ - first};
}

bool RowsLeft::done(int row) const {
  const auto width = std::size_t(pass_.scene.width);
  const std::uint8_t* begin = pass_.done + std::size_t(row) * width;
  return std::find(begin, begin + width, std::uint8_t(0)) == begin + width;
}

Flights::~Flights() {
  for (Flight& flight : flights_) {
    flight.device.tryToUse();
    flight.band.reset();
  }
}

std::size_t Flights::on(const Device& device) const {
  return std::size_t(std::count_if(flights_.begin(), flights_.end(),
                                   [&](const Flight& flight) { return &flight.device == &device; }));
}

std::unique_ptr<Band> Flights::take(Device& device) const {
  try {
    auto band = device.takeBand();
    band->prepare(pass_.cost, pass_.first);
    return band;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::tooLarge || on(device) == 0) throw;
    return nullptr;
  }
}

void Flights::begin(Device& device, std::unique_ptr<Band> band, const kernel::SceneView& scene, RowRun rows) {
  flights_.push_back({device, std::move(band)});
  flights_.back().band->start(pass_, scene, rows.first, rows.count);
}

bool Flights::finishOldest() {
  Flight& flight = flights_.front();
  flight.device.use();
  const bool done = flight.band->finish(pass_);
  if (done)
    flight.device.tookMs(flight.band->kernelMs(),
                         std::size_t(flight.band->rows()) * std::size_t(pass_.scene.width));
  flight.device.giveBack(std::move(flight.band));
  flights_.pop_front();
  return done;
}

}  // namespace scolopax::cuda
