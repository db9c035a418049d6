// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/image_file.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "tests/renderer/io/io_test_support.h"

// OpenImageIO 2.4 leaks the text of an error, a few bytes per broken file, when it jumps out of its PNG
// reader.
extern "C" const char* __lsan_default_suppressions() { return "leak:ImageInput::geterror\n"; }

namespace scolopax::io {
namespace {

using testing::HasSubstr;

/// Colours that 8 bits and halves do not represent exactly, some above 1, some transparent.
Image testImage() {
  Image image{5, 3, {}};
  for (int i = 0; i < 15; ++i) {
    const float alpha = float(i) / 14.0f;
    image.pixels.emplace_back(alpha * 0.1234567f, alpha * float(i) * 0.3f, alpha * 1e-6f, alpha);
  }
  return image;
}

std::string contentOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(ImageFile, EndsEncodingWhenItIsToldTo) {
  std::stop_source stop;
  EXPECT_FALSE(encodeImage(testImage(), glm::vec3(0), "exr", stop.get_token()).empty());
  stop.request_stop();
  for (const char* format : {"png", "exr"}) {
    try {
      encodeImage(testImage(), glm::vec3(0), format, stop.get_token());
      ADD_FAILURE() << format << " was encoded";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled);
    }
  }
}

/// Pictures of more rows than are written at once.
TEST(ImageFile, HoldsAllRowsOfATallPicture) {
  const TempDir folder;
  Image image{3, 200, {}};
  for (int i = 0; i < 600; ++i) image.pixels.emplace_back(glm::vec3(float(i % 256) / 255), 1.0f);
  for (const char* name : {"a.exr", "a.tif"}) {
    writeImage(folder / name, image, glm::vec3(0));
    EXPECT_EQ(readImage(folder / name).pixels, image.pixels) << name;
  }
  for (const char* name : {"a.png", "a.jpg"}) {
    writeImage(folder / name, image, glm::vec3(0));
    EXPECT_EQ(readImage(folder / name).height, 200) << name;
  }
}

TEST(ImageFile, FloatFormatsComeBackBitForBit) {
  const TempDir folder;
  const Image image = testImage();
  for (const char* name : {"a.exr", "a.tif", "a.tiff", "A.EXR"}) {
    writeImage(folder / name, image, glm::vec3(1));
    const Image back = readImage(folder / name);
    ASSERT_EQ(back.width, 5) << name;
    ASSERT_EQ(back.height, 3) << name;
    EXPECT_EQ(back.pixels, image.pixels) << name;
  }
}

TEST(ImageFile, EightBitFormatsHoldTheCompositedSrgbPicture) {
  const TempDir folder;
  const Image image = testImage();
  const glm::vec3 background(0.2f, 0.5f, 1.0f);
  const Image8 expected = toSrgb8(image, background);
  writeImage(folder / "a.png", image, background);
  const Image back = readImage(folder / "a.png");
  ASSERT_EQ(back.pixels.size(), 15u);
  for (std::size_t i = 0; i < 15; ++i) {
    EXPECT_EQ(back.pixels[i].a, 1.0f);
    for (int c = 0; c < 3; ++c) {
      const float want = linearFromSrgb(float(expected.rgb[i * 3 + std::size_t(c)]) / 255.0f);
      EXPECT_NEAR(back.pixels[i][c], want, 1e-6f);
    }
  }
}

TEST(ImageFile, JpegKeepsColourAtFullResolution) {
  const TempDir folder;
  // Alternating red and green columns: with subsampled colour they would mix to a brownish mean.
  Image image{32, 32, {}};
  for (int i = 0; i < 32 * 32; ++i) image.pixels.emplace_back(i % 2 == 0, i % 2 == 1, 0, 1);
  writeImage(folder / "a.jpg", image, glm::vec3(0));
  const Image back = readImage(folder / "a.jpg");
  for (std::size_t i = 0; i < back.pixels.size(); ++i) {
    EXPECT_NEAR(back.pixels[i].r, image.pixels[i].r, 0.15f);
    EXPECT_NEAR(back.pixels[i].g, image.pixels[i].g, 0.15f);
  }
}

TEST(ImageFile, EqualPicturesAreEqualBytesWheneverTheyAreWritten) {
  const TempDir folder;
  const std::vector<std::string> names{"a.png", "a.jpg", "a.exr", "a.tif"};
  std::vector<std::string> before;
  for (const std::string& name : names) {
    writeImage(folder / name, testImage(), glm::vec3(0));
    before.push_back(contentOf(folder / name));
  }
  std::this_thread::sleep_for(
      std::chrono::milliseconds(1100));  // dates in files have a resolution of a second
  for (std::size_t i = 0; i < names.size(); ++i) {
    writeImage(folder / names[i], testImage(), glm::vec3(0));
    EXPECT_TRUE(contentOf(folder / names[i]) == before[i]) << names[i];
  }
}

TEST(ImageFile, EncodingInMemoryGivesTheFilesPicture) {
  const TempDir folder;
  const Image image = testImage();
  for (const std::string format : {"png", "exr"}) {
    const auto bytes = encodeImage(image, glm::vec3(0.5f), format);
    writeBytes(folder / ("memory." + format), {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    writeImage(folder / ("file." + format), image, glm::vec3(0.5f));
    EXPECT_EQ(readImage(folder / ("memory." + format)).pixels, readImage(folder / ("file." + format)).pixels);
    EXPECT_EQ(encodeImage(image, glm::vec3(0.5f), format), bytes) << "the same picture gives the same bytes";
  }
}

TEST(ImageFile, ThatDoesNotFitOnTheDiskIsAnError) {
  const TempDir folder;
  for (const char* name : {"a.png", "a.jpg", "a.exr", "a.tif"}) {
    std::filesystem::create_symlink("/dev/full", folder / name);
    EXPECT_THAT([&] { writeImage(folder / name, testImage(), glm::vec3(0)); },
                testing::ThrowsMessage<Error>(HasSubstr(name)));
  }
}

TEST(ImageFile, ThatCannotBeWrittenLeavesTheOneBeforeAndNothingElse) {
  const TempDir folder;
  const auto file = writeBytes(folder / "a.png", "before");
  // A limit below the picture's size acts like a disk that runs full while writing.
  Image noise{64, 64, {}};
  std::uint32_t state = 1;
  for (int i = 0; i < 64 * 64; ++i)
    noise.pixels.emplace_back(float((state = state * 1664525u + 1013904223u) >> 8) / float(1 << 24));
  ASSERT_GT(encodeImage(noise, glm::vec3(0), "png").size(), 2048u);
  rlimit before;
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1024;
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(writeImage(file, noise, glm::vec3(0)), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(std::filesystem::file_size(file), 6u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(ImageFile, ReplacesWhatALinkPointsToAndKeepsLinkAndMode) {
  const TempDir folder;
  using std::filesystem::perms;
  const auto file = writeBytes(folder / "a.png", "before");
  std::filesystem::permissions(file, perms::owner_read | perms::owner_write);
  std::filesystem::create_symlink("a.png", folder / "link.png");
  writeImage(folder / "link.png", testImage(), glm::vec3(0));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.png"));
  EXPECT_EQ(readImage(file).width, 5);
  EXPECT_EQ(std::filesystem::status(file).permissions(), perms::owner_read | perms::owner_write);
}

TEST(ImageFile, DamagedFilesAreNotReadAsPictures) {
  const TempDir folder;
  Image image{64, 64, {}};
  for (int i = 0; i < 64 * 64; ++i) image.pixels.emplace_back(float(i * i % 1009), float(i), 0, 1);
  for (const char* name : {"a.tif", "a.exr", "a.png"}) {
    writeImage(folder / name, image, glm::vec3(0));
    std::ifstream file(folder / name, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), {}};
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 0xFF);
    EXPECT_THAT(errorOf([&] { readImage(writeBytes(folder / name, bytes)); }),
                testing::AnyOf(HasSubstr("cannot be read"), HasSubstr("is not a picture")))
        << name;
  }
}

TEST(ImageFile, BadRequestsAndFilesAreRefusedInOneLine) {
  const TempDir folder;
  const Image image = testImage();
  EXPECT_THAT(errorOf([&] { writeImage(folder / "a.bmp", image, glm::vec3(0)); }),
              HasSubstr("expected png, jpg, exr or tif"));
  EXPECT_THAT(errorOf([&] { writeImage(folder / "a", image, glm::vec3(0)); }), HasSubstr("expected png"));
  EXPECT_THAT(errorOf([&] { encodeImage(image, glm::vec3(0), "jpg"); }), HasSubstr("expected png or exr"));
  EXPECT_THAT(errorOf([&] { writeImage(folder / "no/such/folder.png", image, glm::vec3(0)); }),
              HasSubstr("cannot be written"));
  EXPECT_THAT(errorOf([&] {
                writeImage(folder / "a.png", Image{2, 2, {}}, glm::vec3(0));
              }),
              HasSubstr("width x height"));
  EXPECT_THAT(errorOf([&] { readImage(folder / "gone.png"); }), HasSubstr("no such file"));
  EXPECT_THAT(errorOf([&] { readImage(folder.path()); }), HasSubstr("found a folder"));
  EXPECT_THAT(errorOf([&] { readImage(writeBytes(folder / "bad.png", "not a picture")); }),
              HasSubstr("is not a picture"));
  const auto png = encodeImage(image, glm::vec3(0), "png");
  EXPECT_NE(errorOf([&] {
              readImage(writeBytes(folder / "cut.png", {reinterpret_cast<const char*>(png.data()), 50}));
            }),
            "");
}

}  // namespace
}  // namespace scolopax::io
