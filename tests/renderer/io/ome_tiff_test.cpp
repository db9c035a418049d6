// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <numeric>

#include "tests/renderer/io/tiff_test_support.h"

namespace scolopax::io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kOneImage = R"(<OME UUID="urn:uuid:1"><Image><Pixels DimensionOrder="XYZCT" SizeX="3" )"
                              R"(SizeY="2" Type="uint16" )";

/// Pages of 3x2 uint16; all six pixels of page p are p.
std::vector<std::string> numberedPages(int count) {
  std::vector<std::string> pages;
  for (int p = 0; p < count; ++p) pages.push_back(bytesOf(std::vector<std::uint16_t>(6, std::uint16_t(p))));
  return pages;
}

std::string omeBytes(const std::string& xml, int pages) {
  TiffBytes tiff;
  tiff.description = xml;
  return tiff.build(numberedPages(pages));
}

std::string omeXml(const std::string& attributes, const std::string& inside) {
  return kOneImage + attributes + ">" + inside + "</Pixels></Image></OME>";
}

/// The pages from which the slices of a channel at a time came.
std::vector<double> pagesOf(const VolumeFile& file, std::size_t time, std::size_t channel) {
  const LoadedPart part = load(file, {.time = time, .channels = {channel}}, LoadOptions{});
  const std::vector<double> values = valuesOf(part.channels[0]);
  std::vector<double> pages;
  for (std::size_t i = 0; i < values.size(); i += 6) {
    EXPECT_EQ(std::ranges::count(values.begin() + long(i), values.begin() + long(i + 6), values[i]), 6);
    pages.push_back(values[i]);
  }
  return pages;
}

double sumOf(const ChannelSource& channel) {
  const auto values = valuesOf(channel);
  return std::accumulate(values.begin(), values.end(), 0.0);
}

using Sums = std::vector<double>;
Sums sumsOf(const LoadedPart& part) {
  Sums sums;
  for (const ChannelSource& channel : part.channels) sums.push_back(sumOf(channel));
  return sums;
}

// Sums of the collection's files were found by an independent reader of uncompressed TIFFs.

TEST(OmeTiffFiles, ThePatternsOfTheCollectionHaveTheirChannelsSlicesAndTimes) {
  SKIP_WITHOUT(dataFile("formats/ome_tiff/multi-channel.ome.tif"));
  std::string warnings;
  const Warn warn = [&](const std::string& line) { warnings += line + "\n"; };
  const LoadedFile flat = loadFile(dataFile("formats/ome_tiff/multi-channel.ome.tif"), kTestLimit, warn);
  EXPECT_EQ(flat.grid.dims, glm::ivec3(439, 167, 1));
  ASSERT_EQ(flat.channels.size(), 3u);
  EXPECT_EQ(sumOf(flat.channels[0]), 3481959);
  EXPECT_EQ(sumOf(flat.channels[2]), 3481626);

  const LoadedFile stack =
      loadFile(dataFile("formats/ome_tiff_more/multi-channel-z-series.ome.tif"), kTestLimit, warn);
  EXPECT_EQ(stack.grid.dims, glm::ivec3(439, 167, 5));
  EXPECT_EQ(stack.grid.worldFromVoxel, glm::dmat4(1.0));
  ASSERT_EQ(stack.channels.size(), 3u);
  EXPECT_EQ(sumOf(stack.channels[0]), 3460118 + 3459897 + 3459785 + 3459788 + 3459730);
  EXPECT_EQ(sumOf(stack.channels[2]), 3459732 + 3459511 + 3459399 + 3459402 + 3459344);
  EXPECT_EQ(rangeOf(stack.channels[1]), std::pair(-1.0, 96.0));

  const auto series = dataFile("timeseries/4D-series.ome.tif");
  const LoadedFile last = loadFile(series, kTestLimit, warn, 6);
  EXPECT_EQ(last.grid.dims, glm::ivec3(439, 167, 5));
  EXPECT_EQ(last.times.count, 7u);
  ASSERT_EQ(last.channels.size(), 1u);
  EXPECT_EQ(sumOf(last.channels[0]), 3470720 + 3470499 + 3470387 + 3470390 + 3470332);
  EXPECT_EQ(rangeOf(last.channels[0]), std::pair(-1.0, 96.0));
  EXPECT_EQ(last.worldUnit, "");
  EXPECT_THAT(warnings, Not(HasSubstr("expected")));
}

