// SPDX-License-Identifier: Apache-2.0
// Pixels of DICOM files, decoded by GDCM.
#include "renderer/io/dicom_file.h"

#if SCOLOPAX_HAS_GDCM
#include <algorithm>
#include <cmath>
#include <span>

#include "renderer/core/error.h"
#include "renderer/io/dicom_gdcm.h"
#include "renderer/io/dicom_rle.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

[[noreturn]] void failDicomPixels(const DicomFile& file, const std::string& why) {
  throw Error(ErrorCode::badInput, shown(file.path) + ": PixelData: " + why);
}

std::uint64_t packedDicomBytes(const DicomFile& file) {
  const std::uint64_t bytes = saturatingProduct(file.frameBytes(), file.frames.size());
  return file.bits ? bytes / 8 + (bytes % 8 != 0) : bytes;
}

/// Throws Error(badInput) unless GDCM will write what the header promised, and has read as much.
void checkDecodedDicom(const DicomFile& file, const gdcm::Image& image) {
  const gdcm::PixelFormat format = image.GetPixelFormat();
  const bool isSigned =
      file.type == StoredType::i8 || file.type == StoredType::i16 || file.type == StoredType::i32;
  const std::size_t bits = file.bits ? 1 : sizeBytes(file.type) * 8;
  const std::size_t frames = image.GetNumberOfDimensions() > 2 ? image.GetDimension(2) : 1;
  if (std::int64_t(image.GetColumns()) != file.columns || std::int64_t(image.GetRows()) != file.rows ||
      frames != file.frames.size() || format.GetBitsAllocated() != bits ||
      format.GetSamplesPerPixel() != file.samples || (format.GetPixelRepresentation() != 0) != isSigned)
    failDicomPixels(file, "expected pictures as the header says, found others");
  const gdcm::ByteValue* stored = image.GetDataElement().GetByteValue();
  const std::uint64_t needed = packedDicomBytes(file);
  if (stored && std::uint64_t(stored->GetLength()) < needed)
    failDicomPixels(file, "expected " + std::to_string(needed) + " bytes, found " +
                              std::to_string(std::uint64_t(stored->GetLength())));
}

/// Pixels of one bit, straight from the file: GDCM expects rows that begin with a byte, which DICOM's do not.
std::vector<std::byte> unpackedDicomBits(const DicomFile& file, const gdcm::Image& image) {
  const gdcm::ByteValue* stored = image.GetDataElement().GetByteValue();
  if (!stored) failDicomPixels(file, "expected pixels of one bit without compression, found others");
  const auto* bytes = reinterpret_cast<const std::byte*>(stored->GetPointer());
  std::vector<std::byte> unpacked(file.frameBytes() * file.frames.size());
  for (std::size_t i = 0; i < unpacked.size(); ++i) unpacked[i] = (bytes[i / 8] >> (i % 8)) & std::byte(1);
  return unpacked;
}

/// Whether GDCM decodes the bytes in a wrong order.
bool isDeepRle(const DicomFile& file, const gdcm::Image& image) {
  return image.GetTransferSyntax() == gdcm::TransferSyntax::RLELossless && file.samples > 1 &&
         sizeBytes(file.type) > 1;
}

std::vector<std::byte> decodedRle(const DicomFile& file, const gdcm::Image& image) {
  const gdcm::SequenceOfFragments* fragments = image.GetDataElement().GetSequenceOfFragments();
  if (!fragments || fragments->GetNumberOfFragments() != file.frames.size())
    failDicomPixels(file, "expected a fragment for each frame, found others");
  std::vector<std::byte> decoded(file.frameBytes() * file.frames.size());
  for (std::size_t frame = 0; frame < file.frames.size(); ++frame) {
    const gdcm::ByteValue* packed = fragments->GetFragment(frame).GetByteValue();
    if (!packed) failDicomPixels(file, "expected a frame, found an empty fragment");
    try {
      decodeRleFrame(std::as_bytes(std::span(packed->GetPointer(), packed->GetLength())),
                     std::size_t(file.rows * file.columns), file.samples, sizeBytes(file.type),
                     decoded.data() + frame * file.frameBytes());
    } catch (const Error& error) {
      failDicomPixels(file, error.what());
    }
  }
  return decoded;
}

std::vector<std::byte> decodedByGdcm(const DicomFile& file, const gdcm::Image& image) {
  if (image.GetBufferLength() != file.frameBytes() * file.frames.size())
    failDicomPixels(file, "expected " + std::to_string(file.frameBytes() * file.frames.size()) +
                              " bytes, found " + std::to_string(image.GetBufferLength()));
  std::vector<std::byte> decoded(file.frameBytes() * file.frames.size());
  if (!image.GetBuffer(reinterpret_cast<char*>(decoded.data())))
    failDicomPixels(file, "expected a picture, found data that cannot be decoded");
  return decoded;
}

/// YBR_FULL to RGB (PS3.3 C.7.6.3.1.2), for 8-bit samples.
void convertDicomToRgb(const DicomFile& file, DicomPixels& pixels) {
  const std::size_t perFrame = std::size_t(file.rows * file.columns);
  const std::size_t sample = pixels.planar ? perFrame : 1, pixel = pixels.planar ? 1 : 3;
  const auto limited = [](double value) { return std::byte(std::clamp(std::lround(value), 0L, 255L)); };
  for (std::size_t frame = 0; frame < file.frames.size(); ++frame) {
    std::byte* at = pixels.bytes.data() + frame * perFrame * 3;
    for (std::size_t i = 0; i < perFrame; ++i, at += pixel) {
      const double y = double(at[0]), b = double(at[sample]) - 128, r = double(at[2 * sample]) - 128;
      at[0] = limited(y + 1.402 * r);
      at[sample] = limited(y - 0.344136 * b - 0.714136 * r);
      at[2 * sample] = limited(y + 1.772 * b);
    }
  }
}

}  // namespace

std::uint64_t decodingBytes(const DicomFile& file) {
  std::error_code failed;
  const std::uint64_t stored = std::filesystem::file_size(file.path, failed);
  const std::uint64_t decoded = saturatingProduct(file.frameBytes(), file.frames.size());
  // GDCM keeps the file's bytes, and some of its decoders a second copy of the result.
  return saturatingSum(failed ? 0 : saturatingProduct(stored, 2), saturatingProduct(decoded, 2));
}

DicomPixels decodeDicomFile(const DicomFile& file) {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  DicomPixels pixels;
  gdcm::ImageReader reader;
  reader.SetFileName(file.path.c_str());
  try {
    if (!reader.Read()) failDicomPixels(file, "expected a picture, found damaged data");
    const gdcm::Image& image = reader.GetImage();
    checkDecodedDicom(file, image);
    if (file.bits) return {unpackedDicomBits(file, image)};
    if (isDeepRle(file, image)) return {decodedRle(file, image)};
    pixels.bytes = decodedByGdcm(file, image);
    checkDecodedDicom(file, image);  // a decoder may have corrected what the header said
    pixels.planar = file.samples == 3 && image.GetPlanarConfiguration() == 1;
    const std::string found = image.GetPhotometricInterpretation().GetString();
    if (!found.starts_with("YBR")) return pixels;
    if (sizeBytes(file.type) != 1) failDicomPixels(file, "expected YBR of 8 bits, found others");
    convertDicomToRgb(file, pixels);
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    failDicomPixels(file, "expected a picture, found data that cannot be decoded");
  }
  return pixels;
}

}  // namespace scolopax::io
#endif
