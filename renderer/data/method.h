// SPDX-License-Identifier: Apache-2.0
// The lists that the schema's enums, --help, /capabilities and the page's menus are filled from.
#pragma once
#include <cstddef>
#include <span>
#include <string_view>

namespace scolopax {

/// One line per entry: C++ name, wire name, what it is. Adding a tracker or blend mode is a line here and a
/// struct in renderer/kernel; the instantiations expand these lists.
#define SCOLOPAX_BLEND_MODES(X)                                                                             \
  X(density, "density", "extinctions add up; a collision shows the one channel it happened in (Eq. 6-7)")   \
  X(max, "max", "at every point the channel of the largest extinction hides the others (Eq. 8-9)")          \
  X(mix, "mix", "extinction as max; colours of all channels weighted by extinction and weight (Eq. 8, 10)") \
  X(composite, "composite",                                                                                 \
    "every channel rendered alone, the pictures added: depth between channels is lost (4.2)")

#define SCOLOPAX_METHODS(X)                                                                                  \
  X(superposed, "superposed",                                                                                \
    "one Poisson process over all channels; a drawn channel is fetched and tested; unbiased")                \
  X(cumulative, "cumulative",                                                                                \
    "one Poisson process over all channels; all are fetched and tested (5.1); unbiased")                     \
  X(syncDda, "sync-dda", "one traversal, every channel tracked inside each macrocell (Listing 4); unbiased") \
  X(nDda, "n-dda",                                                                                           \
    "a traversal for every channel, the nearest collision wins (Listing 3, mended); unbiased")               \
  X(raymarch, "raymarch", "equal steps along the ray, no noise but that of the jitter; biased by the step")

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

#define SCOLOPAX_AOVS(X)                                                                           \
  X(depth, "depth", "mean distance of the first collision from the eye, along the view direction") \
  X(transmittance, "transmittance", "share of the light from behind that comes through")           \
  X(channel, "channel", "channel in which most rays end")                                          \
  X(cost, "cost", "voxel lookups per sample: what a pixel costs")

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
SCOLOPAX_DECLARE_ENUM(Aov, SCOLOPAX_AOVS, kAovs)

#undef SCOLOPAX_ENUM_ENTRY
#undef SCOLOPAX_NAMED_ENTRY

}  // namespace scolopax