TEST(OmeTiffFiles, TheSeriesOfTheCollectionAreVolumesWithWavelengths) {
  SKIP_WITHOUT(dataFile("formats/ome_tiff_more/multiseries_4ch.ome.tiff"));
  const auto file = openFile(dataFile("formats/ome_tiff_more/multiseries_4ch.ome.tiff"));
  ASSERT_EQ(file->volumes.size(), 6u);
  EXPECT_EQ(file->volumes[5].path, "Scan_20180705_135218_01x4x01271.rcpnl #844");
  for (const VolumeInfo& volume : file->volumes) {
    EXPECT_EQ(volume.levels[0].dims, glm::ivec3(5, 5, 1));
    EXPECT_EQ(volume.levels[0].spacing(), glm::dvec3(0.6499999761581421, 0.6499999761581421, 1));
    EXPECT_EQ(volume.worldUnit, "um");
    ASSERT_EQ(volume.channels.size(), 4u);
    EXPECT_EQ(volume.channels[0].name, "431 nm");
    EXPECT_EQ(volume.channels[3].name, "690 nm");
  }
  const LoadedPart first = load(*file, {}, LoadOptions{});
  EXPECT_EQ(sumsOf(first), (Sums{84619, 20083, 12829, 20902}));
  EXPECT_EQ(rangeOf(first.channels[0]), std::pair(2128.0, 5247.0));
  EXPECT_EQ(rangeOf(first.channels[2]), std::pair(431.0, 617.0));
  EXPECT_EQ(sumsOf(load(*file, {.volume = 5}, LoadOptions{})), (Sums{11997, 11969, 9987, 17946}));
}

TEST(OmeTiffFiles, SubIfdsAreLevels) {
  SKIP_WITHOUT(dataFile("formats/ome_tiff_more/rgba_levels.ome.tiff"));
  const auto file = openFile(dataFile("formats/ome_tiff_more/rgba_levels.ome.tiff"));
  ASSERT_EQ(file->volumes.size(), 1u);
  const std::vector<Grid>& levels = file->volumes[0].levels;
  ASSERT_EQ(levels.size(), 4u);
  EXPECT_EQ(levels[0].dims, glm::ivec3(26, 25, 1));
  EXPECT_EQ(levels[1].dims, glm::ivec3(13, 12, 1));
  EXPECT_EQ(levels[1].spacing(), glm::dvec3(2, 2, 1));
  EXPECT_EQ(levels[1].worldFromVoxel[3], glm::dvec4(0.5, 0.5, 0, 1)) << "half a fine voxel further in";
  EXPECT_EQ(levels[3].dims, glm::ivec3(3, 3, 1));
  EXPECT_EQ(levels[3].spacing(), glm::dvec3(8, 8, 1));
  ASSERT_EQ(file->volumes[0].channels.size(), 4u);
  EXPECT_EQ(sumsOf(load(*file, {}, LoadOptions{})), (Sums{119088, 115888, 91173, 61742}));
  double all = 0;
  for (const double sum : sumsOf(load(*file, {.level = 1}, LoadOptions{}))) all += sum;
  EXPECT_EQ(all, 94200);

  const auto tiled = openFile(dataFile("formats/ome_tiff_more/tiled_pyramid_2ch.ome.tiff"));
  ASSERT_EQ(tiled->volumes[0].levels.size(), 4u);
  EXPECT_EQ(tiled->volumes[0].levels[0].dims, glm::ivec3(512, 512, 1));
  EXPECT_EQ(tiled->volumes[0].levels[3].dims, glm::ivec3(64, 64, 1));
  EXPECT_EQ(tiled->volumes[0].channels[0].name, "CHAN_0");
  EXPECT_EQ(sumsOf(load(*tiled, {}, LoadOptions{})), (Sums{262144, 262144}));
  EXPECT_EQ(sumsOf(load(*tiled, {.level = 3}, LoadOptions{})), (Sums{4096, 4096}));
}

