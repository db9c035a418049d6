// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/dicom_series.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <set>
#include <tuple>

#include "renderer/core/error.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace {

/// Frames that may make up one volume.
struct DicomGroup {
  std::size_t file = 0, frame = 0;  ///< the first one
  std::vector<DicomSlice> slices = {};
};

bool isPlacedFrame(const DicomFrame& frame) { return frame.position && frame.axes; }

bool sameDicomAxes(const DicomFrame& a, const DicomFrame& b) {
  constexpr double kTolerance = 1e-3;
  if (isPlacedFrame(a) != isPlacedFrame(b) || a.spacing.has_value() != b.spacing.has_value()) return false;
  if (isPlacedFrame(a))
    for (std::size_t i = 0; i < 2; ++i)
      if (glm::length((*a.axes)[i] - (*b.axes)[i]) > kTolerance) return false;
  return !a.spacing || glm::length(*a.spacing - *b.spacing) <= kTolerance * glm::length(*a.spacing);
}

/// Whether frames belong to one volume. Those of several files do not if they have no place, or are labels.
bool belongTogetherInDicom(const std::vector<DicomFile>& files, const DicomGroup& group,
                           std::size_t fileIndex, std::size_t frameIndex) {
  const DicomFile &a = files[group.file], &b = files[fileIndex];
  const DicomFrame &first = a.frames[group.frame], &frame = b.frames[frameIndex];
  const bool alone = !a.segments.empty() || !b.segments.empty() ||
                     (!isPlacedFrame(first) && (a.frames.size() > 1 || b.frames.size() > 1));
  if (alone && group.file != fileIndex) return false;
  return a.seriesUid == b.seriesUid && a.columns == b.columns && a.rows == b.rows && a.samples == b.samples &&
         a.unit == b.unit && sameDicomAxes(first, frame);
}

std::vector<DicomGroup> groupDicomFrames(const std::vector<DicomFile>& files, const std::string& name) {
  constexpr std::size_t kMostGroups = 1000;
  std::vector<DicomGroup> groups;
  std::size_t last = 0;  // most frames belong where the one before does
  for (std::size_t file = 0; file < files.size(); ++file)
    for (std::size_t frame = 0; frame < files[file].frames.size(); ++frame) {
      const auto belongs = [&](const DicomGroup& group) {
        return belongTogetherInDicom(files, group, file, frame);
      };
      if (groups.empty() || !belongs(groups[last]))
        last = std::size_t(std::ranges::find_if(groups, belongs) - groups.begin());
      if (last == groups.size()) groups.push_back({file, frame});
      if (groups.size() > kMostGroups)
        throw Error(ErrorCode::unsupported,
                    name + ": expected at most " + std::to_string(kMostGroups) + " series, found more");
      groups[last].slices.push_back({file, frame});
    }
  return groups;
}

/// One group while its grid is sought.
class DicomStack {
 public:
  DicomStack(const std::vector<DicomFile>& files, const DicomGroup& group, std::string name, const Warn& warn)
      : files_(files), file_(files[group.file]), slices_(group.slices), name_(std::move(name)), warn_(warn) {}
  DicomSeries arrange();

 private:
  const DicomFrame& frameOf(const DicomSlice& slice) const { return files_[slice.file].frames[slice.frame]; }
  /// What orders slices at one position.
  auto orderOf(const DicomSlice& slice) const {
    return std::tuple(frameOf(slice).time, files_[slice.file].instance, slice.file, slice.frame);
  }
  void placeByNumber();
  void placeByPosition();
  void setTimes(std::size_t positions);
  void setSegments();
  void dropDoubled();
  glm::dvec3 stepOf(std::vector<glm::dvec3> positions, const glm::dvec3& normal);
  glm::dvec3 sparseStep(const std::vector<glm::dvec3>& positions, const glm::dvec3& normal);
  double sliceDistance(const DicomFrame& frame) const {
    return frame.sliceSpacing.value_or(frame.thickness.value_or(1));
  }
  void describeChannels(DicomSeries& series) const;
  Times times() const;

  const std::vector<DicomFile>& files_;
  const DicomFile& file_;
  std::vector<DicomSlice> slices_;
  std::string name_;
  const Warn& warn_;
  std::size_t depth_ = 1, times_ = 1;
  Grid grid_;
};

