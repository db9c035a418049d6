// SPDX-License-Identifier: Apache-2.0
// Measures the cost of macrocells and majorants: memory compared with the paper's Table 1, and the time of an
// edit compared with the paper's scan. bench_rebuild [--json] [EDGE, 256 voxels by default]
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "renderer/data/majorant_grid.h"
#include "renderer/generate/orbitals.h"

namespace scolopax {
namespace {

/// Median of several runs, ms.
template <class F>
double milliseconds(F&& run) {
  std::vector<double> times;
  for (int i = 0; i < 9; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::nth_element(times.begin(), times.begin() + 4, times.end());
  return times[4];
}

/// One hydrogen state as voxels of type T; the largest value is 1 (float) or the largest T.
template <class T>
std::shared_ptr<const Volume> orbital(int edge) {
  GeneratedVolume made = generateOrbitals(edge, 1);
  const auto from = made.channels[0].voxels.as<std::uint16_t>();
  ChannelSource source;
  source.voxels = VoxelBuffer(scalarTypeOf<T>, from.size());
  const auto to = source.voxels.as<T>();
  for (std::size_t i = 0; i < from.size(); ++i)
    to[i] = sizeof(T) == 1 ? T(from[i] >> 8) : sizeof(T) == 2 ? T(from[i]) : T(float(from[i]) / 65535);
  std::vector<ChannelSource> sources;
  sources.push_back(std::move(source));
  return std::make_shared<const Volume>(made.grid, std::move(sources));
}

/// The paper's macrocells and majorants (section 4.3): two floats and one float per cell. The majorant of a
/// cell is the largest entry of the transfer function, a table of 256, from the entry of the cell's least
/// value to that of its largest.
struct Paper {
  static constexpr int kEntries = 256;
  std::vector<ValueInterval> intervals;
  std::vector<float> majorants;
  double largest;

  Paper(const MacrocellGrid& cells, double largestValue)
      : majorants(cells.cellCount()), largest(largestValue) {
    for (std::size_t cell = 0; cell < cells.cellCount(); ++cell) intervals.push_back(cells.interval(cell, 0));
  }
  void scan(const std::vector<float>& table) {
    const float scale = float((kEntries - 1) / largest);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, intervals.size(), 4096), [&](const auto& range) {
      for (std::size_t cell = range.begin(); cell < range.end(); ++cell) {
        const int lo = std::clamp(int(intervals[cell].lo * scale), 0, kEntries - 1);
        const int hi = std::clamp(int(std::ceil(intervals[cell].hi * scale)), 0, kEntries - 1);
        float most = 0;
        for (int i = lo; i <= hi; ++i) most = std::max(most, table[std::size_t(i)]);
        majorants[cell] = most;
      }
    });
  }
};

ChannelAppearance ramp(double largest, double bump) {
  ChannelAppearance a;
  a.rangeHi = largest;
  a.opacity = {{0, 0}, {0.30, 0.3}, {0.32, bump}, {0.34, 0.34}, {1, 1}};
  return a;
}

template <class T>
void measure(const char* type, int edge, bool json, bool* first) {
  const auto volume = orbital<T>(edge);
  const Channel& channel = volume->channels()[0];
  const double largest = channel.histogram.maximum;
  for (const int size : {1, 2, 4, 8, 16, 32}) {
    std::shared_ptr<const MacrocellGrid> cells;
    const double measureMs =
        milliseconds([&] { cells = std::make_shared<const MacrocellGrid>(buildMacrocells(*volume, size)); });
    // Intervals of cells and blocks, totals, and the blocks' radii.
    const double bytes =
        double((cells->intervals.size() + cells->blocks.size()) * sizeof(kernel::LevelInterval) +
               cells->cellCount() * sizeof(kernel::TotalCode) + cells->blocks.size());

    Paper paper(*cells, largest);
    std::vector<float> table(Paper::kEntries);
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = float(i) / 255;
    const double scanMs = milliseconds([&] { paper.scan(table); });

    // Each edit also rebuilds the transfer function, as in the program.
    const auto boundsOf = [&](const ChannelAppearance& a) {
      return std::vector<kernel::BoundTable>{buildBounds(cells->levels[0], TransferFunction(channel, a), 0)};
    };
    bool flip = false;
    MajorantGrid majorants(cells, boundsOf(ramp(largest, 0.32)), true, false);
    const auto edit = [&](const ChannelAppearance& a, bool sums) {
      majorants = MajorantGrid(cells, boundsOf(a), sums, false, &majorants);
      return majorants.cellsRebuilt();
    };
    const double fullMs = milliseconds([&] {  // every cell: alternates between sums and maxima
      edit(ramp(largest, 0.32), flip);
      flip = !flip;
    });
    edit(ramp(largest, 0.32), true);
    std::size_t narrowCells = 0, wideCells = 0;
    const double narrowMs = milliseconds([&] {  // moves a knot in the middle: values from 30 % to 34 % change
      narrowCells = edit(ramp(largest, flip ? 0.9 : 0.5), true);
      flip = !flip;
    });
    const double wideMs = milliseconds([&] {  // changes the whole ramp
      ChannelAppearance a = ramp(largest, 0.32);
      a.density = flip ? 1 : 2;
      wideCells = edit(a, true);
      flip = !flip;
    });
    const double data = double(channel.voxels.count() * sizeBytes(channel.voxels.type())),
                 count = double(cells->cellCount());
    if (json)
      std::printf(
          "%s  {\"type\": \"%s\", \"edge\": %d, \"macrocell\": %d, \"cells\": %zu, \"bytesPerCell\": %.3f, "
          "\"percentOfData\": %.4f, \"paperPercentOfData\": %.4f, \"measureMs\": %.4f, \"paperScanMs\": "
          "%.4f, "
          "\"fullMs\": %.4f, \"curveMs\": %.4f, \"curveCells\": %zu, \"narrowMs\": %.4f, \"narrowCells\": "
          "%zu, "
          "\"curveSpeedup\": %.2f, \"narrowSpeedup\": %.2f}",
          *first ? "" : ",\n", type, edge, size, cells->cellCount(), bytes / count, 100 * bytes / data,
          100 * 12 * count / data, measureMs, scanMs, fullMs, wideMs, wideCells, narrowMs, narrowCells,
          scanMs / wideMs, scanMs / narrowMs);
    else
      std::printf("%-4s %5d %9zu %6.2f %8.3f %8.3f %9.2f %9.3f %8.3f %8.3f %8.3f %9zu %7.1fx %7.1fx\n", type,
                  size, cells->cellCount(), bytes / count, 100 * bytes / data, 100 * 12 * count / data,
                  measureMs, scanMs, fullMs, wideMs, narrowMs, narrowCells, scanMs / wideMs,
                  scanMs / narrowMs);
    *first = false;
  }
}

}  // namespace
}  // namespace scolopax

int main(int argc, char** argv) {
  bool json = false, first = true;
  int edge = 256;
  for (int i = 1; i < argc; ++i)
    if (std::strcmp(argv[i], "--json") == 0)
      json = true;
    else
      edge = std::max(2, std::atoi(argv[i]));
  if (json)
    std::printf("[\n");
  else
    std::printf(
        "One channel of %d^3 voxels. B: bytes a cell, and their share of the data beside the paper's 12 "
        "bytes;\n"
        "ms: of measuring macrocells, of the paper's scan, of working out all cells, of an edit of the "
        "whole\n"
        "curve, and of an edit that changes values from 30 %% to 34 %% (cells); scan / edit, scan / narrow "
        "edit\n"
        "type  size     cells      B   %% ours  %% paper   measure      scan      all    curve   narrow     "
        "cells\n",
        edge);
  scolopax::measure<std::uint8_t>("u8", edge, json, &first);
  scolopax::measure<std::uint16_t>("u16", edge, json, &first);
  scolopax::measure<float>("f32", edge, json, &first);
  if (json) std::printf("\n]\n");
}
