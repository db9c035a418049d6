// SPDX-License-Identifier: Apache-2.0
// Low-discrepancy sampling must keep the expected picture, leave noise without structure, and have less noise
// than independent samples.
#include <gtest/gtest.h>

#include <cmath>

#include "renderer/generate/orbitals.h"
#include "renderer/metrics/metrics.h"
#include "tests/support/statistics.h"
#include "tests/support/volumes.h"

namespace scolopax {
namespace {

using namespace test;

class LowDiscrepancy : public testing::Test {
 protected:
  LowDiscrepancy() {
    GeneratedVolume generated = generateOrbitals(32, 4);
    volume_ = std::make_shared<const Volume>(generated.grid, std::move(generated.channels));
    scene_.width = scene_.height = 48;
    scene_.filter = PixelFilter::point;  // where the reference is exact
    scene_.camera = framingCamera(volume_->grid(), 35, 1);
    scene_.channels.resize(4);
    for (std::size_t i = 0; i < 4; ++i) {
      ChannelAppearance& a = scene_.channels[i];
      a.rangeHi = volume_->channels()[i].histogram.maximum * 0.5;
      a.density = 0.6;
      a.color = {{0, glm::dvec3(i != 0, i != 1, i != 2)}};
    }
    truth_ = reference::renderReference(*volume_, scene_, 1).image;
  }

  std::shared_ptr<const Volume> volume_;
  Scene scene_;
  Image truth_;
};

TEST_F(LowDiscrepancy, HasTheExpectedPictureOfTheReference) {
  // Squared deviation of the mean over replicates from the reference, in units of its expected value by their
  // spread: 1, with a standard deviation of about sqrt(2 / 2304) times a correlation of components below 4:
  // 0.12. A bias of 1/8 of one replicate's noise makes it 2.
  constexpr int kReplicates = 32, kSamples = 16;
  for (const Method method : kTrackers) {
    scene_.method = method;
    std::vector<glm::dvec4> mean(truth_.pixels.size(), glm::dvec4(0)), squares = mean;
    for (int r = 0; r < kReplicates; ++r) {
      scene_.seed = std::uint32_t(r);
      const Image image = renderSamples(volume_, scene_, kSamples);
      for (std::size_t i = 0; i < mean.size(); ++i) {
        const glm::dvec4 v(image.pixels[i]);
        mean[i] += v / double(kReplicates);
        squares[i] += v * v / double(kReplicates);
      }
    }
    double deviation = 0, allowed = 0;
    for (std::size_t i = 0; i < mean.size(); ++i)
      for (int c = 0; c < 4; ++c) {
        deviation += std::pow(mean[i][c] - double(truth_.pixels[i][c]), 2);
        allowed += (squares[i][c] - mean[i][c] * mean[i][c]) / (kReplicates - 1.0);
      }
    EXPECT_NEAR(deviation / allowed, 1, 0.5) << nameOf(method);
  }
}

TEST_F(LowDiscrepancy, LeavesLessNoiseThanIndependentSamples) {
  const auto squaredError = [&](Sampling sampling, int samples) {
    scene_.sampling = sampling;
    double sum = 0;
    for (std::uint32_t seed = 0; seed < 4; ++seed) {
      scene_.seed = seed;
      sum += std::pow(compareImages(renderSamples(volume_, scene_, samples), truth_).rmse, 2);
    }
    return sum;
  };
  // With one sample there is no gain; with more there must be one. (Its size depends on the scene:
  // tests/bench measures it.) Over 4 x 2304 pixels a ratio is known to about 4 %.
  const auto gain = [&](int samples) {
    return squaredError(Sampling::independent, samples) / squaredError(Sampling::lowDiscrepancy, samples);
  };
  if (statisticsFactor() == 1) {
    EXPECT_NEAR(gain(1), 1, 0.2);
  }
  EXPECT_GT(gain(64), 1.1);
}

TEST_F(LowDiscrepancy, LeavesNoiseWithoutStructure) {
  // Deviations of neighbouring pixels, in units of those of independent samples, are uncorrelated: the sum of
  // 2304 products is within 5 standard deviations. One scrambling for all pixels fails at once.
  for (const int samples : {1, 4, 16}) {
    const Image image = renderSamples(volume_, scene_, samples);
    const auto deviation = [&](int x, int y) {
      const auto i = std::size_t(y * scene_.width + x);
      const double p = double(truth_.pixels[i].a);
      return p > 1e-3 && p < 1 - 1e-3 ? (double(image.pixels[i].a) - p) / std::sqrt(p * (1 - p)) : 0.0;
    };
    for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {2, 0}, {16, 0}, {0, 16}}) {
      double sum = 0, squares = 0;
      for (int y = 0; y + dy < scene_.height; ++y)
        for (int x = 0; x + dx < scene_.width; ++x) {
          const double product = deviation(x, y) * deviation(x + dx, y + dy);
          sum += product;
          squares += product * product;
        }
      EXPECT_LT(std::abs(sum), 5 * std::sqrt(squares)) << samples << " samples, " << dx << " " << dy;
    }
  }
}

}  // namespace
}  // namespace scolopax