TEST(OmeTiffFiles, XmlThatDoesNotFitThePagesIsRefused) {
  SKIP_WITHOUT(dataFile("formats/ome_tiff_more/bad_xml_19ch_pyramid.ome.tiff"));
  EXPECT_THAT(loadError(dataFile("formats/ome_tiff_more/bad_xml_19ch_pyramid.ome.tiff")),
              HasSubstr("ImageDescription: TiffData: IFD, PlaneCount: expected pages of the 2 in"));
}

TEST(OmeTiffFiles, SlicesInFilesOfTheirOwnNeedTheCompanionThatDescribesThem) {
  SKIP_WITHOUT(dataFile("formats/ome_tiff/multifile-Z1.ome.tiff"));
  EXPECT_THAT(loadError(dataFile("formats/ome_tiff/multifile-Z1.ome.tiff")),
              HasSubstr("BinaryOnly: MetadataFile: names \"multifile.companion.ome\", which is not in"));
  const TempDir folder;
  std::string xml =
      R"(<?xml version="1.0"?><!-- <a> --><OME:OME xmlns:OME="x"><OME:Image><OME:Pixels SizeX="18"
    SizeY="24" SizeZ="5" SizeC="1" SizeT="1" Type="uint8" DimensionOrder="XYZTC" PhysicalSizeX="2"><Channel/>)";
  for (int z = 0; z < 5; ++z) {
    const std::string name = "multifile-Z" + std::to_string(z + 1) + ".ome.tiff";
    std::filesystem::copy(dataFile("formats/ome_tiff/" + name), folder / name);
    xml += "<OME:TiffData FirstZ=\"" + std::to_string(z) + "\"><OME:UUID FileName=\"" + name +
           "\">u</OME:UUID></OME:TiffData>";
  }
  writeBytes(folder / "multifile.companion.ome", xml + "</OME:Pixels></OME:Image></OME:OME>");
  for (const char* name : {"multifile-Z3.ome.tiff", "multifile.companion.ome"}) {
    const LoadedFile file = loadFile(folder / name, kTestLimit, {});
    EXPECT_EQ(file.grid.dims, glm::ivec3(18, 24, 5));
    EXPECT_EQ(file.grid.spacing(), glm::dvec3(2));
    const auto values = valuesOf(file.channels.at(0));
    Sums sums;
    for (long z = 0; z < 5; ++z)
      sums.push_back(std::accumulate(values.begin() + z * 432, values.begin() + (z + 1) * 432, 0.0));
    EXPECT_EQ(sums, (Sums{94605, 16575, 93330, 17136, 92820})) << name;
  }
  std::vector<std::filesystem::path> all;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) all.push_back(entry.path());
  const auto datasets = openDatasets(all, {});
  ASSERT_EQ(datasets.size(), 1u) << "files that others name are not opened again";
  EXPECT_EQ(datasets[0].channels.size(), 1u);

  std::filesystem::remove(folder / "multifile-Z4.ome.tiff");
  EXPECT_THAT(loadError(folder / "multifile-Z1.ome.tiff"), HasSubstr("TiffData: FileName: names"));
}