/// Slices without positions lie in the order of their numbers.
void DicomStack::placeByNumber() {
  const DicomFrame& first = frameOf(slices_[0]);
  std::ranges::sort(slices_, {}, [&](const DicomSlice& slice) { return orderOf(slice); });
  depth_ = file_.framesAreTimes ? 1 : slices_.size();
  times_ = file_.framesAreTimes ? slices_.size() : 1;
  for (std::size_t i = 0; i < slices_.size(); ++i)
    (file_.framesAreTimes ? slices_[i].time : slices_[i].z) = i;
  if (depth_ > 1 && files_.size() > 1)
    warn_(name_ + ": the slices have no positions, they are in the order of their numbers");
  checkedDims(name_ + ": slices", file_.columns, file_.rows, std::int64_t(depth_));
  grid_ = dicomGrid(file_, first, depth_, glm::dvec3(0, 0, sliceDistance(first)));
}

/// As many slices at every position are times; otherwise all but the first are left out.
void DicomStack::setTimes(std::size_t positions) {
  std::vector<std::size_t> counts(positions);
  for (DicomSlice& slice : slices_) slice.time = counts[slice.z]++;
  times_ = std::ranges::min(counts);
  if (std::ranges::max(counts) != times_) times_ = 1;
  const std::size_t doubled =
      std::erase_if(slices_, [&](const DicomSlice& slice) { return slice.time >= times_; });
  if (doubled > 0)
    warn_(name_ + ": " + std::to_string(doubled) +
          (doubled == 1 ? " slice lies where another does and is left out"
                        : " slices lie where others do and are left out"));
  if (times_ > 1)
    warn_(name_ + ": " + std::to_string(times_) + " slices at every position are taken as times");
}

/// Slices of different segments lie at the same positions.
void DicomStack::setSegments() {
  for (DicomSlice& slice : slices_) slice.channel = frameOf(slice).segment;
  const auto key = [](const DicomSlice& slice) { return std::tuple(slice.channel, slice.z); };
  std::ranges::stable_sort(slices_, {}, key);
  const auto same = [&](const DicomSlice& a, const DicomSlice& b) { return key(a) == key(b); };
  const auto doubled = std::unique(slices_.begin(), slices_.end(), same);
  if (doubled != slices_.end()) warn_(name_ + ": slices lie where others do and are left out");
  slices_.erase(doubled, slices_.end());
}

/// Segmentations leave out slices that are empty. Moves slices to their places among all.
glm::dvec3 DicomStack::sparseStep(const std::vector<glm::dvec3>& positions, const glm::dvec3& normal) {
  constexpr double kTolerance = 0.05, kMostSlices = 1 << 20;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < positions.size(); ++i)
    smallest = std::min(smallest, glm::dot(positions[i] - positions[i - 1], normal));
  const double stated = frameOf(slices_[0]).sliceSpacing.value_or(smallest);
  const double distance = std::abs(smallest - stated) < kTolerance * stated ? smallest : stated;
  std::vector<std::size_t> places;
  for (const glm::dvec3& position : positions) {
    const double place = glm::dot(position - positions[0], normal) / distance;
    const bool isLater = places.empty() || std::round(place) > double(places.back());
    if (std::abs(place - std::round(place)) > kTolerance || place > kMostSlices || !isLater)
      return evenStep(positions, normal, name_, warn_);  // which tells why not
    places.push_back(std::size_t(std::llround(place)));
  }
  for (DicomSlice& slice : slices_) slice.z = places[slice.z];
  depth_ = places.back() + 1;
  return (positions.back() - positions.front()) / double(places.back());
}

glm::dvec3 DicomStack::stepOf(std::vector<glm::dvec3> positions, const glm::dvec3& normal) {
  if (positions.size() == 1) return normal * sliceDistance(frameOf(slices_[0]));
  return file_.segments.empty() ? evenStep(positions, normal, name_, warn_) : sparseStep(positions, normal);
}

void DicomStack::placeByPosition() {
  const auto axes = *frameOf(slices_[0]).axes;
  const glm::dvec3 normal = glm::normalize(glm::cross(axes[0], axes[1]));
  const auto distance = [&](const DicomSlice& slice) { return glm::dot(*frameOf(slice).position, normal); };
  std::ranges::sort(slices_, {}, distance);
  // Positions closer than this are the same one, written by different roundings.
  const double same = 0.01 * std::min(1.0, frameOf(slices_[0]).spacing.value_or(glm::dvec2(1)).x);
  std::vector<glm::dvec3> positions;
  double last = 0;
  for (DicomSlice& slice : slices_) {
    if (positions.empty() || distance(slice) - last > same) {
      positions.push_back(*frameOf(slice).position);
      last = distance(slice);
    }
    slice.z = positions.size() - 1;
  }
  std::ranges::sort(slices_, {}, [&](const DicomSlice& slice) {
    return std::tuple_cat(std::tuple(slice.z), orderOf(slice));
  });
  depth_ = positions.size();
  if (file_.segments.empty())
    setTimes(depth_);
  else
    setSegments();
  const DicomFrame& first = frameOf(*std::ranges::min_element(slices_, {}, &DicomSlice::z));
  const glm::dvec3 step = stepOf(std::move(positions), normal);
  checkedDims(name_ + ": slices", file_.columns, file_.rows, std::int64_t(depth_));
  grid_ = dicomGrid(file_, first, depth_, step);
}

