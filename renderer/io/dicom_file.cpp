// SPDX-License-Identifier: Apache-2.0
// Headers of DICOM files (dicom.nema.org, PS3.3). GDCM parses the elements; what they mean is decided here.
#include "renderer/io/dicom_file.h"

#if SCOLOPAX_HAS_GDCM
#include <fstream>

#include "renderer/core/error.h"
#include "renderer/io/byte_stream.h"
#include "renderer/io/dicom_elements.h"
#include "renderer/io/dicom_frames.h"
#include "renderer/io/dicom_gdcm.h"
#include "renderer/io/text.h"
#include "renderer/io/voxel_stream.h"

namespace scolopax::io {
namespace fs = std::filesystem;
namespace {

/// A file whose elements before the pixels have been read.
struct DicomHeader {
  std::string file;  ///< for messages
  gdcm::Reader reader = {};
  std::uint64_t fileBytes = 0, pixelOffset = 0;

  const gdcm::DataSet& elements() const { return reader.GetFile().GetDataSet(); }
  gdcm::TransferSyntax syntax() const { return reader.GetFile().GetHeader().GetDataSetTransferSyntax(); }
  Error bad(const std::string& field, const std::string& expected, const std::string& found) const {
    return Error(ErrorCode::badInput, file + ": " + field + ": expected " + expected + ", found " + found);
  }
  Error unsupported(const std::string& what) const {
    return Error(ErrorCode::unsupported, file + ": " + what);
  }
};

void readDicomElements(DicomHeader& header, const fs::path& path) {
  requireRegularFile(path);
  std::error_code failed;
  header.fileBytes = fs::file_size(path, failed);
  header.reader.SetFileName(path.c_str());
  const gdcm::Tag pixels(dicom::kPixels.group, dicom::kPixels.element);
  bool read = false;
  try {  // the value of a skipped element is not read, and its end is not looked for
    read = header.reader.ReadUpToTag(pixels, {pixels});
  } catch (const std::exception&) {
  }
  // GDCM reads nothing in a syntax that it does not know.
  const std::string syntax = dicomText(header.reader.GetFile().GetHeader(), dicom::kTransferSyntax);
  const bool unknown =
      !syntax.empty() && gdcm::TransferSyntax::GetTSType(syntax.c_str()) == gdcm::TransferSyntax::TS_END;
  if (unknown)
    throw header.unsupported("TransferSyntaxUID: expected one that GDCM decodes, found " + inQuotes(syntax));
  if (!read)
    throw Error(ErrorCode::badInput, header.file + ": expected a DICOM file, found damaged elements");
  header.pixelOffset = header.reader.GetStreamCurrentPosition();
}

/// A whole number of an element, at least 1 and at most `most`.
std::int64_t dicomCount(const DicomHeader& header, const DicomTag& tag, const char* field,
                        std::int64_t most) {
  const auto value = dicomUnsigned(header.elements(), tag);
  if (!value || *value < 1 || *value > most)
    throw header.bad(field, "1 to " + std::to_string(most), value ? std::to_string(*value) : "nothing");
  return *value;
}

/// Throws Error(unsupported) for objects that are no grids of pixels.
void refuseOtherDicom(const DicomHeader& header) {
  const std::string sopClass = dicomText(header.elements(), dicom::kSopClass);
  if (sopClass == "1.2.840.10008.1.3.10")
    throw header.unsupported("is a DICOMDIR, which holds no pictures: give the folder");
  if (sopClass == "1.2.840.10008.5.1.4.1.1.77.1.6")
    throw header.unsupported("tiled pictures of whole slides cannot be shown");
  for (const auto& tag : {dicom::kFloatPixels, dicom::kDoublePixels})
    if (hasDicom(header.elements(), tag))
      throw header.unsupported("pixels that are floating-point numbers cannot be read");
  if (!hasDicom(header.elements(), dicom::kRows) || !hasDicom(header.elements(), dicom::kColumns))
    throw header.unsupported("expected pictures, found a DICOM file without Rows and Columns (modality " +
                             inQuotes(dicomText(header.elements(), dicom::kModality)) + ")");
}

bool isReadableSyntax(const gdcm::TransferSyntax& syntax) {
  using S = gdcm::TransferSyntax;
  switch (S::TSType(syntax)) {
    case S::ImplicitVRLittleEndian:
    case S::ImplicitVRBigEndianPrivateGE:
    case S::ExplicitVRLittleEndian:
    case S::DeflatedExplicitVRLittleEndian:
    case S::ExplicitVRBigEndian:
    case S::JPEGBaselineProcess1:
    case S::JPEGExtendedProcess2_4:
    case S::JPEGLosslessProcess14:
    case S::JPEGLosslessProcess14_1:
    case S::JPEGLSLossless:
    case S::JPEGLSNearLossless:
    case S::JPEG2000Lossless:
    case S::JPEG2000:
    case S::RLELossless:
      return true;
    default:
      return false;
  }
}

void readDicomPixelFormat(const DicomHeader& header, DicomFile& file) {
  constexpr std::int64_t kMostSide = 65535;
  const gdcm::DataSet& elements = header.elements();
  file.rows = dicomCount(header, dicom::kRows, "Rows", kMostSide);
  file.columns = dicomCount(header, dicom::kColumns, "Columns", kMostSide);
  file.photometric = dicomText(elements, dicom::kPhotometric);
  const std::int64_t samples = dicomUnsigned(elements, dicom::kSamples).value_or(1);
  const std::int64_t bits = dicomCount(header, dicom::kBitsAllocated, "BitsAllocated", 64);
  const bool isSigned = dicomUnsigned(elements, dicom::kSigned).value_or(0) != 0;
  if (samples != 1 && samples != 3)
    throw header.unsupported("SamplesPerPixel: expected 1 or 3, found " + std::to_string(samples));
  if (bits != 1 && bits != 8 && bits != 16 && bits != 32)
    throw header.unsupported("BitsAllocated: expected 1, 8, 16 or 32, found " + std::to_string(bits));
  file.samples = std::size_t(samples);
  file.bits = bits == 1;
  if (file.bits && samples != 1) throw header.unsupported("pixels of 3 bits cannot be read");
  file.type = bits <= 8    ? (isSigned && bits == 8 ? StoredType::i8 : StoredType::u8)
              : bits == 16 ? (isSigned ? StoredType::i16 : StoredType::u16)
                           : (isSigned ? StoredType::i32 : StoredType::u32);
  static constexpr std::array kColors{"RGB", "YBR_FULL", "YBR_FULL_422", "YBR_ICT", "YBR_RCT"};
  const bool known = samples == 1 ? file.photometric.starts_with("MONOCHROME") ||
                                        file.photometric.starts_with("PALETTE") || file.photometric.empty()
                                  : std::ranges::find(kColors, file.photometric) != kColors.end();
  if (!known)
    throw header.unsupported(
        "PhotometricInterpretation: expected MONOCHROME, PALETTE COLOR, RGB or YBR_FULL, "
        "found " +
        inQuotes(file.photometric));
  if (file.photometric == "YBR_FULL_422" && !header.syntax().IsEncapsulated())
    throw header.unsupported("colours of half the width (YBR_FULL_422) are read only if they are compressed");
  if (file.bits && header.syntax().IsEncapsulated())
    throw header.unsupported("compressed pixels of one bit cannot be read");
  if (file.photometric.starts_with("PALETTE"))
    file.warnings.push_back("the indices are loaded, the palette is left out");
  if (file.photometric == "MONOCHROME1")
    file.warnings.push_back(
        "MONOCHROME1: the values are loaded as they are, though high ones are meant dark");
}

/// NumberOfFrames, limited by what the file can hold.
std::size_t dicomFrameCount(const DicomHeader& header, const DicomFile& file) {
  const std::string text = dicomText(header.elements(), dicom::kFrames);
  const auto frames = text.empty() ? std::optional<std::int64_t>(1) : parseInteger(text);
  if (!frames || *frames < 1) throw header.bad("NumberOfFrames", "1 or more", inQuotes(text));
  checkedDims(header.file + ": Columns, Rows, NumberOfFrames", file.columns, file.rows, *frames);
  const std::uint64_t count = std::uint64_t(*frames);
  const std::uint64_t rest = header.fileBytes - std::min(header.fileBytes, header.pixelOffset);
  const bool deflated = header.syntax() == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian;
  constexpr std::uint64_t kMostInflated = 1032, kFragmentBytes = 8;
  const std::uint64_t pixels = saturatingProduct(std::uint64_t(file.rows * file.columns), count);
  const std::uint64_t needed = header.syntax().IsEncapsulated() ? saturatingProduct(count, kFragmentBytes)
                               : file.bits                      ? pixels / 8
                                           : saturatingProduct(pixels, file.samples * sizeBytes(file.type));
  const std::uint64_t holds = deflated ? saturatingProduct(header.fileBytes, kMostInflated) : rest;
  if (needed > holds)
    throw Error(ErrorCode::badInput, header.file + ": PixelData: expected " + std::to_string(needed) +
                                         " bytes, the file holds at most " + std::to_string(holds));
  return count;
}

std::string dicomUnit(const gdcm::DataSet& elements) {
  const std::string modality = dicomText(elements, dicom::kModality),
                    stated = dicomText(elements, dicom::kRescaleType);
  if (modality == "RTDOSE") return dicomText(elements, dicom::kDoseUnits) == "GY" ? "Gy" : "";
  if (const std::string pet = dicomText(elements, dicom::kPetUnits); !pet.empty())
    return pet == "BQML" ? "Bq/mL" : "";
  if (modality == "CT") return stated.empty() || stated == "US" ? "HU" : stated;
  return stated == "US" ? "" : stated;  // "unspecified"
}

/// The labels of a segmentation; its pixels tell where each of them is.
void readDicomSegments(const DicomHeader& header, DicomFile& file) {
  constexpr std::size_t kMostSegments = 4096;
  const std::string type = dicomText(header.elements(), dicom::kSegmentationType);
  if (type.empty()) return;
  file.labels = type != "FRACTIONAL";
  if (type == "LABELMAP") return;
  visitDicomItems(header.elements(), dicom::kSegments, [&](const gdcm::DataSet& item) {
    file.segments.push_back(
        {dicomUnsigned(item, dicom::kSegmentNumber).value_or(0), dicomText(item, dicom::kSegmentLabel)});
    return file.segments.size() < kMostSegments;
  });
  if (file.segments.empty()) throw header.bad("SegmentSequence", "a segment", "none");
}

}  // namespace

DicomFile readDicomFile(const fs::path& path) {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  DicomHeader header{shown(path)};
  readDicomElements(header, path);
  refuseOtherDicom(header);
  if (!isReadableSyntax(header.syntax()))
    throw header.unsupported("TransferSyntaxUID: expected one that GDCM decodes, found " +
                             inQuotes(header.syntax().GetString()));
  const gdcm::DataSet& elements = header.elements();
  DicomFile file{.path = path};
  file.seriesUid = dicomText(elements, dicom::kSeriesUid);
  file.seriesNumber = dicomText(elements, dicom::kSeriesNumber);
  file.description = dicomText(elements, dicom::kDescription);
  file.unit = dicomUnit(elements);
  file.instance = parseInteger(dicomText(elements, dicom::kInstance)).value_or(0);
  readDicomPixelFormat(header, file);
  readDicomSegments(header, file);
  if (dicomText(elements, dicom::kImageType).find("MOSAIC") != std::string::npos)
    file.warnings.push_back("is a mosaic of slices, which are shown side by side");
  if (hasDicom(elements, dicom::kModalityTable))
    file.warnings.push_back("ModalityLUTSequence is not applied, the values are loaded as they are stored");
  readDicomFrames(elements, header.file, dicomFrameCount(header, file), file);
  return file;
}

}  // namespace scolopax::io
#endif