TEST(OmeTiffFiles, PlanesRunInTheStatedOrder) {
  const TempDir folder;
  struct Row {
    const char* order;
    int z, c, t;  // steps in pages
  };
  for (const Row& row : {Row{"XYZCT", 1, 2, 6}, Row{"XYZTC", 1, 8, 2}, Row{"XYCZT", 3, 1, 6},
                         Row{"XYCTZ", 12, 1, 3}, Row{"XYTZC", 4, 8, 1}, Row{"XYTCZ", 12, 4, 1}}) {
    std::string xml = omeXml(R"(SizeZ="2" SizeC="3" SizeT="4")", "<TiffData/>");
    xml.replace(xml.find("XYZCT"), 5, row.order);
    const auto file = openFile(writeBytes(folder / "a.ome.tif", omeBytes(xml, 24)));
    ASSERT_EQ(file->volumes[0].times.count, 4u);
    ASSERT_EQ(file->volumes[0].channels.size(), 3u);
    for (int c = 0; c < 3; ++c)
      for (int t = 0; t < 4; ++t)
        EXPECT_EQ(pagesOf(*file, std::size_t(t), std::size_t(c)),
                  (Sums{double(c * row.c + t * row.t), double(c * row.c + t * row.t + row.z)}))
            << row.order;
  }
}