/// The words for samples and segments; type, scale and look of the slices.
void DicomStack::describeChannels(DicomSeries& series) const {
  const DicomSlice& middle = slices_[slices_.size() / 2];
  const DicomFrame& first = frameOf(slices_[0]);
  series.rescaled = std::ranges::any_of(slices_, [&](const DicomSlice& slice) {
    const DicomFrame& frame = frameOf(slice);
    return frame.slope != first.slope || frame.intercept != first.intercept ||
           files_[slice.file].type != file_.type;
  });
  ChannelInfo channel{.unit = file_.unit, .type = file_.type};
  if (series.rescaled) channel.type = StoredType::f32;
  if (!series.rescaled) channel.slope = first.slope, channel.intercept = first.intercept;
  channel.look.labels = file_.labels;
  if (file_.samples == 1 && !file_.labels) channel.look.window = frameOf(middle).window;
  static constexpr std::array kColors{"red", "green", "blue"};
  const std::string before = file_.description.empty() ? "" : file_.description + " ";
  const std::size_t count = file_.segments.empty() ? file_.samples : file_.segments.size();
  for (std::size_t i = 0; i < count; ++i) {
    channel.name = file_.description;
    if (!file_.segments.empty()) {
      channel.name = file_.segments[i].name;
      if (channel.name.empty()) channel.name = "segment " + std::to_string(file_.segments[i].number);
    } else if (count > 1) {
      channel.name = before + kColors[i];
    }
    series.info.channels.push_back(channel);
  }
}

Times DicomStack::times() const {
  Times times{.count = times_};
  if (times_ == 1 || !file_.framesAreTimes || file_.frameTimeMs <= 0) return times;
  for (std::size_t i = 0; i < times_; ++i) times.values.push_back(double(i) * file_.frameTimeMs / 1000);
  times.unit = "s";
  return times;
}

DicomSeries DicomStack::arrange() {
  if (isPlacedFrame(frameOf(slices_[0])))
    placeByPosition();
  else
    placeByNumber();
  DicomSeries series;
  series.sparse = !file_.segments.empty();
  series.info.levels = {grid_};
  series.info.times = times();
  const bool known = frameOf(slices_[0]).spacing.has_value();
  if (known) series.info.worldUnit = "mm";
  if (!known) warn_(name_ + ": PixelSpacing: is missing, taken as 1");
  describeChannels(series);
  std::ranges::sort(slices_, {}, [](const DicomSlice& slice) { return std::tuple(slice.file, slice.frame); });
  series.slices = std::move(slices_);
  return series;
}

/// Number and description of the series, without the "/" that separates parts of a path.
std::string dicomSeriesPath(const DicomFile& file, std::set<std::string>& taken) {
  std::string path = file.seriesNumber;
  if (!file.description.empty()) path += (path.empty() ? "" : " ") + file.description;
  if (path.empty()) path = "series";
  std::ranges::replace(path, '/', '_');
  std::string unique = path;
  for (int i = 2; !taken.insert(unique).second; ++i) unique = path + " (" + std::to_string(i) + ")";
  return unique;
}

}  // namespace

std::vector<DicomSeries> arrangeDicom(const std::vector<DicomFile>& files, const std::string& name,
                                      const Warn& warn) {
  const std::vector<DicomGroup> groups = groupDicomFrames(files, name);
  std::vector<DicomSeries> series;
  std::vector<Error> errors;
  std::set<std::string> taken;
  for (const DicomGroup& group : groups) {
    const std::string path = groups.size() == 1 ? "" : dicomSeriesPath(files[group.file], taken);
    const std::string where = path.empty() ? name : name + ": " + inQuotes(path);
    try {
      series.push_back(DicomStack(files, group, where, warn).arrange());
      series.back().info.path = path;
    } catch (const Error& error) {
      errors.push_back(error);
    }
  }
  if (series.empty() && !errors.empty()) throw errors[0];
  for (const Error& error : errors) warn(error.what());
  return series;
}

}  // namespace scolopax::io
