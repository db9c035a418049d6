// SPDX-License-Identifier: Apache-2.0
// The scenes on which every method is compared with the reference, in any blend mode and light, and the
// combinations of these that `make test` uses.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "renderer/generate/orbitals.h"
#include "renderer/io/datasets.h"
#include "tests/support/figure_3.h"

namespace scolopax::test {

struct LightConfiguration {
  const char* name;
  bool shading, shadows;
};
inline constexpr LightConfiguration kLightConfigurations[] = {
    {"unlit", false, false}, {"shading", true, false}, {"shadows", false, true}, {"both", true, true}};

enum class TestScene { figure3, orbitals, noise, lumps, tcga, stroke, filters };
inline constexpr TestScene kTestScenes[] = {TestScene::figure3, TestScene::orbitals, TestScene::noise,
                                            TestScene::lumps,   TestScene::tcga,     TestScene::stroke,
                                            TestScene::filters};
inline constexpr const char* kTestSceneNames[] = {"Figure3", "Orbitals", "Noise",  "Lumps",
                                                  "Tcga",    "Stroke",   "Filters"};

struct Setting {
  int scene, blend, light;  ///< indices into the three lists
};
/// The smallest set of settings that covers every pair of scene, blend mode and light: a Latin square.
inline std::vector<Setting> pairwiseSettings() {
  std::vector<Setting> settings;
  for (int scene = 0; scene < int(std::size(kTestScenes)); ++scene)
    for (int blend = 0; blend < int(std::size(kBlends)); ++blend)
      settings.push_back({scene, blend, (scene + blend) % int(std::size(kLightConfigurations))});
  return settings;
}
inline std::vector<Setting> allSettings() {
  std::vector<Setting> settings;
  for (int scene = 0; scene < int(std::size(kTestScenes)); ++scene)
    for (int blend = 0; blend < int(std::size(kBlends)); ++blend)
      for (int light = 0; light < int(std::size(kLightConfigurations)); ++light)
        settings.push_back({scene, blend, light});
  return settings;
}

struct VolumeAndScene {
  std::shared_ptr<const Volume> volume;
  Scene scene;  ///< unlit, density; has lights and materials, which take effect once light is switched on
};

/// Gives the scene different materials and weights, and a directional and a point light of different colours.
inline void furnish(const Grid& grid, Scene& scene) {
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    ChannelAppearance& a = scene.channels[i];
    const double k = double(i);
    a.weight = 1 - 0.25 * k;
    a.material = {0.2 + 0.15 * k, 0.7 - 0.1 * k, 0.1 + 0.1 * k, 4 + 6 * k};
  }
  const glm::dvec3 centre(grid.worldFromVoxel * glm::dvec4(glm::dvec3(grid.dims - 1) * 0.5, 1));
  scene.lights = {
      {LightType::directional, {0.4, -0.7, -0.6}, {1, 0.9, 0.8}, 0.9},
      {LightType::point, centre + grid.diagonal() * glm::dvec3(0.5, 0.6, -0.5), {0.3, 0.5, 1}, 0.5}};
}

/// A scene with channels in red, green, blue and white, framed by the camera.
inline Scene framed(const Volume& volume, int side) {
  Scene scene;
  scene.width = scene.height = side;
  scene.filter = PixelFilter::point;  // where the reference needs one ray a pixel
  scene.camera = framingCamera(volume.grid(), 35, 1);
  scene.channels.resize(volume.channels().size());
  for (std::size_t i = 0; i < scene.channels.size(); ++i)
    scene.channels[i].color = {{0, glm::dvec3(i % 4 != 1 && i != 2, i % 4 != 0 && i != 2, i > 1)}};
  return scene;
}

/// The part of `dims` voxels that starts at voxel `lo`, with the same types, ranges and spacing.
inline std::shared_ptr<const Volume> cropped(const Volume& volume, glm::ivec3 lo, glm::ivec3 dims) {
  const glm::ivec3 whole = volume.grid().dims;
  Grid grid = volume.grid();
  grid.dims = dims;
  grid.worldFromVoxel[3] = grid.worldFromVoxel * glm::dvec4(glm::dvec3(lo), 1);
  std::vector<ChannelSource> sources;
  for (const Channel& channel : volume.channels()) {
    ChannelSource source{
        channel.name,  channel.unit,      VoxelBuffer(channel.voxels.type(), grid.voxelCount()),
        channel.slope, channel.intercept, channel.look};
    visitScalarType(channel.voxels.type(), [&](auto zero) {
      using T = decltype(zero);
      const auto from = channel.voxels.as<T>();
      auto to = source.voxels.as<T>().begin();
      for (int z = 0; z < dims.z; ++z)
        for (int y = 0; y < dims.y; ++y)
          for (int x = 0; x < dims.x; ++x)
            *to++ = from[(std::size_t(lo.z + z) * std::size_t(whole.y) + std::size_t(lo.y + y)) *
                             std::size_t(whole.x) +
                         std::size_t(lo.x + x)];
    });
    sources.push_back(std::move(source));
  }
  return std::make_shared<const Volume>(grid, std::move(sources));
}