TEST(OmeTiffFiles, TiffDataPlacesRunsOfPages) {
  const TempDir folder;
  const auto pages = [&](const std::string& data) {
    const auto path =
        writeBytes(folder / "a.ome.tif", omeBytes(omeXml(R"(SizeZ="3" SizeC="2" SizeT="1")", data), 6));
    const auto file = openFile(path);
    Sums all = pagesOf(*file, 0, 0);
    std::ranges::copy(pagesOf(*file, 0, 1), std::back_inserter(all));
    return all;
  };
  EXPECT_EQ(pages(""), (Sums{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(pages(R"(<TiffData IFD="0" PlaneCount="6"/>)"), (Sums{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(pages(R"(<TiffData IFD="3" PlaneCount="3"/><TiffData IFD="0" FirstC="1" PlaneCount="3"/>)"),
            (Sums{3, 4, 5, 0, 1, 2}));
  EXPECT_EQ(pages(R"(<TiffData IFD="5" FirstZ="1" FirstC="1"/>)"), (Sums{0, 0, 0, 0, 5, 0}))
      << "one page, the other planes are 0";
  EXPECT_EQ(pages(R"(<TiffData IFD="1" FirstZ="2" PlaneCount="2"/>)"), (Sums{0, 0, 1, 2, 0, 0}));
  EXPECT_EQ(pages(R"(<TiffData><UUID FileName="old name.tif">urn:uuid:1</UUID></TiffData>)"),
            (Sums{0, 1, 2, 3, 4, 5}))
      << "a file that was renamed";
}

TEST(OmeTiffFiles, NamesColoursSpacingsAndTimesAreTheOnesStated) {
  const TempDir folder;
  std::string warnings;
  const auto open = [&](const std::string& attributes, const std::string& inside) {
    warnings.clear();
    return openFile(writeBytes(folder / "a.ome.tif", omeBytes(omeXml(attributes, inside), 4)),
                    {.warn = [&](const std::string& line) { warnings += line; }})
        ->volumes[0];
  };
  const VolumeInfo named =
      open(R"(SizeZ="1" SizeC="4" SizeT="1" PhysicalSizeX="500" PhysicalSizeXUnit="nm" PhysicalSizeY="1"
              PhysicalSizeZ="0.002" PhysicalSizeZUnit="mm")",
           R"(<Channel Name="DAPI" Color="-16776961"/><Channel Fluor="GFP" Color="16711935"/>
              <Channel Color="-1"/>)");
  EXPECT_EQ(named.levels[0].spacing(), glm::dvec3(500, 1000, 2000));
  EXPECT_EQ(named.worldUnit, "nm");
  ASSERT_EQ(named.channels.size(), 4u);
  using Color = std::array<std::uint8_t, 3>;
  EXPECT_EQ(named.channels[0].name, "DAPI");
  EXPECT_EQ(named.channels[0].look.color, (Color{255, 0, 0}));
  EXPECT_EQ(named.channels[1].name, "GFP");
  EXPECT_EQ(named.channels[1].look.color, (Color{0, 255, 0}));
  EXPECT_EQ(named.channels[2].look.color, std::nullopt) << "white is the default";
  EXPECT_EQ(named.channels[3].name, "a 3");
  EXPECT_EQ(warnings, "");

  const VolumeInfo steps = open(R"(SizeZ="2" SizeC="1" SizeT="2" TimeIncrement="2.5" TimeIncrementUnit="min"
                                   PhysicalSizeX="3" PhysicalSizeXUnit="pixel")",
                                "");
  EXPECT_EQ(steps.times.values, (std::vector<double>{0, 2.5}));
  EXPECT_EQ(steps.times.unit, "min");
  EXPECT_EQ(steps.worldUnit, "");
  const VolumeInfo own =
      open(R"(SizeZ="2" SizeC="1" SizeT="2" PhysicalSizeX="0.5" PhysicalSizeY="-1")",
           R"(<Plane TheZ="0" TheC="0" TheT="1" DeltaT="9"/><Plane TheZ="1" TheC="0" TheT="1" DeltaT="1"/>
              <Plane TheZ="0" TheC="0" TheT="0" DeltaT="4"/>)");
  EXPECT_EQ(own.times.values, (std::vector<double>{4, 9}));
  EXPECT_EQ(own.times.unit, "s");
  EXPECT_EQ(own.levels[0].spacing(), glm::dvec3(0.5));
  EXPECT_THAT(warnings, AllOf(HasSubstr("PhysicalSizeY: expected a positive number, found \"-1\""),
                              HasSubstr("PhysicalSizeZ: is missing")));
}

TEST(OmeTiffFiles, TheStatedTypeCountsWherePagesLeaveOutTheSigns) {
  const TempDir folder;
  std::string xml = omeXml(R"(SizeZ="1" SizeC="1" SizeT="1")", "");
  xml.replace(xml.find("uint16"), 6, "int16");
  TiffBytes tiff;
  tiff.description = xml;
  const auto path =
      writeBytes(folder / "a.ome.tif", tiff.build({bytesOf(std::vector<std::int16_t>{-1, 2, -3, 4, -5, 6})}));
  EXPECT_EQ(valuesOf(loadFile(path, kTestLimit, {}).channels[0]), (std::vector<double>{-1, 2, -3, 4, -5, 6}));
}

TEST(OmeTiffFiles, SamplesOfAPageAreChannels) {
  const TempDir folder;
  for (const char* stated : {R"(<Channel SamplesPerPixel="3" Name="picture"/>)", "<Channel/>"}) {
    TiffBytes tiff;
    tiff.description = omeXml(R"(SizeZ="2" SizeC="3" SizeT="1")", stated);
    tiff.tags[277] = 3;
    std::vector<std::uint16_t> page(18);
    std::iota(page.begin(), page.end(), std::uint16_t(0));
    const std::string first = bytesOf(page);
    std::iota(page.begin(), page.end(), std::uint16_t(100));
    const auto path = writeBytes(folder / "a.ome.tif", tiff.build({first, bytesOf(page)}));
    const LoadedFile file = loadFile(path, kTestLimit, {});
    ASSERT_EQ(file.channels.size(), 3u) << stated;
    EXPECT_EQ(valuesOf(file.channels[1]),
              (std::vector<double>{1, 4, 7, 10, 13, 16, 101, 104, 107, 110, 113, 116}));
  }
}

/// A file of one image whose second page is a SubIFD of the first.
std::string pyramidBytes(std::uint64_t width, std::uint64_t height) {
  constexpr std::uint32_t kMark = 0x12345678;
  TiffBytes tiff;
  tiff.description = omeXml(R"(SizeZ="1" SizeC="1" SizeT="1")", "");
  tiff.pageTags = {{0, {{330, kMark}}}, {1, {{256, width}, {257, height}, {278, height}}}};
  std::string bytes = tiff.build(numberedPages(2));
  const std::size_t mark = bytes.find(bytesOf(std::vector{kMark})), next = mark + 4;
  bytes.replace(mark, 4, bytes.substr(next, 4));
  return bytes.replace(next, 4, std::string(4, '\0'));
}

TEST(OmeTiffFiles, SubIfdsThatAreNoLevelsAreLeftOutWithAWarning) {
  const TempDir folder;
  std::string warnings;
  const auto levels = [&](std::uint64_t width, std::uint64_t height) {
    warnings.clear();
    return openFile(writeBytes(folder / "a.ome.tif", pyramidBytes(width, height)),
                    {.warn = [&](const std::string& line) { warnings += line; }})
        ->volumes[0]
        .levels.size();
  };
  EXPECT_EQ(levels(2, 1), 2u);
  EXPECT_EQ(warnings, "");
  EXPECT_EQ(levels(3, 2), 1u);
  EXPECT_THAT(warnings, HasSubstr("SubIFDs: expected smaller pictures"));
  EXPECT_EQ(levels(30, 1), 1u);
  const auto file = openFile(writeBytes(folder / "a.ome.tif", pyramidBytes(2, 1)));
  const LoadedPart coarse = load(*file, {.level = 1}, LoadOptions{});
  EXPECT_EQ(coarse.grid.dims, glm::ivec3(2, 1, 1));
  EXPECT_EQ(valuesOf(coarse.channels[0]), (std::vector<double>{1, 1}));
}

TEST(OmeTiffFiles, HeadersThatLieAreRefused) {
  const TempDir folder;
  const auto errorFor = [&](const std::string& xml) {
    return loadError(writeBytes(folder / "a.ome.tif", omeBytes(xml, 4)));
  };
  const std::string sizes = R"(SizeZ="4" SizeC="1" SizeT="1")";
  EXPECT_EQ(errorFor(omeXml(sizes, "")), "");
  EXPECT_THAT(errorFor(omeXml(sizes, "<Channel>")), HasSubstr("ImageDescription: expected OME-XML, found"));
  EXPECT_THAT(errorFor("<OME></OME>"), HasSubstr("expected an Image with Pixels, found none"));
  EXPECT_THAT(errorFor(omeXml(R"(SizeZ="0" SizeC="1" SizeT="1")", "")), HasSubstr("Pixels: SizeZ: expected"));
  EXPECT_THAT(errorFor(omeXml(R"(SizeC="1" SizeT="1")", "")), HasSubstr("Pixels: SizeZ: expected"));
  EXPECT_THAT(errorFor(omeXml(R"(SizeZ="2000000000" SizeC="1" SizeT="1")", "")), HasSubstr("SizeZ"));
  EXPECT_THAT(errorFor(omeXml(R"(SizeZ="1" SizeC="5000" SizeT="1")", "")),
              HasSubstr("SizeC: expected at most"));
  EXPECT_THAT(errorFor(omeXml(R"(SizeZ="1" SizeC="1" SizeT="99999999")", "")), HasSubstr("SizeT: expected"));
  EXPECT_THAT(errorFor(omeXml(R"(SizeZ="9999999" SizeC="4000" SizeT="999999")", "")),
              HasSubstr("at most 2^40 planes"));
  EXPECT_THAT(errorFor(omeXml(sizes, R"(<TiffData IFD="4"/>)")), HasSubstr("expected pages of the 4"));
  EXPECT_THAT(errorFor(omeXml(sizes, R"(<TiffData IFD="1" PlaneCount="4"/>)")), HasSubstr("of the 4"));
  EXPECT_THAT(errorFor(omeXml(sizes, R"(<TiffData IFD="-1"/>)")), HasSubstr("TiffData: IFD: expected"));
  EXPECT_THAT(errorFor(omeXml(sizes, R"(<TiffData FirstZ="4"/>)")), HasSubstr("FirstZ, FirstC, FirstT"));
  EXPECT_THAT(errorFor(omeXml(sizes, R"(<TiffData FirstZ="3" PlaneCount="2"/>)")), HasSubstr("PlaneCount"));
  EXPECT_THAT(errorFor(omeXml(sizes, R"(<TiffData PlaneCount="0"/>)")), HasSubstr("at least one plane"));
  TiffBytes pairs;
  pairs.description = omeXml(R"(SizeZ="1" SizeC="1" SizeT="1")", "");
  pairs.tags[277] = 2;
  EXPECT_THAT(loadError(writeBytes(folder / "a.ome.tif", pairs.build(numberedPages(1)))),
              HasSubstr("SizeC, SamplesPerPixel: expected the 2 samples of the pages, found 1, 1"));
  const std::string named = R"(<TiffData IFD="0"/><TiffData><UUID FileName=")";
  EXPECT_THAT(errorFor(omeXml(sizes, named + R"(../b.tif"/></TiffData>)")),
              HasSubstr("expected a file in or below the header's folder"));
  EXPECT_THAT(errorFor(omeXml(sizes, named + R"(b.tif"/></TiffData>)")), HasSubstr("which is not in"));
  for (const auto& [from, to, field] :
       {std::array{"SizeX=\"3\"", "SizeX=\"4\"", "SizeX, SizeY: expected 3, 2"},
        {"XYZCT", "XZYCT", "DimensionOrder: expected"},
        {"XYZCT", "XYZCC", "DimensionOrder: expected"},
        {"uint16", "complex", "Type: expected integers or floats"}}) {
    std::string xml = omeXml(sizes, "");
    xml.replace(xml.find(from), std::string(from).size(), to);
    EXPECT_THAT(errorFor(xml), HasSubstr(field));
  }
}

TEST(OmeTiffFiles, OneBadImageDoesNotHideTheOthers) {
  const TempDir folder;
  const std::string good =
      omeXml(R"(SizeZ="2" SizeC="1" SizeT="1")", R"(<TiffData IFD="1" PlaneCount="2"/>)");
  std::string bad = good;
  bad.replace(bad.find("SizeX=\"3\""), 9, "SizeX=\"5\"");
  const auto image = [](const std::string& xml) {
    return xml.substr(xml.find("<Image>"), xml.find("</OME>") - xml.find("<Image>"));
  };
  std::string warnings;
  const auto file =
      openFile(writeBytes(folder / "a.ome.tif", omeBytes("<OME>" + image(bad) + image(good) + "</OME>", 3)),
               {.warn = [&](const std::string& line) { warnings += line; }});
  ASSERT_EQ(file->volumes.size(), 1u);
  EXPECT_EQ(pagesOf(*file, 0, 0), (Sums{1, 2}));
  EXPECT_THAT(warnings, AllOf(HasSubstr("Image 0: Pixels: SizeX, SizeY"), HasSubstr("left out")));
}

TEST(OmeTiffFiles, EveryTruncationIsRefused) {
  const TempDir folder;
  for (const std::string& whole :
       {omeBytes(omeXml(R"(SizeZ="2" SizeC="1" SizeT="1")", ""), 2), pyramidBytes(3, 1)}) {
    const auto errorAt = [&](std::size_t length) {
      const auto path = writeBytes(folder / "a.ome.tif", whole.substr(0, length));
      return errorOf([&] {
        const auto file = openFile(path);
        load(*file, {.level = file->volumes[0].levels.size() - 1}, LoadOptions{});
      });
    };
    // The level's 6 bytes are the first of the 12 at the end.
    const std::size_t needed =
        whole.size() -
        (openFile(writeBytes(folder / "a.ome.tif", whole))->volumes[0].levels.size() == 2 ? 6 : 0);
    EXPECT_EQ(errorAt(needed), "");
    for (std::size_t length = 0; length < needed; ++length) EXPECT_NE(errorAt(length), "") << length;
  }
}

}  // namespace
}  // namespace scolopax::io
