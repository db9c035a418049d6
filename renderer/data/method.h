// SPDX-License-Identifier: Apache-2.0
// The lists from which the schema's enums, --help, /capabilities and the page's menus are filled.
#pragma once
#include <cstddef>
#include <span>
#include <string_view>

namespace scolopax {

/// One line per entry: C++ name, wire name, description. To add a tracker or blend mode, add a line here, a
/// struct in renderer/kernel, and its cases in data/instances.h. A tracker is compiled in files of its own:
/// cpu/kernels_*.cpp and those that cuda/kernels.cmake lists.
#define SCOLOPAX_BLEND_MODES(X) /* Eq. 6-7; Eq. 8-9; Eq. 8 and 10; section 4.2 */                          \
  X(density, "density",                                                                                    \
    "all channels share the space: each is seen through the others, and where they overlap their colours " \
    "mix")                                                                                                 \
  X(max, "max", "at every point only the channel that is densest there is seen; it hides the others")      \
  X(mix, "mix",                                                                                            \
    "as dense as the densest channel; the colours of all are mixed, by their density and weight")          \
  X(composite, "composite",                                                                                \
    "every channel is drawn by itself and the pictures are added: depth order between channels is lost")

#define SCOLOPAX_METHODS(X) /* Listings 3 (n-dda, mended) and 4 (sync-dda); section 5.1 (cumulative) */      \
  X(automatic, "auto",                                                                                       \
    "raymarch (hybrid for shadows) at a coarse step, corrected by pictures at ever finer steps, so that no " \
    "bias stays; superposed where that would take longer")                                                   \
  X(superposed, "superposed", "tracks all channels at once and samples one of them per step; unbiased")      \
  X(cumulative, "cumulative", "tracks all channels at once and samples all of them per step; unbiased")      \
  X(syncDda, "sync-dda", "tracks one channel after the other inside each macrocell; unbiased")               \
  X(nDda, "n-dda", "tracks every channel separately, and the nearest hit wins; unbiased")                    \
  X(raymarch, "raymarch", "equal steps along the ray: little noise, and a bias that falls with the step")    \
  X(hybrid, "hybrid",                                                                                        \
    "as raymarch, with light computed at eight points of a ray: faster and noisier where light is costly")

#define SCOLOPAX_LIGHT_TYPES(X)                                                   \
  X(directional, "directional", "parallel rays that travel along `direction`")    \
  X(point, "point", "shines from `position` in all directions, without fall-off") \
  X(headlight, "headlight", "shines from the eye")

#define SCOLOPAX_PIXEL_FILTERS(X)                              \
  X(box, "box", "samples spread evenly over the pixel's area") \
  X(point, "point", "every sample at the pixel's centre")

#define SCOLOPAX_SAMPLINGS(X)                                                                        \
  X(lowDiscrepancy, "low-discrepancy",                                                               \
    "the first numbers of a pixel's samples are spread evenly (scrambled Sobol points): less noise") \
  X(independent, "independent", "every number is drawn on its own, as textbook error estimates assume")

#define SCOLOPAX_PEAKS(X)                                                     \
  X(off, "off", "the opacity curve is drawn, and nothing else")               \
  X(both, "both", "surfaces at the curve's peaks are drawn beside the curve") \
  X(only, "only", "surfaces at the curve's peaks are drawn instead of the curve")

#define SCOLOPAX_INTERPOLATIONS(X)                                                             \
  X(trilinear, "trilinear", "linear along every axis between the eight voxels around a point") \
  X(cubic, "cubic", "smoothed by the cubic B-spline over the 64 voxels around a point")        \
  X(nearest, "nearest", "the value of the nearest voxel: for labels, and to see the voxels themselves")

#define SCOLOPAX_AOVS(X)                                                                           \
  X(depth, "depth", "mean distance of the first collision from the eye, along the view direction") \
  X(transmittance, "transmittance", "share of the light from behind that comes through")           \
  X(channel, "channel", "channel in which most rays end")                                          \
  X(cost, "cost", "voxel fetches per sample: what a pixel costs")

struct NamedValue {
  std::string_view name;
  std::string_view doc;
};

#define SCOLOPAX_DECLARE_ENUM(Type, LIST, listName)                      \
  enum class Type { LIST(SCOLOPAX_ENUM_ENTRY) };                         \
  inline constexpr NamedValue listName[] = {LIST(SCOLOPAX_NAMED_ENTRY)}; \
  constexpr std::string_view nameOf(Type value) { return listName[std::size_t(value)].name; }
#define SCOLOPAX_ENUM_ENTRY(name, wire, doc) name,
#define SCOLOPAX_NAMED_ENTRY(name, wire, doc) {wire, doc},

SCOLOPAX_DECLARE_ENUM(BlendMode, SCOLOPAX_BLEND_MODES, kBlendModes)
SCOLOPAX_DECLARE_ENUM(Method, SCOLOPAX_METHODS, kMethods)
SCOLOPAX_DECLARE_ENUM(LightType, SCOLOPAX_LIGHT_TYPES, kLightTypes)
SCOLOPAX_DECLARE_ENUM(PixelFilter, SCOLOPAX_PIXEL_FILTERS, kPixelFilters)
SCOLOPAX_DECLARE_ENUM(Sampling, SCOLOPAX_SAMPLINGS, kSamplings)
SCOLOPAX_DECLARE_ENUM(Peaks, SCOLOPAX_PEAKS, kPeaks)
SCOLOPAX_DECLARE_ENUM(Interpolation, SCOLOPAX_INTERPOLATIONS, kInterpolations)
SCOLOPAX_DECLARE_ENUM(Aov, SCOLOPAX_AOVS, kAovs)

/// Whether a method has a step, and a bias that falls with it.
constexpr bool hasStep(Method method) { return method == Method::raymarch || method == Method::hybrid; }

#undef SCOLOPAX_ENUM_ENTRY
#undef SCOLOPAX_NAMED_ENTRY

}  // namespace scolopax