/// A piece of a data set outside the repository; none if the data set is absent. `centre`: where the piece
/// lies, from 0 (at the first voxel) to 1 (at the last) per axis.
inline std::optional<VolumeAndScene> cutFrom(const std::vector<std::string>& files, glm::dvec3 centre) {
  std::vector<std::filesystem::path> paths;
  for (const std::string& file : files)
    paths.push_back(std::filesystem::path(SCOLOPAX_DATA_DIR) / "multichannel" / file);
  for (const auto& path : paths)
    if (!std::filesystem::exists(path)) return std::nullopt;
  const auto datasets = io::loadDatasets(paths, io::defaultMemoryLimitBytes(), [](const std::string&) {});
  if (datasets.size() != 1) return std::nullopt;
  const Volume& whole = *datasets[0].volume;
  const glm::ivec3 dims = glm::min(glm::ivec3(16, 15, 13), whole.grid().dims);
  const glm::ivec3 lo(glm::dvec3(whole.grid().dims - dims) * centre);
  const auto volume = cropped(whole, lo, dims);
  Scene scene = framed(*volume, 12);
  for (std::size_t i = 0; i < scene.channels.size(); ++i) {
    const Histogram& values = volume->channels()[i].histogram;
    scene.channels[i].rangeLo = values.minimum + 0.2 * (values.maximum - values.minimum);
    scene.channels[i].rangeHi = values.maximum;
    scene.channels[i].density = 3 / volume->grid().diagonal();
  }
  return VolumeAndScene{volume, scene};
}

/// A volume and its scene; none if the data set is absent.
inline std::optional<VolumeAndScene> testScene(TestScene which) {
  std::optional<VolumeAndScene> made;
  if (which == TestScene::figure3) {
    made = {Figure3::volume(), Figure3::scene()};
    made->scene.width = made->scene.height = 12;
    made->scene.macrocell = 1;  // tight bounds: a bound that is too low has an effect
    const std::vector<double> weights{1, 1, Figure3::blueWeight};
    furnish(made->volume->grid(), made->scene);
    for (std::size_t i = 0; i < 3; ++i) made->scene.channels[i].weight = weights[i];
    return made;
  }
  if (which == TestScene::orbitals) {
    GeneratedVolume generated = generateOrbitals(14, 4);
    made.emplace();
    made->volume = std::make_shared<const Volume>(generated.grid, std::move(generated.channels));
    made->scene = framed(*made->volume, 12);
    for (std::size_t i = 0; i < 4; ++i) {
      made->scene.channels[i].rangeHi = made->volume->channels()[i].histogram.maximum * 0.3;
      made->scene.channels[i].density = 0.12 + 0.02 * double(i);  // no two differ by rounding only
    }
  } else if (which == TestScene::noise || which == TestScene::filters) {
    const glm::ivec3 dims(8, 7, 6);
    std::uint32_t state = 9;
    const auto noise = [&](int, int, int) { return (state = state * 1664525u + 1013904223u) >> 24; };
    // One after the other: compilers evaluate arguments in different orders.
    auto third = channelOf<float>(dims, noise);
    auto second = channelOf<std::int16_t>(dims, noise, -2, 300);
    auto first = channelOf<std::uint8_t>(dims, noise);
    made.emplace();
    made->volume = volumeOf(gridOf(dims, {1, 2, 0.5}), std::move(first), std::move(second), std::move(third));
    made->scene = framed(*made->volume, 12);
    made->scene.macrocell = 3;
    for (auto& channel : made->scene.channels) {
      channel.rangeHi = 255;
      channel.density = 0.3;
    }
    made->scene.channels[0].opacity = {{0, 0}, {0.3, 0}, {0.3, 1}, {0.4, 1}, {0.4, 0.1}, {1, 0}};
    made->scene.channels[1].rangeLo = 280;  // reversed
    made->scene.channels[1].rangeHi = -100;
    made->scene.channels[2].gamma = 2.2;
    if (which == TestScene::filters) {
      made->scene.channels[0].interpolation = Interpolation::cubic;
      made->scene.channels[1].interpolation = Interpolation::nearest;
      made->scene.width = made->scene.height = 8;  // the spline takes long
    }
  } else if (which == TestScene::lumps) {
    // Different types on an anisotropic grid.
    const glm::ivec3 dims(12, 14, 9);
    const auto field = [](double phase) {
      return [phase](int x, int y, int z) {
        const double v =
            std::sin(0.6 * x + phase) * std::cos(0.5 * y - phase) + 0.4 * std::sin(0.8 * z + 2 * phase);
        return std::max(0.0, 90 * (v + 0.4));
      };
    };
    made.emplace();
    made->volume = volumeOf(gridOf(dims, {1, 0.8, 1.7}), channelOf<std::uint8_t>(dims, field(0)),
                            channelOf<float>(dims, field(1.3)), channelOf<std::uint16_t>(dims, field(2.4)));
    made->scene = framed(*made->volume, 12);
    for (std::size_t i = 0; i < 3; ++i) {
      made->scene.channels[i].rangeHi = made->volume->channels()[i].histogram.maximum;
      made->scene.channels[i].density = 0.25 + 0.1 * double(i);
    }
  } else if (which == TestScene::tcga) {
    made = cutFrom({"tcga_du_7294/TCGA-DU-7294_t1_bet.nii.gz", "tcga_du_7294/TCGA-DU-7294_t1c_bet.nii.gz",
                    "tcga_du_7294/TCGA-DU-7294_t2_bet.nii.gz", "tcga_du_7294/TCGA-DU-7294_fla_bet.nii.gz"},
                   {0.35, 0.4, 0.5});
  } else {
    made = cutFrom({"stroke_mri/T1.nii.gz", "stroke_mri/T2.nii.gz", "stroke_mri/FLAIR.nii.gz",
                    "stroke_mri/lesion.nii.gz"},
                   {0.35, 0.45, 0.6});
  }
  if (made) furnish(made->volume->grid(), made->scene);
  return made;
}

inline Scene withSetting(Scene scene, int blend, int light) {
  scene.blend = kBlends[blend];
  scene.shading = kLightConfigurations[light].shading;
  scene.shadows = kLightConfigurations[light].shadows;
  return scene;
}

}  // namespace scolopax::test
